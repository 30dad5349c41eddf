/**
 * Which way up a mesh stands and from where it is seen best. Mesh files do not tell; the rules are those
 * of `tercet render`, in `crates/tercet-cli/src/picture/stance.rs`.
 */

/** What a mesh stands on lies in the lowest part of its height. */
const SOLE = 0.05;
/** A mesh that stands is not flatter than this part of its diagonal. */
const LEAST_HEIGHT = 0.02;
/** What it stands on spans at least this part of the ground below it … */
const LEAST_SUPPORT = 0.3;
/** … and so many times the part that it would span on its other side. */
const ADVANTAGE = 2;
/** Where the top of a mesh leans to, there is a head rather than a tail: the highest part of its height. */
const TOP = 0.2;
/** It leans to the back, or to the left, if its middle is so far from that of the whole. */
const LEANS_BACK = 0.22;
const LEANS_LEFT = 0.15;
/** The camera stands so far beside the front or the back. */
const BESIDE = Math.PI / 6;

type Vector = [number, number, number];

/** Triangles of a mesh: three coordinates a vertex, three vertices a face. */
export interface Triangles {
  positions: Float32Array;
  indices: Uint32Array;
}

/** Whether the Z axis points up rather than the Y axis: if the mesh would stand well with it and not without. */
export function standsOnZ(mesh: Triangles): boolean {
  const [onY, onZ] = [new Space(mesh, false).support(), new Space(mesh, true).support()];
  return onZ >= LEAST_SUPPORT && onZ > ADVANTAGE * onY;
}

/** Where a three-quarter view is taken from: radians around the upward axis, 0 in front. */
export function azimuth(mesh: Triangles, zUp: boolean): number {
  const [right, forward] = new Space(mesh, zUp).lean();
  const beside = right < -LEANS_LEFT ? -BESIDE : BESIDE;
  return forward < -LEANS_BACK ? Math.PI - beside : beside;
}

/** A mesh in coordinates to the right, up and forward, and its bounding box. */
class Space {
  private readonly low: Vector = [Infinity, Infinity, Infinity];
  private readonly extent: Vector;

  constructor(private readonly mesh: Triangles, private readonly zUp: boolean) {
    const high: Vector = [-Infinity, -Infinity, -Infinity];
    this.corners((corner) => {
      for (let k = 0; k < 3; k++) {
        this.low[k] = Math.min(this.low[k]!, corner[k]!);
        high[k] = Math.max(high[k]!, corner[k]!);
      }
    });
    this.extent = [high[0] - this.low[0], high[1] - this.low[1], high[2] - this.low[2]];
  }

  /** The part of the ground, as rectangles, that the vertices near it span; 0 if the mesh would fall over. */
  support(): number {
    const height = this.extent[1];
    const middle = this.middle(-Infinity);
    if (!middle || height <= LEAST_HEIGHT * Math.hypot(...this.extent)) return 0;
    const [low, high] = [[Infinity, 0, Infinity], [-Infinity, 0, -Infinity]] as [Vector, Vector];
    this.corners((corner) => {
      if (corner[1] >= this.low[1] + SOLE * height) return;
      for (const k of [0, 2]) {
        low[k] = Math.min(low[k]!, corner[k]!);
        high[k] = Math.max(high[k]!, corner[k]!);
      }
    });
    const part = (k: 0 | 2) => {
      const stands = low[k] <= middle[k] && middle[k] <= high[k] && this.extent[k] > 0;
      return stands ? (high[k] - low[k]) / this.extent[k] : 0;
    };
    return part(0) * part(2);
  }

  /** How far the middle of the top is from the box's, to the right and forward, as parts of its extent. */
  lean(): [number, number] {
    const middle = this.middle(this.low[1] + (1 - TOP) * this.extent[1]);
    const part = (k: 0 | 2) => (middle && this.extent[k] > 0 ? (middle[k] - this.low[k]) / this.extent[k] - 0.5 : 0);
    return [part(0), part(2)];
  }

  /** The middle of the faces whose middles are above a height, weighted by their areas. */
  private middle(above: number): Vector | undefined {
    const { indices } = this.mesh;
    const sum: Vector = [0, 0, 0];
    let weight = 0;
    for (let i = 0; i < indices.length; i += 3) {
      const [a, b, c] = [this.corner(i), this.corner(i + 1), this.corner(i + 2)];
      const centre = a.map((x, k) => (x + b[k]! + c[k]!) / 3) as Vector;
      if (centre[1] < above) continue;
      const [u, v] = [b, c].map((corner) => corner.map((x, k) => x - a[k]!)) as [Vector, Vector];
      const size = Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
      for (let k = 0; k < 3; k++) sum[k]! += size * centre[k]!;
      weight += size;
    }
    return weight > 0 ? (sum.map((x) => x / weight) as Vector) : undefined;
  }

  private corners(visit: (corner: Vector) => void): void {
    for (let i = 0; i < this.mesh.indices.length; i++) visit(this.corner(i));
  }

  private corner(i: number): Vector {
    const at = 3 * this.mesh.indices[i]!;
    const [x, y, z] = this.mesh.positions.subarray(at, at + 3) as unknown as Vector;
    // With Z up the front is −Y, as in the programs that have it so.
    return this.zUp ? [x, z, -y] : [x, y, z];
  }
}

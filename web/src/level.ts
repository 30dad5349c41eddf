/** What a file says of itself. */
export interface TercetInfo {
  version: number;
  /** What coordinates lie on: a lattice of `bits` (lossy), or an exact grid. */
  precision: "lattice" | "decimal" | "binary" | "refined";
  /** Bits of the longest side; 0 where every bit is kept. */
  bits: number;
  /** Whether vertices and faces come back in the order of the original. */
  orderKept: boolean;
  vertices: number;
  faces: number;
  /** Size of the whole file. */
  bytes: number;
  levels: LevelInfo[];
}

/** What a file's index says of a level. */
export interface LevelInfo {
  /** 0 is the base. */
  level: number;
  /**
   * A `late` level is an adaptive one whose positions come after all levels. Until then its new vertices
   * lie where they are estimated; `bytes` and `error` are those of the estimates. When they come, the
   * finest level is handed out again.
   */
  kind: "base" | "adaptive" | "sqrt3" | "butterfly" | "late";
  vertices: number;
  faces: number;
  /** Bytes from the file's start to the end of this level. */
  bytes: number;
  /** Root mean square distance from the original, as a part of the bounding box's diagonal. */
  error: number;
}

/**
 * A mesh as far as it has arrived. The finest level may come up to three times under the same number: as
 * it was coded, with the positions that were late, and as the original.
 */
export interface Level {
  /** 0 is the base. */
  level: number;
  /** Whether this is the original, to the precision that the file states. */
  restored: boolean;
  /** How many vertices are those of the level below, in their order; the further ones are new. */
  kept: number;
  /** Three coordinates a vertex. */
  positions: Float32Array<ArrayBuffer>;
  /** Three vertices a face. */
  indices: Uint32Array<ArrayBuffer>;
  /** Where the vertices lie without this level's details, if that was asked for and exists. */
  predicted?: Float32Array<ArrayBuffer>;
  /** Unit normals, three coordinates a vertex, if they were asked for. */
  normals?: Float32Array<ArrayBuffer>;
  /** FNV-1a of positions and indices in 16 hexadecimal digits, if that was asked for. */
  digest?: string;
  /** How long decoding it took. */
  milliseconds: number;
}

/**
 * The next level before all of it has arrived: topology and every vertex are there, but vertices whose details are
 * missing lie where they are expected. Nothing vouches for it; the level itself follows and is what it would be without it.
 */
export interface Preview extends Level {
  restored: false;
  /** How many of its vertices lie where they are expected. */
  pending: number;
}

/** The buffers of a level, to hand them from one thread to another without a copy. */
export function buffers(level: Level): ArrayBuffer[] {
  const arrays = [level.positions, level.indices, level.predicted, level.normals];
  return arrays.flatMap((array) => (array ? [array.buffer] : []));
}

/** Unit vertex normals, weighted by the area of the faces; zero where there is none. */
export function vertexNormals(positions: Float32Array, indices: Uint32Array): Float32Array<ArrayBuffer> {
  const normals = new Float32Array(positions.length);
  for (let i = 0; i < indices.length; i += 3) {
    const a = 3 * indices[i]!, b = 3 * indices[i + 1]!, c = 3 * indices[i + 2]!;
    const ax = positions[a]!, ay = positions[a + 1]!, az = positions[a + 2]!;
    const ux = positions[b]! - ax, uy = positions[b + 1]! - ay, uz = positions[b + 2]! - az;
    const vx = positions[c]! - ax, vy = positions[c + 1]! - ay, vz = positions[c + 2]! - az;
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const v of [a, b, c]) {
      normals[v]! += x;
      normals[v + 1]! += y;
      normals[v + 2]! += z;
    }
  }
  for (let v = 0; v < normals.length; v += 3) {
    const length = Math.hypot(normals[v]!, normals[v + 1]!, normals[v + 2]!);
    if (length > 0) for (let k = v; k < v + 3; k++) normals[k]! /= length;
  }
  return normals;
}

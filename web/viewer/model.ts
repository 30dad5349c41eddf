/** What has arrived of a file, level by level. */
import { BufferAttribute, type BufferGeometry } from "three";
import { vertexNormals, type Level, type Preview, type TercetInfo } from "tercet";
import { geometryOf } from "tercet/three";
import { division, extent, magnitudes } from "./colours";
import { creased, gathered } from "./creases";
import type { Triangles } from "./stance";

/** A level's geometry; of the finest one, vertices are split on creases. */
class Surface {
  readonly geometry: BufferGeometry;
  private readonly source: Uint32Array | undefined;

  /** @param isFinest Coarser levels have sharp edges that the mesh has not. */
  constructor(level: Level, isFinest: boolean) {
    if (!isFinest) {
      this.geometry = geometryOf(level);
      return;
    }
    const { positions, indices, predicted } = level;
    const shown = creased(positions, indices, level.normals ?? vertexNormals(positions, indices));
    this.source = shown.source;
    this.geometry = geometryOf({ ...level, positions: gathered(positions, shown.source, 3), indices: shown.indices, normals: shown.normals });
    if (predicted) this.set("predicted", predicted);
  }

  /** Sets three numbers for each of the level's vertices. */
  set(attribute: string, values: Float32Array<ArrayBuffer>): void {
    const shown = this.source ? gathered(values, this.source, 3) : values;
    this.geometry.setAttribute(attribute, new BufferAttribute(shown, 3));
  }
}

/** A level as it can be shown. */
export class Stage {
  readonly level: number;
  /** When it was there, in milliseconds since the file was asked for. */
  arrived: number;
  /** Milliseconds that decoding took. */
  decoding: number;
  /** Whether this is the original. */
  restored: boolean;
  /** The level as it was coded, and where it differs the original that it was completed to. */
  private surface: Surface;
  private original: Surface | undefined;
  /** Of the finest form. */
  counts: [vertices: number, faces: number];
  /** How far each vertex lies from where it was expected when it was new; NaN where nothing tells. */
  private readonly lengths: Float32Array;

  /** @param estimated Whether its vertices' positions are late: they lie where they are estimated. */
  constructor(
    private readonly decoded: Level, below: Stage | undefined, private readonly isFinest: boolean,
    public estimated: boolean, arrived: number,
  ) {
    this.level = decoded.level;
    this.arrived = arrived;
    this.decoding = decoded.milliseconds;
    this.restored = decoded.restored;
    this.surface = new Surface(decoded, isFinest);
    this.counts = countsOf(decoded);
    this.lengths = lengthsBelow(decoded, below?.lengths);
    if (!estimated) this.measure(decoded, decoded.kept);
  }

  get hasPrediction(): boolean {
    return this.decoded.predicted !== undefined;
  }

  /** What the level consists of, as it was coded. */
  get triangles(): Triangles {
    return this.decoded;
  }

  /** The geometry for a picture: of the mesh itself, or with what the division knows of it. */
  geometry(wanted: "mesh" | "division"): BufferGeometry {
    const { geometry } = wanted === "mesh" ? (this.original ?? this.surface) : this.surface;
    return geometry;
  }

  /** The finest level once more: as the original, or from `firstLate` on no longer estimated. */
  complete(again: Level, firstLate: number, arrived: number): void {
    if (this.estimated) {
      this.settle(again, firstLate);
    } else {
      this.original?.geometry.dispose();
      this.original = new Surface(again, this.isFinest);
    }
    this.counts = countsOf(again);
    this.arrived = arrived;
    this.decoding += again.milliseconds;
    this.restored = again.restored;
  }

  /** Colours the surface's vertices by their part in the division. */
  colourDivision(): void {
    const { positions, kept } = this.decoded;
    this.paint(division(positions.length / 3, kept));
  }

  /** Colours the surface's vertices by the lengths of their details; the range of the scale. */
  colourDetails(): [number, number] {
    const range = extent(this.lengths);
    this.paint(magnitudes(this.lengths, range));
    return range;
  }

  /** Normals of the level without details, which the one with them must not lend it. */
  preparePrediction(): void {
    const { predicted, indices } = this.decoded;
    if (!predicted || this.surface.geometry.hasAttribute("predictedNormal")) return;
    this.surface.set("predictedNormal", vertexNormals(predicted, indices));
  }

  dispose(): void {
    this.surface.geometry.dispose();
    this.original?.geometry.dispose();
  }

  /** Puts late vertices in their places: what was expected of them is what they were estimated to be. */
  private settle({ positions, normals }: Level, firstLate: number): void {
    const predicted = this.decoded.positions;
    this.measure({ positions, predicted }, firstLate);
    Object.assign(this.decoded, { positions, predicted, normals });
    // A picture that still shows the geometry from before is followed by one of this.
    this.surface.geometry.dispose();
    this.surface = new Surface(this.decoded, this.isFinest);
    this.estimated = false;
  }

  private measure({ positions, predicted }: Pick<Level, "positions" | "predicted">, from: number): void {
    if (!predicted) return;
    for (let v = from; v < this.lengths.length; v++) {
      const at = 3 * v;
      this.lengths[v] = Math.hypot(
        positions[at]! - predicted[at]!, positions[at + 1]! - predicted[at + 1]!, positions[at + 2]! - predicted[at + 2]!);
    }
  }

  private paint(colours: Float32Array<ArrayBuffer>): void {
    this.surface.set("color", colours);
  }
}

function countsOf({ positions, indices }: Level): [number, number] {
  return [positions.length / 3, indices.length / 3];
}

function lengthsBelow({ positions, predicted, kept }: Level, below: Float32Array | undefined): Float32Array {
  const found = new Float32Array(positions.length / 3).fill(NaN);
  if (predicted && below) found.set(below.subarray(0, kept));
  return found;
}

/** The level after the finest, as far as it has come. */
export class Arriving {
  readonly level: number;
  readonly counts: [vertices: number, faces: number];
  /** Vertices that lie where they are expected, and those that did so when nothing had come of the level. */
  readonly pending: number;
  readonly fresh: number;
  private readonly surface: Surface;

  constructor(preview: Preview, isFinest: boolean) {
    this.level = preview.level;
    this.counts = countsOf(preview);
    this.pending = preview.pending;
    this.fresh = this.counts[0] - preview.kept;
    this.surface = new Surface(preview, isFinest);
  }

  get geometry(): BufferGeometry {
    return this.surface.geometry;
  }
}

/** A file and its levels so far. */
export class Model {
  info: TercetInfo | undefined;
  digest: string | undefined;
  readonly stages: Stage[] = [];
  arriving: Arriving | undefined;

  /** Takes a level; its stage, new or completed. */
  take(level: Level, arrived: number): Stage {
    this.setArriving(undefined);
    const same = this.stages[level.level];
    if (level.digest) this.digest = level.digest;
    if (same) {
      const settled = this.stages.findLast(({ estimated }) => !estimated);
      same.complete(level, settled?.counts[0] ?? 0, arrived);
      return same;
    }
    const estimated = this.info?.levels[level.level]?.kind === "late";
    const stage = new Stage(level, this.stages[level.level - 1], this.isFinest(level), estimated, arrived);
    this.stages[level.level] = stage;
    return stage;
  }

  /** Takes what has come of the next level, in place of what had before. */
  takePreview(preview: Preview): Arriving {
    return this.setArriving(new Arriving(preview, this.isFinest(preview)));
  }

  get finest(): Stage | undefined {
    return this.stages.at(-1);
  }

  dispose(): void {
    this.setArriving(undefined);
    for (const stage of this.stages) stage.dispose();
  }

  private isFinest({ level }: Level): boolean {
    return level + 1 === this.info?.levels.length;
  }

  private setArriving<A extends Arriving | undefined>(arriving: A): A {
    this.arriving?.geometry.dispose();
    this.arriving = arriving;
    return arriving;
  }
}

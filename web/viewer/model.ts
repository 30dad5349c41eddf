/** What has arrived of a file, level by level. */
import { BufferAttribute, type BufferGeometry } from "three";
import { vertexNormals, type Level, type TercetInfo } from "tercet";
import { geometryOf } from "tercet/three";
import { division, extent, magnitudes } from "./colours";

/** A level as it can be shown. */
export class Stage {
  readonly level: number;
  /** When it was there, in milliseconds since the file was asked for. */
  arrived: number;
  /** Milliseconds that decoding took. */
  decoding: number;
  /** The level as it was coded, and where it differs the original that it was completed to. */
  private readonly surface: BufferGeometry;
  private original: BufferGeometry | undefined;
  /** How far each vertex lies from where it was expected when it was new; NaN in the base. */
  private readonly lengths: Float32Array;

  constructor(private readonly decoded: Level, below: Stage | undefined, arrived: number) {
    this.level = decoded.level;
    this.arrived = arrived;
    this.decoding = decoded.milliseconds;
    this.surface = geometryOf(decoded);
    this.lengths = lengths(decoded, below?.lengths);
  }

  get hasPrediction(): boolean {
    return this.decoded.predicted !== undefined;
  }

  /** How many vertices and faces the finest form of this level has. */
  get counts(): [number, number] {
    const shown = this.original ?? this.surface;
    return [shown.getAttribute("position").count, shown.getIndex()!.count / 3];
  }

  /** The geometry for a picture: of the mesh itself, or with what the division knows of it. */
  geometry(wanted: "mesh" | "division"): BufferGeometry {
    return wanted === "mesh" ? (this.original ?? this.surface) : this.surface;
  }

  /** The finest level once more, as the original. */
  complete(restored: Level, arrived: number): void {
    this.original = geometryOf(restored);
    this.arrived = arrived;
    this.decoding += restored.milliseconds;
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
    if (!predicted || this.surface.hasAttribute("predictedNormal")) return;
    this.surface.setAttribute("predictedNormal", new BufferAttribute(vertexNormals(predicted, indices), 3));
  }

  dispose(): void {
    this.surface.dispose();
    this.original?.dispose();
  }

  private paint(colours: Float32Array): void {
    this.surface.setAttribute("color", new BufferAttribute(colours, 3));
  }
}

function lengths({ positions, predicted, kept }: Level, below: Float32Array | undefined): Float32Array {
  const found = new Float32Array(positions.length / 3).fill(NaN);
  if (!predicted) return found;
  if (below) found.set(below.subarray(0, kept));
  for (let v = kept; v < found.length; v++) {
    const at = 3 * v;
    found[v] = Math.hypot(
      positions[at]! - predicted[at]!, positions[at + 1]! - predicted[at + 1]!, positions[at + 2]! - predicted[at + 2]!);
  }
  return found;
}

/** A file and its levels so far. */
export class Model {
  info: TercetInfo | undefined;
  digest: string | undefined;
  readonly stages: Stage[] = [];

  /** Takes a level; its stage, new or completed. */
  take(level: Level, arrived: number): Stage {
    const same = this.stages[level.level];
    if (level.digest) this.digest = level.digest;
    if (same) {
      same.complete(level, arrived);
      return same;
    }
    const stage = new Stage(level, this.stages[level.level - 1], arrived);
    this.stages[level.level] = stage;
    return stage;
  }

  get finest(): Stage | undefined {
    return this.stages.at(-1);
  }

  dispose(): void {
    for (const stage of this.stages) stage.dispose();
  }
}

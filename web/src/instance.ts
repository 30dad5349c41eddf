import { TercetError, type ErrorKind } from "./errors.js";
import { vertexNormals, type Level, type LevelInfo, type Preview, type TercetInfo } from "./level.js";
import type { Ahead } from "./previews.js";

/** What a decoder shall make of each level, and what it may use. */
export interface DecodeOptions {
  /** Bytes of memory that a file may ask for. Default: 1 GiB. */
  maxMemory?: number;
  /** Whether levels come with `predicted`. */
  predictions?: boolean;
  /** Whether levels come with `normals`. */
  normals?: boolean;
  /** Whether restored levels come with their `digest`. */
  digest?: boolean;
}

/** The module's exports; `crates/tercet-wasm/src/exports.rs` says what each does. */
interface Exports {
  memory: WebAssembly.Memory;
  tercet_start(maxMemory: number, predictions: number): void;
  tercet_input(length: number): number;
  tercet_push(length: number): void;
  tercet_next(): number;
  tercet_report(): number;
  tercet_digest(): bigint;
  tercet_finish(): number;
  tercet_discard_damaged(): number;
  tercet_info(): number;
  tercet_error(): number;
  tercet_text(): number;
  // Of the module that decodes levels in groups.
  tercet_glimpse?(place: number, length: number): number;
  tercet_preview?(): number;
}

const DEFAULT_MEMORY = 2 ** 30;
/** Bytes handed over at once: what is larger would make the module's memory grow for good. */
const PORTION = 1 << 16;

/** One file in one instance of the module, in this thread. Its memory goes with it. */
export class Instance {
  private readonly exports: Exports;
  private known: TercetInfo | undefined;

  constructor(module: WebAssembly.Module, private readonly options: DecodeOptions = {}) {
    this.exports = new WebAssembly.Instance(module).exports as unknown as Exports;
    this.guard(() => this.exports.tercet_start(options.maxMemory ?? DEFAULT_MEMORY, options.predictions ? 1 : 0));
  }

  /** Takes the next bytes of the file. */
  push(bytes: Uint8Array): void {
    for (let at = 0; at < bytes.length; at += PORTION) {
      const portion = bytes.subarray(at, at + PORTION);
      this.guard(() => {
        this.write(portion);
        this.exports.tercet_push(portion.length);
      });
    }
  }

  /**
   * The next level whose bytes have arrived, if any.
   *
   * @throws TercetError for what is wrong with the bytes; levels returned before stand.
   */
  next(): Level | undefined {
    const start = performance.now();
    const status = this.guard(() => this.exports.tercet_next());
    if (status < 0) throw this.failure();
    if (status === 0) return undefined;
    return this.guard(() => this.level(start));
  }

  /**
   * The next level as far as it has come, if these bytes show more of it: whole groups of a level in groups whose
   * first bytes have been pushed. What the file decodes to does not depend on it.
   */
  preview(ahead: Ahead[]): Preview | undefined {
    const start = performance.now();
    const { tercet_glimpse: glimpse, tercet_preview: preview } = this.exports;
    if (!glimpse || !preview) return undefined;
    return this.guard(() => {
      let groups = 0;
      for (const { place, bytes } of ahead) {
        this.write(bytes);
        groups += glimpse(place, bytes.length);
      }
      const pending = groups > 0 ? preview() : -1;
      return pending < 0 ? undefined : { ...this.level(start), restored: false, pending };
    });
  }

  /** What the file says of itself, once its header has arrived. */
  get info(): TercetInfo | undefined {
    this.known ??= this.guard(() => {
      const length = this.exports.tercet_info();
      return length > 0 ? parsedInfo(this.text(length)) : undefined;
    });
    return this.known;
  }

  /** @throws TercetError unless the whole file has arrived. */
  finish(): void {
    if (this.guard(() => this.exports.tercet_finish()) < 0) throw this.failure();
  }

  /** After a failed checksum: forgets the section; the byte of the file to go on from. */
  discardDamaged(): number | undefined {
    const byte = this.guard(() => this.exports.tercet_discard_damaged());
    return byte < 0 ? undefined : byte;
  }

  private write(bytes: Uint8Array): void {
    const address = this.exports.tercet_input(bytes.length);
    new Uint8Array(this.exports.memory.buffer, address, bytes.length).set(bytes);
  }

  private level(start: number): Level {
    const { buffer } = this.exports.memory;
    const report = new Uint32Array(buffer, this.exports.tercet_report(), 8);
    const [level, restored, kept, vertices, faces, positionsAt, facesAt, predictedAt] = report as unknown as number[];
    // The one copy: a module's memory cannot be handed to another thread.
    const points = (address: number) => new Float32Array(buffer, address, 3 * vertices!).slice();
    const positions = points(positionsAt!);
    const indices = new Uint32Array(buffer, facesAt!, 3 * faces!).slice();
    const milliseconds = performance.now() - start;
    const found: Level = { level: level!, restored: restored === 1, kept: kept!, positions, indices, milliseconds };
    if (predictedAt) found.predicted = points(predictedAt);
    if (this.options.normals) found.normals = vertexNormals(positions, indices);
    if (this.options.digest && found.restored) found.digest = this.digest();
    return found;
  }

  private digest(): string {
    return BigInt.asUintN(64, this.exports.tercet_digest()).toString(16).padStart(16, "0");
  }

  private text(length: number): string {
    const bytes = new Uint8Array(this.exports.memory.buffer, this.exports.tercet_text(), length);
    return new TextDecoder().decode(bytes);
  }

  private failure(): TercetError {
    const { kind, message } = JSON.parse(this.text(this.exports.tercet_error())) as { kind: ErrorKind; message: string };
    return new TercetError(kind, message);
  }

  /** A module that cannot have more memory stops at once, which must not look like an engine's fault. */
  private guard<T>(call: () => T): T {
    try {
      return call();
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      throw new TercetError("memory", "the module stopped: memory is exhausted", { cause: error });
    }
  }
}

type RawInfo = Omit<TercetInfo, "levels"> & { levels: (Omit<LevelInfo, "error"> & { errorBits: number })[] };

function parsedInfo(text: string): TercetInfo {
  const raw = JSON.parse(text) as RawInfo;
  const word = new DataView(new ArrayBuffer(4));
  const levels = raw.levels.map(({ errorBits, ...level }) => {
    word.setUint32(0, errorBits);
    return { ...level, error: word.getFloat32(0) };
  });
  return { ...raw, levels };
}

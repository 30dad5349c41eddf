import { TercetError, type ErrorKind } from "./errors.js";
import { compile, type ModuleSource } from "./module.js";

/** Mesh files that can be encoded, by their suffix. */
export const MESH_FORMATS = ["obj", "ply", "stl", "off"] as const;
export type MeshFormat = (typeof MESH_FORMATS)[number];

/** A mesh file that was encoded. */
export interface Encoded {
  /** The `.tct` file. */
  bytes: Uint8Array<ArrayBuffer>;
  /** What of the mesh file is not carried, and what had to be changed, one sentence each. */
  notes: string[];
  milliseconds: number;
}

interface Exports {
  memory: WebAssembly.Memory;
  tercet_input(length: number): number;
  tercet_encode(length: number, format: number, bits: number): number;
  tercet_encoded(): number;
  tercet_encode_error(): number;
  tercet_notes(): number;
  tercet_text(): number;
}

/**
 * Encodes a mesh file in this thread, which takes seconds for large ones: call it in a worker.
 *
 * @param bits Of the lattice's longest side, 4 to 24; left out, every bit is kept.
 * @throws TercetError for what is wrong with the mesh file.
 */
export async function encode(
  file: Uint8Array, format: MeshFormat, bits?: number, module?: ModuleSource,
): Promise<Encoded> {
  const compiled = await compile(module ?? new URL("./encoder.wasm", import.meta.url));
  const start = performance.now();
  const exports = (await WebAssembly.instantiate(compiled)).exports as unknown as Exports;
  const text = (length: number) =>
    JSON.parse(new TextDecoder().decode(new Uint8Array(exports.memory.buffer, exports.tercet_text(), length))) as unknown;
  try {
    const address = exports.tercet_input(file.length);
    new Uint8Array(exports.memory.buffer, address, file.length).set(file);
    const length = exports.tercet_encode(file.length, MESH_FORMATS.indexOf(format), bits ?? 0);
    if (length < 0) {
      const { kind, message } = text(exports.tercet_encode_error()) as { kind: ErrorKind; message: string };
      throw new TercetError(kind, message);
    }
    const bytes = new Uint8Array(exports.memory.buffer, exports.tercet_encoded(), length).slice();
    const notes = text(exports.tercet_notes()) as string[];
    return { bytes, notes, milliseconds: performance.now() - start };
  } catch (error) {
    if (!(error instanceof WebAssembly.RuntimeError)) throw error;
    throw new TercetError("memory", "the module stopped: memory is exhausted", { cause: error });
  }
}

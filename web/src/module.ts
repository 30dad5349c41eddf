import { TercetError } from "./errors.js";
import { once } from "./once.js";

/** Where a module's code comes from: already compiled, its bytes, or its address. */
export type ModuleSource = WebAssembly.Module | BufferSource | URL | string;

const own = once(() => compile(new URL("./decoder.wasm", import.meta.url)));

/** The decoder's compiled module: `source`, or the file beside this one, which is fetched once. */
export function decoderModule(source?: ModuleSource): Promise<WebAssembly.Module> {
  return source === undefined ? own() : compile(source);
}

/** The module that also encodes, and decodes every file: twice as large, fetched once where it is needed. */
export const fullModule = once(() => compile(new URL("./encoder.wasm", import.meta.url)));

/** Bytes of a file that tell its effort and whether it has groups: magic, version, the header's length in up to five, the flags. */
export const TELLING = 11;

/** Whether the file that begins like this has the effort `max`, or levels in groups, which the small module lacks. */
export function needsFullModule(start: Uint8Array): boolean {
  return (flagsOf(start) & 0x0c) === 0x08 || hasGroups(start);
}

/** Whether the file that begins like this has levels in groups. */
export function hasGroups(start: Uint8Array): boolean {
  return (flagsOf(start) & 0x10) !== 0;
}

/** The flags follow the header's length, whose bytes but for the last have their highest bit set. */
function flagsOf(start: Uint8Array): number {
  let length = 5;
  while (length < 9 && (start[length] ?? 0) & 0x80) length++;
  return start[length + 1] ?? 0;
}

/** Compiles a module. */
export async function compile(source: ModuleSource): Promise<WebAssembly.Module> {
  if (source instanceof WebAssembly.Module) return source;
  if (!(source instanceof URL) && typeof source !== "string") return WebAssembly.compile(source);
  try {
    const response = await fetch(source);
    if (!response.ok) throw new TercetError("status", `${String(source)}: ${response.status} ${response.statusText}`);
    // Streaming asks for a media type that not every file server knows.
    const typed = response.headers.get("content-type")?.startsWith("application/wasm");
    return await (typed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer()));
  } catch (error) {
    if (error instanceof TercetError) throw error;
    throw new TercetError("network", `the decoder cannot be loaded: ${String(error)}`, { cause: error });
  }
}

import { concatenated } from "./bytes.js";
import { compile, type ModuleSource } from "./module.js";
import { once } from "./once.js";
import type { Ahead } from "./previews.js";

/** The module's exports; `crates/tercet-receiver-wasm` says what each does. */
interface Exports {
  memory: WebAssembly.Memory;
  receiver_input(length: number): number;
  receiver_output(): number;
  receiver_start(maxMemory: number): number;
  receiver_push(): number;
  receiver_take(): number;
  receiver_glimpse(): number;
  receiver_place(): number;
  receiver_report(): number;
  receiver_is_complete(): number;
}

const DEFAULT_MEMORY = 2 ** 30;
/** What {@link Exports.receiver_push} answers where there is no memory. */
const REFUSED = 2;

const own = once(() => compile(new URL("./receiver.wasm", import.meta.url)));

/** The receiver's compiled module: `source`, or the file beside this one, which is fetched once. */
export function receiverModule(source?: ModuleSource): Promise<WebAssembly.Module> {
  return source === undefined ? own() : compile(source);
}

/** Gathers the datagrams of one file, and gives out its verified bytes in their order. */
export class Receiver {
  private readonly exports: Exports;

  /** @param identity The file's, from whom one trusts: all that comes is measured by it. */
  constructor(module: WebAssembly.Module, identity: Uint8Array, opening: Uint8Array, maxMemory = DEFAULT_MEMORY) {
    this.exports = new WebAssembly.Instance(module).exports as unknown as Exports;
    this.write(concatenated(identity, opening));
    // An opening that was damaged comes again as datagrams.
    this.exports.receiver_start(maxMemory);
  }

  /** Takes a datagram; false if there is no memory for it. */
  push(datagram: Uint8Array): boolean {
    this.write(datagram);
    return this.exports.receiver_push() !== REFUSED;
  }

  /** The next bytes of the file, if they have arrived. */
  take(): Uint8Array<ArrayBuffer> | undefined {
    const length = this.exports.receiver_take();
    return length > 0 ? this.read(length) : undefined;
  }

  /** Bytes that have come before their turn, if there are any that were not given before. They come again by {@link take}. */
  glimpse(): Ahead | undefined {
    const length = this.exports.receiver_glimpse();
    return length > 0 ? { place: this.exports.receiver_place(), bytes: this.read(length) } : undefined;
  }

  /** What the sender should know, as a datagram. */
  report(): Uint8Array<ArrayBuffer> {
    return this.read(this.exports.receiver_report());
  }

  get complete(): boolean {
    return this.exports.receiver_is_complete() === 1;
  }

  private write(bytes: Uint8Array): void {
    const address = this.exports.receiver_input(bytes.length);
    new Uint8Array(this.exports.memory.buffer, address, bytes.length).set(bytes);
  }

  private read(length: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.exports.memory.buffer, this.exports.receiver_output(), length).slice();
  }
}

import { concatenated } from "./bytes.js";
import { revived, TercetError } from "./errors.js";
import type { DecodeOptions } from "./instance.js";
import type { Level, Preview, TercetInfo } from "./level.js";
import { decoderModule, fullModule, hasGroups, needsFullModule, TELLING, type ModuleSource } from "./module.js";
import { WorkerPool } from "./pool.js";
import type { Ahead } from "./previews.js";
import type { Answer, Request } from "./sessions.js";

/** How to decode a file, and whom to tell. */
export interface DecoderOptions extends DecodeOptions {
  /** Threads to use. Default: a pool that all decoders share. */
  pool?: WorkerPool;
  /** The decoder's code, where it does not lie beside this module. */
  module?: ModuleSource;
  /** Hears what the file says of itself, before its first level. */
  onInfo?: (info: TercetInfo) => void;
  /** Hears each level as it is decoded. */
  onLevel?: (level: Level) => void;
  /**
   * Hears what can be shown of the next level while it arrives, some ten times a second at most. Only levels in groups
   * (`tercet encode --groups`) have previews, and only where bytes come before their turn: by {@link TercetDecoder.preview},
   * or in a download by the protocol `wt`. They are drawn or left; levels come as without them.
   */
  onPreview?: (preview: Preview) => void;
}

let sharedPool: WorkerPool | undefined;

/** The pool of decoders that name none. */
export function defaultPool(): WorkerPool {
  return (sharedPool ??= new WorkerPool());
}

type Step = Request extends infer R ? (R extends Request ? Omit<R, "session" | "call"> : never) : never;
interface Waiting {
  resolve: (value: number | undefined) => void;
  reject: (error: TercetError) => void;
}

/** A progressive decoder: bytes in, levels out, in another thread. */
export class TercetDecoder {
  /** What the file says of itself, once its header has arrived. */
  info: TercetInfo | undefined;
  /** The finest level so far. */
  level: Level | undefined;
  private readonly pool: WorkerPool;
  private readonly session: number;
  /** Settled when the session is open: its module is chosen by the file's first bytes. */
  private ready: Promise<unknown> | undefined;
  private start = new Uint8Array();
  private grouped = false;
  private readonly waiting = new Map<number, Waiting>();
  private lastCall = 0;
  private fate: TercetError | undefined;

  constructor(private readonly options: DecoderOptions = {}) {
    this.pool = options.pool ?? defaultPool();
    this.session = this.pool.open((answer) => this.hear(answer));
    decoderModule(options.module).catch(() => {}); // On its way while the file is; told to whoever pushes.
  }

  /**
   * Takes the next bytes of the file; settled once they are decoded. Bytes that fill their buffer are
   * handed over to the decoder's thread and are empty afterwards.
   *
   * @throws TercetError for what is wrong with the bytes; levels heard before stand.
   */
  async push(bytes: Uint8Array): Promise<void> {
    if (!this.ready) {
      if (this.start.length > 0) bytes = concatenated(this.start, bytes);
      if (bytes.length < TELLING) return void (this.start = bytes.slice());
      this.open(bytes);
    }
    await this.ready;
    await this.call({ do: "push", bytes });
  }

  /**
   * Looks at bytes that have come before their turn; settled once whoever hears previews has heard what they show.
   * They are handed over, and have to be pushed in their turn all the same.
   */
  async preview(ahead: Ahead[]): Promise<void> {
    if (!this.grouped) return;
    await this.ready;
    await this.call({ do: "preview", ahead });
  }

  /** @throws TercetError unless the whole file has arrived. */
  async finish(): Promise<void> {
    if (!this.ready) {
      this.open(this.start);
      await this.ready;
      await this.call({ do: "push", bytes: this.start });
    }
    await this.ready;
    await this.call({ do: "finish" });
  }

  /**
   * After an error of kind `checksum`: forgets the damaged section. Returns the byte of the file to go
   * on from; `undefined` if something else is wrong.
   */
  async discardDamaged(): Promise<number | undefined> {
    await this.ready;
    return this.call({ do: "discard" });
  }

  /** Frees the decoder's memory. What still waits for it fails. */
  close(): void {
    this.pool.close(this.session);
    this.fail(new TercetError("parameter", "the decoder was closed"));
  }

  private open(start: Uint8Array): void {
    const { maxMemory, predictions, normals, digest, module: source } = this.options;
    const options = Object.fromEntries(
      Object.entries({ maxMemory, predictions, normals, digest }).filter(([, value]) => value !== undefined));
    this.grouped = hasGroups(start);
    const module = source === undefined && needsFullModule(start) ? fullModule() : decoderModule(source);
    this.ready = module.then((module) => this.call({ do: "open", module, options }));
    this.ready.catch(() => {}); // Told to whoever pushes.
  }

  private call(step: Step): Promise<number | undefined> {
    if (this.fate) return Promise.reject(this.fate);
    const call = ++this.lastCall;
    return new Promise((resolve, reject) => {
      this.waiting.set(call, { resolve, reject });
      this.pool.send({ ...step, session: this.session, call } as Request);
    });
  }

  private hear(answer: Answer): void {
    switch (answer.is) {
      case "info":
        this.info = answer.info;
        this.options.onInfo?.(answer.info);
        return;
      case "level":
        this.level = answer.level;
        this.options.onLevel?.(answer.level);
        return;
      case "preview":
        this.options.onPreview?.(answer.preview);
        return;
      case "done":
        this.settle(answer.call)?.resolve(answer.value);
        return;
      case "failed":
        if (answer.call === 0) this.fail(revived(answer.error));
        else this.settle(answer.call)?.reject(revived(answer.error));
    }
  }

  private settle(call: number): Waiting | undefined {
    const waiting = this.waiting.get(call);
    this.waiting.delete(call);
    return waiting;
  }

  private fail(error: TercetError): void {
    this.fate ??= error;
    for (const { reject } of this.waiting.values()) reject(error);
    this.waiting.clear();
  }
}

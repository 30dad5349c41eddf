import { TercetDecoder, type DecoderOptions } from "./decoder.js";
import { TercetError } from "./errors.js";
import type { Level, TercetInfo } from "./level.js";
import { Pace } from "./pace.js";
import { Previews } from "./previews.js";
import { fetchRange, type Range, type RangeResponse } from "./range.js";
import { fetchSession } from "./ws.js";

/** How far to go; the whole file where nothing is said. */
export interface Goal {
  /** This level. */
  level?: number;
  /** The first level with no larger error, as a part of the bounding box's diagonal. */
  maxError?: number;
  /** The finest level that ends within so many bytes, but at least the base. */
  bytes?: number;
}

/** Something that went wrong and is being mended. */
export interface Mishap {
  /** A request that failed or broke off, or bytes that are not those that were written. */
  kind: "connection" | "damage";
  /** The byte of the file to go on from. */
  at: number;
  message: string;
}

/**
 * Ways to a file. `ws` is the command protocol of `tercet serve`, `wt` its datagrams on WebTransport, for links
 * that lose packets. Neither can carry headers. Where there are no datagrams, or they break, the rest comes by
 * the command protocol; where that is not offered, by `http`.
 */
export type Protocol = "http" | "ws" | "wt";

/** How to download a file, and whom to tell. */
export interface OpenOptions extends DecoderOptions {
  until?: Goal;
  /** How to ask for it. Default: `http`, which every server offers. */
  protocol?: Protocol;
  signal?: AbortSignal;
  /** Requests without a further byte, or sections damaged in a row, before giving up. Default: 6. */
  attempts?: number;
  /** Milliseconds without a byte after which a connection counts as broken. Default: 20 000. */
  patience?: number;
  /** Takes no more than this from the connection, to see how a slow one feels. Default: everything. */
  bytesPerSecond?: number;
  /** What to send with each request: credentials, headers. */
  request?: RequestInit;
  /** Hears of every arrival; `total` is known once the server or the file has told it. */
  onProgress?: (received: number, total: number | undefined) => void;
  onMishap?: (mishap: Mishap) => void;
}

/** Asked for at first where not the whole file is wanted: the header and some levels. */
const FIRST_REQUEST = 16_384;
const FIRST_WAIT = 100;
const LONGEST_WAIT = 5_000;

/**
 * Downloads a file from any server, decoding it as it arrives.
 *
 * The whole file is one request, so that nothing is slower than a plain download. A part of it takes
 * two: its first 16 KB, which tell where levels end, and the rest as a range; by the command protocol one.
 */
export function openUrl(url: string | URL, options: OpenOptions = {}): TercetStream {
  return new TercetStream(url, options);
}

/** A download in progress. Iterating over it gives its levels as they come. */
export class TercetStream implements AsyncIterable<Level> {
  /** The finest level, once all that was asked for has arrived. Rejected if that cannot be. */
  readonly done: Promise<Level>;
  /** Bytes of the file that have arrived. */
  received = 0;
  /** Size of the file, once known. */
  total: number | undefined;
  readonly pace: Pace;
  /** How bytes come at present. */
  protocol: Protocol;
  private readonly decoder: TercetDecoder;
  private readonly levels: Level[] = [];
  private readonly previews: Previews | undefined;
  private readonly aborter = new AbortController();
  /** Ends the request in flight. */
  private cut = new AbortController();
  private tag: string | undefined;
  /** Settled when everything pushed so far is decoded. */
  private decoded: Promise<void> = Promise.resolve();
  private damage: TercetError | undefined;
  private refetch = false;
  private wake: () => void = () => {};
  private ended = false;

  constructor(private readonly url: string | URL, private readonly options: OpenOptions = {}) {
    this.pace = new Pace(options.bytesPerSecond);
    this.protocol = options.protocol ?? "http";
    const { onPreview } = options;
    this.decoder = new TercetDecoder({
      ...options,
      onLevel: (level) => this.hear(level),
      onPreview: (preview) => { if (!this.aborter.signal.aborted) onPreview?.(preview); },
    });
    this.previews = onPreview && new Previews((ahead) => this.decoder.preview(ahead), () => this.idle());
    if (options.signal?.aborted) this.aborter.abort(options.signal.reason);
    options.signal?.addEventListener("abort", () => this.abort(options.signal?.reason), { once: true });
    this.done = this.run();
    this.done.catch(() => {}); // Told to whoever waits for it, or iterates.
  }

  /** What the file says of itself, once its header has arrived. */
  get info(): TercetInfo | undefined {
    return this.decoder.info;
  }

  /** Takes no further bytes until {@link resume}. */
  pause(): void {
    this.pace.pause();
  }

  resume(): void {
    this.pace.resume();
  }

  /** Ends the download; what is waited for is rejected with `reason`. */
  abort(reason: unknown = new DOMException("the download was aborted", "AbortError")): void {
    this.aborter.abort(reason);
    this.cut.abort(reason);
    this.previews?.end();
    this.pace.resume();
  }

  async *[Symbol.asyncIterator](): AsyncIterator<Level> {
    try {
      for (let next = 0; ; next++) {
        while (next >= this.levels.length && !this.ended) {
          await new Promise<void>((resolve) => (this.wake = resolve));
        }
        const level = this.levels[next];
        if (!level) break;
        yield level;
      }
      await this.done;
    } finally {
      if (!this.ended) this.abort();
    }
  }

  private hear(level: Level): void {
    this.levels.push(level);
    this.options.onLevel?.(level);
    this.wake();
  }

  private async run(): Promise<Level> {
    try {
      await this.download();
      const finest = this.decoder.level;
      if (!finest) throw new TercetError("internal", "the file has no level");
      return finest;
    } finally {
      this.ended = true;
      this.previews?.end();
      this.decoder.close();
      this.wake();
    }
  }

  private async download(): Promise<void> {
    const attempts = this.options.attempts ?? 6;
    let [failures, progress] = [0, -1];
    while (!this.reached()) {
      try {
        this.aborter.signal.throwIfAborted();
        await this.request();
      } catch (error) {
        this.aborter.signal.throwIfAborted();
        // A section that is damaged time and again is no progress, however often it arrives.
        const before = progress;
        const { cause, ...mishap } = await this.mended(error);
        progress = Math.max(progress, this.received);
        failures = progress > before ? 1 : failures + 1;
        if (failures >= attempts) throw cause;
        this.options.onMishap?.(mishap);
        await pause(Math.min(LONGEST_WAIT, FIRST_WAIT * 2 ** (failures - 1)), this.aborter.signal);
      }
    }
    if (this.received === this.info?.bytes) await this.decoder.finish();
  }

  /** Whether all that is asked for has arrived. */
  private reached(): boolean {
    return this.info !== undefined && this.received >= end(this.info, this.options.until);
  }

  /** The bytes to ask for next. */
  private wanted(): Range {
    const { until } = this.options;
    // The server knows where a level ends; datagrams come of all.
    if (this.protocol !== "http") return { from: this.received, to: undefined };
    if (this.info) {
      const to = end(this.info, until);
      return { from: this.received, to: to < this.info.bytes ? to : undefined };
    }
    return { from: this.received, to: until ? this.received + FIRST_REQUEST : undefined };
  }

  /** Asks for what is missing and hands on what comes. */
  private async request(): Promise<void> {
    this.cut = new AbortController();
    this.previews?.forget();
    const session = await this.datagrams();
    const range = this.wanted();
    const response = session ?? await this.open(range);
    this.check(response.tag);
    this.total = response.total ?? this.total;
    for await (const bytes of response.bytes) {
      const room = (range.to ?? Infinity) - this.received;
      for await (const portion of this.pace.portions(bytes.subarray(0, room))) {
        this.cut.signal.throwIfAborted();
        this.push(portion);
      }
      // By a session more may come than is wanted, which the header tells.
      if (this.options.until && !this.info) await this.decoded;
      if (bytes.length >= room || this.reached()) break;
    }
    this.cut.abort();
    await this.decoded;
    if (this.damage) throw this.damage;
    const last = this.total ?? this.info?.bytes;
    if (!this.reached() && last !== undefined && this.received >= last) await this.decoder.finish();
    if (!this.reached() && this.received < Math.min(range.to ?? Infinity, last ?? 0)) {
      throw new TercetError("network", `the connection ended at byte ${this.received}`);
    }
  }

  private connection() {
    return {
      signal: this.cut.signal,
      patience: this.options.patience ?? 20_000,
      paused: () => this.pace.paused,
    };
  }

  /** A file from its beginning by datagrams, if that is asked for and can be. They do not go on from the middle. */
  private async datagrams(): Promise<RangeResponse | undefined> {
    if (this.protocol !== "wt") return undefined;
    if (this.received === 0) {
      try {
        const { openSession } = await import("./webtransport.js");
        const { previews } = this;
        return await openSession(this.url, { ...this.connection(), onAhead: previews && ((ahead) => previews.offer(ahead)) });
      } catch (error) {
        this.aborter.signal.throwIfAborted();
        this.options.onMishap?.({ kind: "connection", at: 0, message: String(error) });
      }
    }
    this.protocol = this.options.request ? "http" : "ws";
    return undefined;
  }

  private open(range: Range): Promise<RangeResponse> {
    const { until, request } = this.options;
    const init = { ...request, ...(this.refetch ? { cache: "reload" as const } : {}) };
    const options = { ...this.connection(), init };
    return this.protocol === "ws"
      ? fetchSession(this.url, range, { ...options, until, tag: this.tag })
      : fetchRange(this.url, range, options);
  }

  private push(bytes: Uint8Array): void {
    this.received += bytes.length;
    this.previews?.forget(this.received);
    // The buffer is handed over, so it must hold nothing else.
    const whole = bytes.byteLength === bytes.buffer.byteLength ? bytes : bytes.slice();
    this.decoded = this.decoder.push(whole).catch((error: unknown) => {
      this.damage ??= error as TercetError;
      this.cut.abort();
    });
    this.options.onProgress?.(this.received, this.total ?? this.info?.bytes);
  }

  /** Settled when all bytes so far are decoded and further ones are let through. */
  private async idle(): Promise<void> {
    await this.pace.going();
    for (let seen: Promise<void> | undefined; seen !== this.decoded; ) await (seen = this.decoded);
  }

  /** Two parts of different files do not make one. */
  private check(tag: string | undefined): void {
    if (this.received > 0 && tag && this.tag && tag !== this.tag) {
      throw new TercetError("changed", "the file was replaced while it was downloaded");
    }
    this.tag = tag ?? this.tag;
  }

  /** Makes ready for another request, or throws what no request can mend. */
  private async mended(error: unknown): Promise<Mishap & { cause: TercetError }> {
    await this.decoded;
    const cause = this.damage ?? error;
    this.damage = undefined;
    const message = cause instanceof Error ? cause.message : String(cause);
    if (!(cause instanceof TercetError)) throw cause;
    if (cause.kind === "checksum") {
      const at = await this.decoder.discardDamaged();
      if (at === undefined) throw cause;
      this.received = at;
      this.refetch = true; // What lies in a cache may be the damaged copy.
      return { kind: "damage", at, message, cause };
    }
    if (cause.kind !== "network") throw cause;
    return { kind: "connection", at: this.received, message, cause };
  }
}

/** The byte up to which a file must arrive to meet the goal. */
export function end(info: TercetInfo, goal: Goal | undefined): number {
  const { levels, bytes } = info;
  const candidates: number[] = [];
  if (goal?.level !== undefined) candidates.push(Math.max(0, goal.level));
  if (goal?.maxError !== undefined) {
    const first = levels.findIndex((level) => level.error <= goal.maxError!);
    candidates.push(first < 0 ? levels.length - 1 : first);
  }
  if (goal?.bytes !== undefined) {
    if (goal.bytes >= bytes) candidates.push(levels.length - 1);
    else candidates.push(Math.max(0, levels.findLastIndex((level) => level.bytes <= goal.bytes!)));
  }
  const level = Math.min(...candidates, levels.length - 1);
  // The finest level is not complete without the sections after it.
  return level === levels.length - 1 && !(goal?.bytes! < bytes) ? bytes : levels[level]!.bytes;
}

function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, milliseconds);
    signal.addEventListener("abort", () => {
      clearTimeout(timer);
      reject(signal.reason);
    }, { once: true });
  });
}

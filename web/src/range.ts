import { TercetError } from "./errors.js";

/** Bytes of a file: from `from`, to before `to` or to its end. */
export interface Range {
  from: number;
  to: number | undefined;
}

/** What a server answers. */
export interface RangeResponse {
  /** The file's version, if the server names one. */
  tag: string | undefined;
  /** The file's size, if the server tells it. */
  total: number | undefined;
  /** The bytes from the range's start on, and perhaps beyond its end. */
  bytes: AsyncIterable<Uint8Array>;
}

export interface RangeOptions {
  signal: AbortSignal;
  init: RequestInit;
  /** Milliseconds without a byte after which the connection counts as broken. */
  patience: number;
  /** Whether it is we who take no bytes. */
  paused: () => boolean;
}

/**
 * Asks any HTTP server for a part of a file. One that knows no ranges sends the whole, of which the
 * beginning is passed over.
 *
 * @throws TercetError of kind `network` for what another request may mend, `status` or `changed` for
 * what it will not.
 */
export async function fetchRange(url: string | URL, range: Range, options: RangeOptions): Promise<RangeResponse> {
  const whole = range.from === 0 && range.to === undefined;
  const headers = new Headers(options.init.headers);
  if (!whole) headers.set("range", `bytes=${range.from}-${range.to === undefined ? "" : range.to - 1}`);
  let response: Response;
  try {
    response = await fetch(url, { ...options.init, headers, signal: options.signal });
  } catch (error) {
    throw broken(error);
  }
  if (!response.ok || !response.body) throw await refused(response, url);
  const [start, total] = extent(response);
  if (start > range.from) throw new TercetError("network", "the server sent another part than was asked for");
  const bytes = after(range.from - start, chunks(response.body, options));
  // A validator of the content alone: the same file may be sent in parts by some servers, whole by others.
  const tag = response.headers.get("etag")?.replace(/^W\//, "");
  return { tag, total, bytes };
}

/** The first byte that a response carries, and the size of the file. */
function extent(response: Response): [number, number | undefined] {
  if (response.status === 206) {
    const found = /^bytes (\d+)-\d*\/(\d+|\*)$/.exec(response.headers.get("content-range") ?? "");
    // A page of another origin may not be allowed to see this header: then it is what was asked for.
    if (!found) return [NaN, undefined];
    return [Number(found[1]), found[2] === "*" ? undefined : Number(found[2])];
  }
  // A compressed transfer's length says nothing of the file's.
  const length = response.headers.has("content-encoding") ? null : response.headers.get("content-length");
  return [0, length === null ? undefined : Number(length)];
}

async function* after(skip: number, source: AsyncIterable<Uint8Array>): AsyncGenerator<Uint8Array> {
  let left = Number.isNaN(skip) ? 0 : skip;
  for await (const bytes of source) {
    if (left < bytes.length) yield left > 0 ? bytes.subarray(left) : bytes;
    left = Math.max(0, left - bytes.length);
  }
}

/** A body's bytes; a connection that breaks or stalls is an error of kind `network`. */
async function* chunks(body: ReadableStream<Uint8Array>, options: RangeOptions): AsyncGenerator<Uint8Array> {
  const reader = body.getReader();
  try {
    for (;;) {
      const { done, value } = await patient(() => reader.read(), options);
      if (done) return;
      if (value.length > 0) yield value;
    }
  } catch (error) {
    throw broken(error);
  } finally {
    reader.cancel().catch(() => {}); // Of a connection that is gone already.
  }
}

/** What `act` gives, unless nothing comes for too long. */
export async function patient<T>(
  act: () => Promise<T>, { patience, paused, signal }: Pick<RangeOptions, "patience" | "paused" | "signal">,
): Promise<T> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const ended = new AbortController();
  const stalled = new Promise<never>((_, reject) => {
    const lose = () => reject(new TercetError("network", `nothing arrived for ${patience / 1000} s`));
    const wait = () => (timer = setTimeout(() => (paused() ? wait() : lose()), patience));
    wait();
    // Not every engine ends a read of a body that is aborted just as its last bytes have come.
    const abort = () => reject(signal.reason);
    if (signal.aborted) abort();
    else signal.addEventListener("abort", abort, { signal: ended.signal });
  });
  try {
    return await Promise.race([act(), stalled]);
  } finally {
    clearTimeout(timer);
    ended.abort();
  }
}

function broken(error: unknown): TercetError {
  if (error instanceof TercetError) return error;
  return new TercetError("network", error instanceof Error ? error.message : String(error), { cause: error });
}

/** Longest reason that is passed on. */
const LONGEST_REASON = 500;

async function refused(response: Response, url: string | URL): Promise<TercetError> {
  const status = `${response.status} ${response.statusText}`.trim();
  const isText = response.headers.get("content-type")?.startsWith("text/plain");
  // Servers that say why say it in a line; what is longer is a page for people.
  const reason = isText ? (await response.text().catch(() => "")).trim() : "";
  const told = reason && reason.length <= LONGEST_REASON ? `: ${reason}` : "";
  const message = `${String(url)}: ${status}${told}`;
  if (response.status === 416) return new TercetError("changed", `${message}: the file is shorter than it was`);
  const passing = response.status >= 500 || response.status === 408 || response.status === 429;
  return new TercetError(passing ? "network" : "status", message);
}

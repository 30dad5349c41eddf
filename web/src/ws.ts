import { crc32 } from "./crc32.js";
import { TercetError } from "./errors.js";
import { fetchRange, patient, type Range, type RangeOptions, type RangeResponse } from "./range.js";
import type { Goal } from "./stream.js";

/** What the server offers. */
const SUBPROTOCOL = "tercet.1";
/** Bytes of a data message before those of the file: the offset and the checksum. */
const HEAD = 12;
/** Milliseconds for the first word: where a proxy lets no WebSocket pass, nothing ever comes. */
const GREETING = 10_000;
/** A browser takes whatever comes: beyond the first, the server is asked to wait until the second. */
const MOST_WAITING = 1 << 15;
const FEW_WAITING = 1 << 13;

export interface SessionOptions extends RangeOptions {
  /** How far to go. */
  until: Goal | undefined;
  /** The version that the range is one of, as its first response had it. */
  tag: string | undefined;
}

/**
 * Asks `tercet serve` for a file by its command protocol (`spec/transport.md`, chapter 2), from
 * `range.from` to the goal: one request, however little is wanted. Where no session can be had, the
 * file is asked for as from any other server.
 *
 * @param url The file's address, or the session's, which begins with `ws:` or `wss:`.
 * @throws TercetError as {@link fetchRange}.
 */
export async function fetchSession(url: string | URL, range: Range, options: SessionOptions): Promise<RangeResponse> {
  const address = new URL(url, globalThis.location?.href);
  const isFile = address.protocol.startsWith("http");
  const session = new Session(sessionOf(address, range.from, options), options);
  try {
    const hello = await session.hello();
    return { ...hello, bytes: session.bytes(range.from) };
  } catch (error) {
    session.close();
    options.signal.throwIfAborted();
    // Why a WebSocket cannot be had is not told to a page: HTTP says it.
    if (isFile && !session.spoke) return fetchRange(url, range, options);
    throw error;
  }
}

/** The session's address, with the commands that are known beforehand. */
function sessionOf(file: URL, from: number, { until, tag }: SessionOptions): URL {
  const url = new URL(file);
  if (url.protocol.startsWith("http")) {
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.pathname = `/ws${url.pathname}`;
  }
  url.hash = "";
  if (from > 0) url.searchParams.append("command", `FROM ${from}${tag ? ` ${tag.replaceAll('"', "")}` : ""}`);
  url.searchParams.append("command", goalCommand(until));
  return url;
}

/** Of several goals the nearest counts, which only the header tells: the client leaves when it has enough. */
function goalCommand(goal: Goal | undefined): string {
  const { level, maxError, bytes } = goal ?? {};
  if (bytes !== undefined || (level === undefined) === (maxError === undefined)) return "UNTIL 0";
  return level !== undefined ? `LEVEL ${Math.max(0, level)}` : `UNTIL ${maxError}`;
}

/** A session, and what it has sent that nobody has taken yet. */
class Session {
  /** Whether the server has said anything. */
  spoke = false;
  private readonly socket: WebSocket;
  private readonly messages: (string | ArrayBuffer)[] = [];
  /** Bytes of the file among them. */
  private waiting = 0;
  private held = false;
  private wake: () => void = () => {};

  constructor(url: URL, private readonly options: SessionOptions) {
    this.socket = new WebSocket(url, SUBPROTOCOL);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => this.take(data);
    this.socket.onclose = () => this.wake();
  }

  /** The server's first word: the file's version and size. */
  async hello(): Promise<{ tag: string; total: number }> {
    const first = await this.next(Math.min(GREETING, this.options.patience));
    const found = typeof first === "string" ? /^HELLO 1 (\d+) \d+ ([0-9a-f]+)$/.exec(first) : undefined;
    if (!found) throw refusal(first);
    return { tag: `"${found[2]}"`, total: Number(found[1]) };
  }

  /** The file's bytes from `from` on, until the goal is reached or nobody wants more. */
  async *bytes(from: number): AsyncGenerator<Uint8Array> {
    let position = from;
    try {
      for (;;) {
        const message = await this.next();
        if (typeof message === "string") {
          if (message.startsWith("DONE ")) return;
          throw refusal(message);
        }
        const { offset, bytes } = dataOf(message);
        if (offset > position) throw new TercetError("network", `bytes ${position} to ${offset} are missing`);
        // The header comes unasked, once more after a break.
        const fresh = bytes.subarray(position - offset);
        position += fresh.length;
        if (fresh.length > 0) yield fresh;
      }
    } finally {
      this.send("CANCEL");
      this.close();
    }
  }

  close(): void {
    this.socket.close();
  }

  private take(message: string | ArrayBuffer): void {
    this.spoke = true;
    this.messages.push(message);
    this.weigh(message, 1);
    this.wake();
  }

  /** Counts what waits, and tells the server to wait or to go on. */
  private weigh(message: string | ArrayBuffer, sign: 1 | -1): void {
    if (typeof message !== "string") this.waiting += sign * message.byteLength;
    if (this.waiting > MOST_WAITING && !this.held) this.send("PAUSE");
    if (this.waiting < FEW_WAITING && this.held) this.send("RESUME");
    this.held = this.waiting > MOST_WAITING || (this.held && this.waiting >= FEW_WAITING);
  }

  private send(command: string): void {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(command);
  }

  private async next(patience = this.options.patience): Promise<string | ArrayBuffer> {
    while (this.messages.length === 0) {
      if (this.socket.readyState >= WebSocket.CLOSING) throw new TercetError("network", "the session was closed");
      await patient(() => new Promise<void>((resolve) => (this.wake = resolve)), { ...this.options, patience });
    }
    const message = this.messages.shift()!;
    this.weigh(message, -1);
    return message;
  }
}

/** What a data message carries. */
function dataOf(message: ArrayBuffer): { offset: number; bytes: Uint8Array } {
  const view = new DataView(message);
  const bytes = new Uint8Array(message).subarray(HEAD);
  if (bytes.length === 0 || view.getUint32(8, true) !== crc32(bytes)) {
    throw new TercetError("network", "a message was damaged on its way");
  }
  return { offset: Number(view.getBigUint64(0, true)), bytes };
}

/** What the server's last word means; what is no word of the protocol is no server of ours. */
function refusal(message: string | ArrayBuffer): TercetError {
  const [, code, words] = (typeof message === "string" && /^ERROR (\S+) ?(.*)$/s.exec(message)) || [];
  switch (code) {
    case undefined:
      return new TercetError("network", "the server does not speak the protocol");
    case "replaced":
      return new TercetError("changed", "the file was replaced while it was downloaded");
    case "range":
      return new TercetError("parameter", `the file has no such level: ${words}`);
    case "usage":
      return new TercetError("internal", `the server understands no command of ours: ${words}`);
    default:
      return new TercetError("network", `the server ended the session: ${words || code}`);
  }
}

import { concatenated } from "./bytes.js";
import { TercetError } from "./errors.js";
import type { Ahead } from "./previews.js";
import type { RangeResponse } from "./range.js";
import { Receiver, receiverModule } from "./receiver.js";

export interface SessionOptions {
  signal: AbortSignal;
  /** Milliseconds without a datagram of use after which the session counts as broken. */
  patience: number;
  /** Whether it is we who take no bytes. */
  paused: () => boolean;
  /** Hears bytes that come before their turn, after all that have had it. */
  onAhead?: ((ahead: Ahead) => void) | undefined;
}

/** Where a server holds sessions: the members of `/webtransport.json`. */
interface Offer {
  version: number;
  port: number;
  path: string;
  certificateHashes: string[];
}

/** Of an offer, and of a session's HELLO. */
const VERSION = 1;
/** Milliseconds that a session may take to begin, while there are other ways to the file. */
const BRIEFLY = 3_000;
/** Milliseconds between two reports. */
const REPORT_INTERVAL = 20;
/** Datagrams that may wait for us. */
const WAITING = 4_096;
/** Bytes of the longest line, and of the largest opening: a block. */
const [MOST_LINE, MOST_OPENING] = [4_096, 1_150 * 1_024];

/**
 * Asks a server for a file by datagrams on WebTransport: from its beginning, and all of it.
 *
 * @throws TercetError of kind `network` if that cannot be, or breaks: a request by HTTP may do better.
 */
export async function openSession(url: string | URL, options: SessionOptions): Promise<RangeResponse> {
  const file = new URL(url, globalThis.location?.href);
  const starting = new AbortController();
  const timer = setTimeout(() => starting.abort(lost("no session has begun")), BRIEFLY);
  const end = () => starting.abort(options.signal.reason);
  options.signal.addEventListener("abort", end, { once: true });
  let transport: WebTransport | undefined;
  try {
    const [module, offer] = await Promise.all([receiverModule(), find(file, starting.signal)]);
    transport = connect(file, offer);
    const session = await race(begin(transport, file), starting.signal);
    const receiver = new Receiver(module, session.identity, session.opening);
    const bytes = gather(transport, receiver, session.control, options);
    return { tag: `"${session.digest}"`, total: session.bytes, bytes };
  } catch (error) {
    transport?.close();
    throw broken(error);
  } finally {
    clearTimeout(timer);
    options.signal.removeEventListener("abort", end);
  }
}

/** The server's offer. It changes when the server renews its certificate. */
async function find(file: URL, signal: AbortSignal): Promise<Offer> {
  if (!("WebTransport" in globalThis)) throw lost("there is no WebTransport here");
  const response = await fetch(new URL("/webtransport.json", file), { signal, cache: "no-store" });
  if (!response.ok) throw lost("the server offers no WebTransport");
  const offer = (await response.json()) as Offer;
  if (offer.version !== VERSION) throw lost(`the server's sessions have version ${offer.version}`);
  return offer;
}

function connect(file: URL, offer: Offer): WebTransport {
  const hashes = offer.certificateHashes.map((digits) => ({ algorithm: "sha-256", value: fromHex(digits) }));
  const pinned = hashes.length > 0 ? { serverCertificateHashes: hashes } : {};
  const transport = new WebTransport(`https://${file.hostname}:${offer.port}${offer.path}`, {
    ...pinned,
    requireUnreliable: true,
  });
  // Whoever waits for something of it hears of its end.
  for (const promise of [transport.ready, transport.closed]) promise.catch(() => {});
  return transport;
}

/** Opens the control stream, names the file and takes what the server says of it. */
async function begin(transport: WebTransport, file: URL) {
  await transport.ready;
  transport.datagrams.incomingHighWaterMark = WAITING;
  const { readable, writable } = (await transport.createBidirectionalStream()) as {
    readable: ReadableStream<Uint8Array>;
    writable: WritableStream<Uint8Array>;
  };
  const writer = writable.getWriter();
  await writer.write(new TextEncoder().encode(`OPEN ${file.pathname.slice(1)}\n`));
  const control = new Control(readable);
  const line = await control.line();
  const [word, version, bytes, opening, digest, identity] = line.split(" ");
  if (word !== "HELLO" || Number(version) !== VERSION || !(Number(opening) <= MOST_OPENING)) throw refusal(line);
  return {
    control,
    bytes: Number(bytes),
    digest,
    identity: fromHex(identity ?? ""),
    opening: await control.take(Number(opening)),
  };
}

/**
 * The file's bytes as they are complete, while reports keep the server going.
 *
 * Datagrams are taken whether or not the bytes are wanted yet: what is not taken would be sent again.
 */
async function* gather(
  transport: WebTransport,
  receiver: Receiver,
  control: Control,
  { signal, patience, paused, onAhead }: SessionOptions,
): AsyncGenerator<Uint8Array> {
  const ended = new AbortController();
  const end = () => ended.abort(signal.reason);
  signal.addEventListener("abort", end, { once: true });
  let [heard, wake] = [performance.now(), () => {}];
  const taking = take(transport, receiver, control, () => {
    heard = performance.now();
    wake();
  });
  taking.then(() => transport.close(), (error: unknown) => ended.abort(error));
  const watch = setInterval(() => {
    if (paused() || receiver.complete) heard = performance.now();
    if (performance.now() - heard > patience) ended.abort(lost(`nothing arrived for ${patience / 1000} s`));
  }, 1_000);
  try {
    for (;;) {
      for (let bytes = receiver.take(); bytes; bytes = receiver.take()) yield bytes;
      if (receiver.complete) return;
      for (let ahead = onAhead && receiver.glimpse(); ahead; ahead = receiver.glimpse()) onAhead!(ahead);
      await race(new Promise<void>((resolve) => (wake = resolve)), ended.signal);
    }
  } catch (error) {
    throw broken(error);
  } finally {
    clearInterval(watch);
    signal.removeEventListener("abort", end);
    transport.close();
  }
}

/** Takes datagrams and sends reports until the file is complete; throws when the session ends before. */
async function take(transport: WebTransport, receiver: Receiver, control: Control, heard: () => void): Promise<void> {
  const incoming = (transport.datagrams.readable as ReadableStream<Uint8Array>).getReader();
  const outgoing = (transport.datagrams.writable as WritableStream<Uint8Array>).getWriter();
  const report = () => outgoing.write(receiver.report()).catch(() => {}); // Another one follows.
  const reports = setInterval(report, REPORT_INTERVAL);
  const farewell = control.line().then((line) => Promise.reject(refusal(line)));
  farewell.catch(() => {}); // It comes, or does not matter any more.
  try {
    while (!receiver.complete) {
      const { done, value } = await Promise.race([incoming.read(), farewell]);
      if (done) throw lost("the session ended");
      if (!receiver.push(value)) throw new TercetError("limit", "the file needs more memory than is granted");
      heard();
    }
  } finally {
    clearInterval(reports);
  }
}

/** The stream on which lines and the opening come. */
class Control {
  private readonly reader: ReadableStreamDefaultReader<Uint8Array>;
  private read: Uint8Array = new Uint8Array(0);

  constructor(stream: ReadableStream<Uint8Array>) {
    this.reader = stream.getReader();
  }

  async line(): Promise<string> {
    for (;;) {
      const end = this.read.indexOf(0x0a);
      if (end >= 0) return new TextDecoder().decode((await this.take(end + 1)).subarray(0, end));
      if (this.read.length > MOST_LINE) throw lost("the server says what means nothing");
      await this.more();
    }
  }

  async take(length: number): Promise<Uint8Array> {
    while (this.read.length < length) await this.more();
    const taken = this.read.subarray(0, length);
    this.read = this.read.subarray(length);
    return taken;
  }

  private async more(): Promise<void> {
    const { done, value } = await this.reader.read();
    if (done) throw lost("the session ended");
    this.read = concatenated(this.read, value);
  }
}

/** What comes first: the promise's outcome or the signal. */
async function race<T>(promise: Promise<T>, signal: AbortSignal): Promise<T> {
  const heard = new AbortController();
  const aborted = new Promise<never>((_, reject) => {
    const lose = () => reject(signal.reason);
    if (signal.aborted) lose();
    else signal.addEventListener("abort", lose, { signal: heard.signal });
  });
  try {
    return await Promise.race([promise, aborted]);
  } finally {
    heard.abort();
  }
}

function fromHex(digits: string): Uint8Array<ArrayBuffer> {
  if (!/^[0-9a-f]{64}$/.test(digits)) throw lost("the server's digest is none");
  return Uint8Array.from(digits.match(/../g)!, (pair) => parseInt(pair, 16));
}

function refusal(line: string): TercetError {
  const words = /^ERROR (\S+) (.*)$/.exec(line);
  return lost(words ? `the server refuses: ${words[2]}` : "the server says what means nothing");
}

function lost(message: string): TercetError {
  return new TercetError("network", message);
}

function broken(error: unknown): unknown {
  if (error instanceof TercetError || (error instanceof DOMException && error.name === "AbortError")) return error;
  return new TercetError("network", error instanceof Error ? error.message : String(error), { cause: error });
}

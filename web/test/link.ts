/**
 * A plain file server that knows nothing of Tercet, behind an imitated link: what a static host does,
 * and what can go wrong on the way.
 */
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo, Socket } from "node:net";
import { readFile, stat } from "node:fs/promises";
import { extname, join, normalize } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

const TYPES: Record<string, string> = {
  ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm",
};

/** How the link behaves towards one path. */
export interface Weather {
  /** Bytes per second downstream; may change while a file is sent. */
  rate?: number;
  /** Milliseconds from one end to the other and back. */
  roundTrip?: number;
  /** Breaks the connection after so many bytes of the file, once for each entry. */
  cuts?: number[];
  /** Spoils the byte at this place of the file, so many times. */
  damage?: { at: number; times: number };
  /** Holds back what comes after so many bytes of the file; may be raised meanwhile. */
  stopsAt?: number;
  /** Sends whole files, whatever range is asked for. */
  ignoresRanges?: boolean;
}

/** What was asked and sent. */
export interface Sent {
  path: string;
  range: string | undefined;
  bytes: number;
}

export class Link {
  /** By path; others are served at once. */
  readonly weather = new Map<string, Weather>();
  readonly sent: Sent[] = [];
  readonly files = new Map<string, Buffer>();
  private readonly server: Server;
  private readonly greeted = new WeakSet<Socket>();

  /** @param folder Served below `/view/`. */
  constructor(private readonly folder?: string) {
    this.server = createServer((request, response) => {
      this.answer(request, response).catch(() => response.destroy());
    });
  }

  async listen(): Promise<string> {
    await new Promise<void>((resolve) => this.server.listen(0, "127.0.0.1", resolve));
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}`;
  }

  async close(): Promise<void> {
    this.server.closeAllConnections();
    await new Promise((resolve) => this.server.close(resolve));
  }

  /** Ends connections that nothing is sent on, so that the next request needs a new one. */
  forget(): void {
    this.server.closeIdleConnections();
  }

  /** Bytes sent of a file so far. */
  bytesOf(path: string): number {
    return this.sent.filter((sent) => sent.path === path).reduce((sum, sent) => sum + sent.bytes, 0);
  }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = decodeURIComponent(new URL(request.url ?? "/", "http://any").pathname);
    const body = await this.find(path);
    if (!body) return void response.writeHead(404, { "content-type": "text/plain" }).end("there is no such file\n");
    const weather = this.weather.get(path) ?? {};
    await this.travel(request.socket, weather);
    const range = weather.ignoresRanges ? undefined : request.headers.range;
    const [from, to] = extent(range, body.length);
    if (from >= body.length && range) {
      return void response.writeHead(416, { "content-range": `bytes */${body.length}` }).end();
    }
    const sent: Sent = { path, range: request.headers.range, bytes: 0 };
    this.sent.push(sent);
    const file = path.endsWith("/") ? ".html" : extname(path);
    response.writeHead(range ? 206 : 200, {
      "content-type": TYPES[file] ?? "application/octet-stream",
      "content-length": to - from,
      "accept-ranges": "bytes",
      "etag": `"${body.length}"`,
      "cache-control": "no-store",
      ...(range ? { "content-range": `bytes ${from}-${to - 1}/${body.length}` } : {}),
    });
    await this.send(response, body, [from, to], weather, sent);
  }

  private async find(path: string): Promise<Buffer | undefined> {
    if (this.files.has(path)) return this.files.get(path);
    if (!this.folder || !path.startsWith("/view/")) return undefined;
    const file = join(this.folder, normalize(path.slice(5)), path.endsWith("/") ? "index.html" : "");
    return (await stat(file).catch(() => undefined))?.isFile() ? readFile(file) : undefined;
  }

  /** The request's way here, and on a new connection the greeting's before it; the answer's way back. */
  private async travel(socket: Socket, { roundTrip = 0 }: Weather): Promise<void> {
    const greeting = this.greeted.has(socket) ? 0 : roundTrip;
    this.greeted.add(socket);
    if (roundTrip > 0) await sleep(greeting + roundTrip);
  }

  private async send(
    response: ServerResponse, body: Buffer, [from, to]: [number, number], weather: Weather, sent: Sent,
  ): Promise<void> {
    const { cuts, damage } = weather;
    const cut = cuts?.[0];
    let due = performance.now();
    // Packets on a slow link, else as much as there is.
    for (let at = from, step; at < to && !response.destroyed; at += step) {
      step = weather.rate ? Math.min(1400, Math.ceil(weather.rate / 10)) : 1 << 16;
      if (cut !== undefined && at >= cut) {
        cuts!.shift();
        // What was sent arrives; then the connection is gone.
        return void response.socket?.destroySoon();
      }
      while (at >= (weather.stopsAt ?? Infinity) && !response.destroyed) await sleep(20);
      const portion = Buffer.from(body.subarray(at, Math.min(to, at + step, heldFrom(at, weather))));
      step = portion.length;
      if (damage && damage.times > 0 && damage.at >= at && damage.at < at + portion.length) {
        portion[damage.at - at]! ^= 0x10;
        damage.times -= 1;
      }
      if (weather.rate) due += (1000 * portion.length) / weather.rate;
      const early = due - performance.now();
      if (early > 1) await sleep(early);
      await new Promise((resolve) => response.write(portion, resolve));
      sent.bytes += portion.length;
    }
    response.end();
  }
}

/** The byte that is not sent for now. */
function heldFrom(at: number, { stopsAt = Infinity }: Weather): number {
  return stopsAt > at ? stopsAt : Infinity;
}

function extent(range: string | undefined, length: number): [number, number] {
  const found = /^bytes=(\d+)-(\d*)$/.exec(range ?? "");
  if (!found) return [0, length];
  return [Number(found[1]), found[2] ? Math.min(length, Number(found[2]) + 1) : length];
}

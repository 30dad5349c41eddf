/** The client's side of the command protocol, against a server in this process. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, beforeEach, test } from "node:test";
import { crc32 } from "node:zlib";
import { openUrl, WorkerPool, type Mishap, type OpenOptions } from "tercet";
import { fixture, setting } from "../fixtures.js";

const module = await WebAssembly.compile(readFileSync(join(setting("TERCET_WASM"), "decoder.wasm")));
const { bytes, digests, ends } = fixture("scan");
const DIGEST = "ab".repeat(32);
/** Bytes of a data message. */
const PORTION = 4096;

/** What the server does wrong, once. */
let fault: { at: number; does: "close" | "damage" | "replaced" } | undefined;
/** What each session was asked, in its address and afterwards. */
let asked: string[][] = [];

/** A WebSocket whose other end is a server of one file. */
class Socket {
  static readonly OPEN = 1;
  static readonly CLOSING = 2;
  readyState = 0;
  binaryType = "blob";
  onmessage: ((event: { data: string | ArrayBuffer }) => void) | undefined;
  onclose: (() => void) | undefined;
  private readonly commands: string[];
  private position = 0;
  private goal = bytes.length;
  private paused = false;

  constructor(url: URL, protocol: string) {
    assert.equal(protocol, "tercet.1");
    assert.match(url.href, /^ws:\/\/host\/ws\/scan\.tct\?/);
    this.commands = url.searchParams.getAll("command");
    asked.push(this.commands);
    for (const command of this.commands) {
      const [word, number] = command.split(" ");
      if (word === "FROM") this.position = Number(number);
      if (word === "LEVEL") this.goal = ends[Number(number)]!;
    }
    setImmediate(() => {
      this.readyState = Socket.OPEN;
      this.say(`HELLO 1 ${bytes.length} 100 ${DIGEST}`);
      this.turn();
    });
  }

  send(command: string): void {
    this.commands.push(command);
    if (command === "PAUSE" || command === "RESUME") this.paused = command === "PAUSE";
  }

  close(): void {
    this.readyState = 3;
    this.onclose?.();
  }

  private say(data: string | ArrayBuffer): void {
    this.onmessage?.({ data });
  }

  /** Sends a message, and later the next one. */
  private turn(): void {
    if (this.readyState !== Socket.OPEN) return;
    if (!this.paused) {
      const end = Math.min(this.goal, this.position + PORTION);
      const does = fault && this.position >= fault.at ? fault.does : undefined;
      if (does) fault = undefined;
      if (does === "close") return this.close();
      if (does === "replaced") return this.say("ERROR replaced the file was replaced");
      if (end === this.position) return this.say(`DONE ${end}`);
      const message = new Uint8Array(12 + end - this.position);
      message.set(bytes.subarray(this.position, end), 12);
      const view = new DataView(message.buffer);
      view.setBigUint64(0, BigInt(this.position), true);
      view.setUint32(8, crc32(message.subarray(12)), true);
      if (does === "damage") message[20]! ^= 1;
      this.say(message.buffer);
      this.position = end;
    }
    setImmediate(() => this.turn());
  }
}

const own = globalThis.WebSocket;
Object.assign(globalThis, { WebSocket: Socket });
after(() => void Object.assign(globalThis, { WebSocket: own }));
beforeEach(() => {
  fault = undefined;
  asked = [];
});

function open(options: OpenOptions = {}) {
  const mishaps: Mishap[] = [];
  const stream = openUrl("http://host/scan.tct", {
    protocol: "ws", module, pool: new WorkerPool(0), digest: true, onMishap: (mishap) => mishaps.push(mishap), ...options,
  });
  return { stream, mishaps };
}

test("a whole file is one session", async () => {
  const { stream } = open();
  assert.equal((await stream.done).digest, digests.at(-1));
  assert.deepEqual(asked, [["UNTIL 0", "CANCEL"]]);
});

test("a goal is told to the server, and nothing beyond it is sent", async () => {
  const { stream } = open({ until: { level: 4 } });
  assert.equal((await stream.done).level, 4);
  assert.equal(stream.received, ends[4]);
  assert.equal(asked[0]![0], "LEVEL 4");
});

test("of several goals the nearest is met by leaving", async () => {
  const { stream } = open({ until: { level: 6, maxError: 0.5 } });
  await stream.done;
  assert.equal(stream.received, PORTION);
  assert.deepEqual(asked, [["UNTIL 0", "CANCEL"]]);
});

test("a session that ends, and a message that is damaged, are gone on from", async () => {
  for (const does of ["close", "damage"] as const) {
    asked = [];
    fault = { at: 3 * PORTION, does };
    const { stream, mishaps } = open();
    assert.equal((await stream.done).digest, digests.at(-1));
    assert.deepEqual(mishaps.map(({ kind, at }) => [kind, at]), [["connection", 3 * PORTION]]);
    assert.deepEqual(asked[1]!.slice(0, 2), [`FROM ${3 * PORTION} ${DIGEST}`, "UNTIL 0"]);
  }
});

test("a file that was replaced is not mixed with the one before", async () => {
  fault = { at: 3 * PORTION, does: "replaced" };
  await assert.rejects(open().stream.done, { name: "TercetError", kind: "changed" });
});

test("a client that takes nothing has the server wait, and go on", async () => {
  const { stream } = open({ onLevel: ({ level }) => { if (level === 2) stream.pause(); } });
  while (!asked[0]?.includes("PAUSE")) await new Promise((resolve) => setTimeout(resolve, 10));
  assert.ok(stream.received < bytes.length / 2);
  stream.resume();
  assert.equal((await stream.done).digest, digests.at(-1));
  assert.deepEqual(asked, [["UNTIL 0", "PAUSE", "RESUME", "CANCEL"]]);
});

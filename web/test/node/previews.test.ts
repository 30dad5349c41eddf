/** Levels in groups by datagrams, over a link in this process that loses some of them. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { basename, join } from "node:path";
import { afterEach, beforeEach, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";
import { openUrl, WorkerPool, type Level, type OpenOptions, type Preview } from "tercet";
import { fixture, sent, setting, type Sent } from "../fixtures.js";

/** Milliseconds from one datagram to the next. */
const BETWEEN_DATAGRAMS = 12;
/** Milliseconds between two previews, less what timers are too early by. */
const BETWEEN_PREVIEWS = 95;
/** Part of the datagrams that is lost. */
const LOSS = 0.1;

/** What is sent in sessions, and how many were closed. */
let sending: Sent & { name: string; size: number };
let closed = 0;

/** A session whose other end sends all that it has, whatever is reported. */
class Session {
  readonly ready = Promise.resolve();
  readonly closed = new Promise<void>(() => {});
  readonly datagrams;
  private open = true;

  constructor() {
    const datagrams = arriving();
    this.datagrams = {
      incomingHighWaterMark: 1,
      readable: new ReadableStream<Uint8Array>({
        pull: async (controller) => {
          await sleep(BETWEEN_DATAGRAMS);
          const next = datagrams.shift();
          if (next && this.open) controller.enqueue(Uint8Array.from(next));
          else controller.close();
        },
      }),
      writable: new WritableStream<Uint8Array>(),
    };
  }

  async createBidirectionalStream() {
    const { name, size, identity, opening } = sending;
    const hello = `HELLO 1 ${size} ${opening.length} ${"ab".repeat(32)} ${identity.toString("hex")}\n`;
    const readable = new ReadableStream<Uint8Array>({
      start: (controller) => controller.enqueue(Buffer.concat([Buffer.from(hello), opening])),
    });
    const writable = new WritableStream<Uint8Array>({
      write: (line) => assert.equal(Buffer.from(line).toString(), `OPEN ${name}.tct\n`),
    });
    return { readable, writable };
  }

  close(): void {
    closed += this.open ? 1 : 0;
    this.open = false;
  }
}

/** The datagrams that are not lost. */
function arriving(): Buffer[] {
  let seed = 7;
  return sending.datagrams.filter(() => (seed = (seed * 48271) % 2147483647) / 2147483647 >= LOSS);
}

const { fetch } = globalThis;
beforeEach(() => {
  closed = 0;
  Object.assign(globalThis, { WebTransport: Session });
  globalThis.fetch = async (address) => {
    const { pathname } = new URL(String(address));
    if (pathname.endsWith(".wasm")) return new Response(readFileSync(join(setting("TERCET_WASM"), basename(pathname))));
    assert.equal(pathname, "/webtransport.json");
    return Response.json({ version: 1, port: 1, path: "/", certificateHashes: [] });
  };
});
afterEach(() => {
  globalThis.fetch = fetch;
  Reflect.deleteProperty(globalThis, "WebTransport");
});

function open(name: string, options: OpenOptions = {}) {
  sending = { name, size: fixture(name).bytes.length, ...sent(name) };
  return openUrl(`http://host/${name}.tct`, { protocol: "wt", pool: new WorkerPool(0), digest: true, ...options });
}

for (const name of ["groups", "groups-butterfly"]) {
  test(`${name}: the next level is shown as it arrives, and then is what it would be anyway`, async (t) => {
    const { digests } = fixture(name);
    const levels: Level[] = [];
    const previews: (Preview & { at: number; after: number })[] = [];
    const stream = open(name, {
      onLevel: (level) => levels.push(level),
      onPreview: (preview) => previews.push({ ...preview, at: performance.now(), after: levels.length }),
    });
    assert.equal((await stream.done).digest, digests.at(-1));
    assert.equal(stream.protocol, "wt");
    assert.equal(levels.length, digests.length);
    t.diagnostic(`level: vertices pending: ${previews.map(({ level, pending }) => `${level}: ${pending}`).join(", ")}`);
    assert.ok(previews.length > 1, `${previews.length}`);
    previews.forEach((preview, i) => {
      const { level, restored, kept, pending, positions, indices, at, after } = preview;
      assert.deepEqual([level, restored, kept], [after, false, levels[level]!.kept]);
      assert.deepEqual(indices, levels[level]!.indices, "topology is never broken");
      const away = positions.filter((x, k) => x !== levels[level]!.positions[k]).length;
      assert.ok(pending < positions.length / 3 - kept && away <= 3 * pending, `${away} coordinates of ${pending} vertices`);
      const before = previews[i - 1];
      if (before) assert.ok(at - before.at >= BETWEEN_PREVIEWS, `${at - before.at} ms`);
      if (before?.level === level) assert.ok(pending < before.pending);
    });
    // Those who want none are given the same levels.
    const plain: Level[] = [];
    for await (const level of open(name)) plain.push(level);
    assert.deepEqual(plain.map(withoutTime), levels.map(withoutTime));
  });
}

function withoutTime({ milliseconds: _, ...level }: Level): Omit<Level, "milliseconds"> {
  return level;
}

test("nothing is shown after the end of a download", async () => {
  let previews = 0;
  const stream = open("groups", { onPreview: () => { previews += 1; stream.abort(); } });
  await assert.rejects(stream.done, { name: "AbortError" });
  await sleep(300);
  assert.deepEqual([previews, closed], [1, 1]);
});

test("nothing is shown while a download pauses", async () => {
  let paused = false;
  let previews = 0;
  const stream = open("groups", {
    onPreview: () => {
      assert.ok(!paused);
      if (++previews > 1) return;
      stream.pause();
      paused = true;
      setTimeout(() => { paused = false; stream.resume(); }, 250);
    },
  });
  assert.equal((await stream.done).digest, fixture("groups").digests.at(-1));
  assert.ok(previews > 0);
});

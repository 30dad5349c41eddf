import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, beforeEach, test } from "node:test";
import { openUrl, WorkerPool, type Mishap, type OpenOptions, type TercetStream } from "tercet";
import { fixture, setting } from "../fixtures.js";
import { Link } from "../link.js";

const module = await WebAssembly.compile(readFileSync(join(setting("TERCET_WASM"), "decoder.wasm")));
const link = new Link();
const address = await link.listen();
const { bytes, digests } = fixture("scan");
link.files.set("/scan.tct", bytes);
after(() => link.close());
beforeEach(() => {
  link.weather.clear();
  link.sent.length = 0;
});

const mishaps: Mishap[] = [];
function open(options: OpenOptions = {}, path = "/scan.tct"): TercetStream {
  mishaps.length = 0;
  return openUrl(address + path, {
    module, pool: new WorkerPool(0), digest: true, onMishap: (mishap) => mishaps.push(mishap), ...options,
  });
}

test("a whole file is one request without a range", async () => {
  const stream = open();
  assert.equal((await stream.done).digest, digests.at(-1));
  assert.deepEqual(link.sent, [{ path: "/scan.tct", range: undefined, bytes: bytes.length }]);
  assert.equal(stream.received, bytes.length);
  assert.equal(stream.total, bytes.length);
});

test("iterating gives the levels in order", async () => {
  const found: number[] = [];
  for await (const { level } of open()) found.push(level);
  assert.deepEqual(found, digests.map((_, i) => i));
});

test("leaving the iteration ends the download", async () => {
  link.weather.set("/scan.tct", { rate: 30_000 });
  const stream = open();
  for await (const level of stream) if (level.level === 2) break;
  await assert.rejects(stream.done, { name: "AbortError" });
  assert.ok(link.bytesOf("/scan.tct") < bytes.length / 2);
});

test("a part of a file takes two requests, and no more bytes than its levels have", async () => {
  const stream = open({ until: { level: digests.length - 2 } });
  const level = await stream.done;
  assert.equal(level.level, digests.length - 2);
  const end = stream.info!.levels.at(-2)!.bytes;
  assert.deepEqual(link.sent.map(({ range }) => range), ["bytes=0-16383", `bytes=16384-${end - 1}`]);
  assert.equal(link.bytesOf("/scan.tct"), end);
});

test("a goal by error or by bytes is met, with no more than the first request beyond it", async () => {
  const near = open({ until: { maxError: 0.0005 } });
  const { level } = await near.done;
  const { levels } = near.info!;
  assert.ok(levels[level]!.error <= 0.0005);
  const first = levels.find(({ error }) => error <= 0.0005)!;
  assert.equal(near.received, Math.max(16_384, first.bytes));
  const cheap = open({ until: { bytes: 20_000 } });
  assert.ok(levels[(await cheap.done).level]!.bytes <= 20_000);
  assert.ok(cheap.received <= 20_000);
});

test("a broken connection is resumed where it broke", async () => {
  link.weather.set("/scan.tct", { cuts: [5_000, 12_000, 13_000], rate: 2e6 });
  assert.equal((await open().done).digest, digests.at(-1));
  assert.deepEqual(mishaps.map(({ kind }) => kind), ["connection", "connection", "connection"]);
  assert.equal(link.sent.length, 4);
  assert.ok(link.bytesOf("/scan.tct") <= bytes.length + 3 * (1 << 16));
  assert.ok(link.sent.slice(1).every(({ range }) => /^bytes=\d+-$/.test(range!)));
});

test("a server without ranges is resumed all the same", async () => {
  link.weather.set("/scan.tct", { cuts: [9_000], rate: 4e6, ignoresRanges: true });
  assert.equal((await open().done).digest, digests.at(-1));
});

test("a damaged section is reported and asked for again", async () => {
  const at = Math.floor(bytes.length / 2);
  link.weather.set("/scan.tct", { damage: { at, times: 2 } });
  assert.equal((await open().done).digest, digests.at(-1));
  assert.deepEqual(mishaps.map(({ kind }) => kind), ["damage", "damage"]);
  assert.ok(mishaps[0]!.at <= at);
  assert.equal(link.sent[1]!.range, `bytes=${mishaps[0]!.at}-`);
});

test("damage that stays is given up", async () => {
  link.weather.set("/scan.tct", { damage: { at: bytes.length - 9, times: 1e9 } });
  await assert.rejects(open({ attempts: 3 }).done, { name: "TercetError", kind: "checksum" });
  assert.equal(link.sent.length, 3);
});

test("a file that ends early is an error, not an endless loop", async () => {
  link.files.set("/short.tct", bytes.subarray(0, 10_000));
  await assert.rejects(open({}, "/short.tct").done, { kind: "truncated" });
  assert.equal(link.sent.length, 1);
});

test("what is no file of ours, and what is not there", async () => {
  link.files.set("/text.tct", Buffer.from("not a mesh"));
  await assert.rejects(open({}, "/text.tct").done, { kind: "format" });
  await assert.rejects(open({}, "/missing.tct").done, { kind: "status", message: /404 Not Found: there is no such file$/ });
});

test("a file that is replaced meanwhile is noticed", async () => {
  link.weather.set("/scan.tct", { cuts: [9_000], rate: 1e6 });
  const stream = open({ onMishap: () => link.files.set("/scan.tct", bytes.subarray(0, -1)) });
  await assert.rejects(stream.done, { kind: "changed" });
  link.files.set("/scan.tct", bytes);
});

test("a stalled connection is taken for broken", async () => {
  // A byte a second.
  link.weather.set("/scan.tct", { rate: 1 });
  const stream = open({ patience: 300, attempts: 2, onMishap: () => link.weather.delete("/scan.tct") });
  assert.equal((await stream.done).digest, digests.at(-1));
});

test("pausing takes nothing more, going on takes the rest", async () => {
  const wait = () => new Promise((resolve) => setTimeout(resolve, 150));
  const stream = open({ bytesPerSecond: 100_000, onLevel: ({ level }) => { if (level === 2) stream.pause(); } });
  while (!stream.pace.paused) await wait();
  await wait();
  const { received } = stream;
  await wait();
  assert.equal(stream.received, received);
  assert.ok(received < bytes.length);
  stream.pace.bytesPerSecond = undefined;
  stream.resume();
  assert.equal((await stream.done).digest, digests.at(-1));
});

test("a limited rate is kept", async () => {
  const start = performance.now();
  await open({ bytesPerSecond: bytes.length }).done;
  const seconds = (performance.now() - start) / 1000;
  assert.ok(seconds > 0.9 && seconds < 2, `${seconds}`);
});

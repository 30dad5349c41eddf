import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { Instance, TercetDecoder, TercetError, WorkerPool, type Level } from "tercet";
import { fixture, fixtures, large, setting } from "../fixtures.js";

const compiled = (name: string) => WebAssembly.compile(readFileSync(join(setting("TERCET_WASM"), name)));
const [module, full] = await Promise.all([compiled("decoder.wasm"), compiled("encoder.wasm")]);

/** FNV-1a as the native side computes it, without the module's help. */
function digest({ positions, indices }: Level): string {
  let hash = 0xcbf29ce484222325n;
  for (const bytes of [new Uint8Array(positions.buffer), new Uint8Array(indices.buffer)]) {
    for (const byte of bytes) hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
  }
  return hash.toString(16).padStart(16, "0");
}

function decoded(bytes: Uint8Array, portion = bytes.length, code = module): Level[] {
  const instance = new Instance(code, { digest: true });
  const levels: Level[] = [];
  for (let at = 0; at < bytes.length; at += portion) {
    instance.push(bytes.subarray(at, at + portion));
    for (let level; (level = instance.next()); ) levels.push(level);
  }
  instance.finish();
  return levels;
}

for (const { name, grouped, bytes, digests } of fixtures) {
  test(`${name}: every level has the native decoder's digest`, () => {
    const levels = decoded(bytes, bytes.length, grouped ? full : module);
    const short = bytes.length < 20_000;
    assert.equal(levels.length, digests.length);
    levels.forEach((level, i) => {
      if (short) assert.equal(digest(level), digests[i], `level ${level.level}`);
      assert.equal(level.restored, i === levels.length - 1);
    });
    assert.equal(levels.at(-1)?.digest, digests.at(-1));
  });
}

test("portions do not matter", () => {
  const { bytes, digests } = fixture("boundary");
  assert.deepEqual(decoded(bytes, 1).map(digest), digests);
});

test("the file says what it is before its first level", () => {
  const instance = new Instance(module);
  assert.equal(instance.info?.bytes, undefined);
  const { bytes, digests } = fixture("scan");
  instance.push(bytes.subarray(0, 2000));
  instance.next();
  const { info } = instance;
  assert.ok(info);
  assert.equal(info.bytes, bytes.length);
  assert.equal(info.levels.length, digests.length);
  assert.deepEqual([info.precision, info.bits, info.orderKept], ["lattice", 12, false]);
  assert.ok(info.levels.every(({ error }, i) => i === 0 || error <= info.levels[i - 1]!.error));
});

test("predictions and normals come where they are asked for", () => {
  const instance = new Instance(module, { predictions: true, normals: true });
  instance.push(fixture("scan").bytes);
  let below: Level | undefined;
  for (let level; (level = instance.next()); below = level) {
    assert.equal(level.predicted !== undefined, below !== undefined);
    assert.equal(level.kept, below ? below.positions.length / 3 : 0);
    assert.deepEqual(level.predicted?.subarray(0, 3 * level.kept), below?.positions);
    const { normals } = level;
    for (let v = 0; v < normals!.length; v += 3) {
      const length = Math.hypot(normals![v]!, normals![v + 1]!, normals![v + 2]!);
      assert.ok(Math.abs(length - 1) < 1e-5, `${length}`);
    }
  }
});

test("any bytes give levels or a typed error", () => {
  const { bytes } = fixture("components");
  let seed = 1;
  const random = (below: number) => (seed = (seed * 48271) % 2147483647) % below;
  for (let run = 0; run < 300; run++) {
    const spoilt = Uint8Array.from(bytes);
    for (let k = 0; k <= run % 4; k++) spoilt[random(run % 2 ? 80 : spoilt.length)]! ^= 1 << random(8);
    const length = run % 3 ? spoilt.length : random(spoilt.length);
    assert.throws(() => decoded(spoilt.subarray(0, length)), (error) => {
      assert.ok(error instanceof TercetError, String(error));
      return !["memory", "internal"].includes(error.kind);
    });
  }
});

for (const [name, times] of [["late", 2], ["late-exact", 3]] as const) {
  test(`${name}: positions that come late are estimated until they are there`, () => {
    const { bytes } = fixture(name);
    const levels = decoded(bytes);
    const instance = new Instance(module);
    instance.push(bytes);
    const kinds = instance.info!.levels.map(({ kind }) => kind);
    const last = kinds.length - 1;
    assert.equal(kinds[last], "late");
    const finest = levels.filter(({ level }) => level === last);
    assert.deepEqual(finest.map(({ restored }) => restored), [...Array(times - 1).fill(false), true]);
    const [estimated, settled] = finest;
    // The same faces; what was there before stays, all that was late moves.
    assert.deepEqual(settled!.indices, estimated!.indices);
    const early = 3 * instance.info!.levels.findLast(({ kind }) => kind !== "late")!.vertices;
    assert.deepEqual(settled!.positions.subarray(0, early), estimated!.positions.subarray(0, early));
    const moved = settled!.positions.filter((x, i) => x !== estimated!.positions[i]).length;
    assert.ok(moved > (settled!.positions.length - early) / 2, `${moved}`);
  });
}

test("what came before its turn is shown, and changes nothing", () => {
  const { bytes, digests, ends } = fixture("groups");
  const last = ends.length - 1;
  const [start, end] = [Math.floor((ends[last - 1]! + ends[last]!) / 2), ends[last]!];
  const late = Uint8Array.from(bytes.subarray(start, end));
  const forged = late.map((byte, i) => (i % 97 === 0 ? byte ^ 0x55 : byte));
  for (const seen of [late, forged]) {
    const instance = new Instance(full);
    const levels: Level[] = [];
    const push = (from: number, to: number) => {
      instance.push(bytes.subarray(from, to));
      for (let level; (level = instance.next()); ) levels.push(level);
    };
    assert.equal(instance.preview([{ place: start, bytes: late }]), undefined);
    push(0, start - 3000);
    const preview = instance.preview([{ place: start, bytes: seen }]);
    if (seen === late) {
      const { level, restored, kept, pending, positions } = preview!;
      assert.deepEqual([level, restored], [last, false]);
      assert.ok(pending > 0 && pending < positions.length / 3 - kept);
      assert.equal(instance.preview([{ place: 0, bytes: late }]), undefined, "those bytes lie elsewhere");
    }
    push(start - 3000, bytes.length);
    instance.finish();
    assert.deepEqual(levels.map(digest), digests);
    if (preview) assert.deepEqual(preview.indices, levels[last]!.indices);
  }
});

test("a module without groups shows nothing before its turn", () => {
  assert.equal(new Instance(module).preview([{ place: 0, bytes: new Uint8Array(9) }]), undefined);
});

test("a file cannot ask for more memory than it may", () => {
  const instance = new Instance(module, { maxMemory: 100_000 });
  instance.push(large.bytes);
  assert.throws(() => { while (instance.next()); }, { name: "TercetError", kind: "limit" });
});

test("a decoder hands out levels in order, and mends damage", async () => {
  const { bytes, digests } = fixture("components");
  const levels: Level[] = [];
  const decoder = new TercetDecoder({ module, pool: new WorkerPool(0), onLevel: (level) => levels.push(level) });
  const spoilt = Uint8Array.from(bytes);
  spoilt[spoilt.length - 1]! ^= 1;
  await assert.rejects(decoder.push(spoilt), { name: "TercetError", kind: "checksum" });
  const from = await decoder.discardDamaged();
  assert.ok(from! < bytes.length);
  await assert.rejects(decoder.finish(), { kind: "truncated" });
  await decoder.push(Uint8Array.from(bytes.subarray(from)));
  await decoder.finish();
  assert.deepEqual(levels.map(digest), digests);
  assert.ok(decoder.info && decoder.info.levels.length < digests.length, "sections restore the original");
  decoder.close();
  await assert.rejects(decoder.push(new Uint8Array(1)), { kind: "parameter" });
});

test("decoding keeps 0.4 of the native speed", (t) => {
  // This process's time, and of several runs the best, of more if that is not enough: the machine may be busy for
  // as long as eight take. The engine compiles well within two.
  const now = () => {
    const { user, system } = process.cpuUsage();
    return (user + system) / 1000;
  };
  let best = Infinity;
  for (let run = 0; run < 8 || (run < 64 && large.milliseconds < 0.4 * best); run++) {
    const start = now();
    const instance = new Instance(module);
    instance.push(large.bytes);
    while (instance.next());
    best = Math.min(best, now() - start);
  }
  const ratio = large.milliseconds / best;
  t.diagnostic(`${large.name}: ${best.toFixed(0)} ms, native ${large.milliseconds.toFixed(0)} ms: ${ratio.toFixed(2)} of its speed`);
  assert.ok(ratio >= 0.4, `${ratio}`);
});

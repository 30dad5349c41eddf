import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, beforeEach, test } from "node:test";
import { LoadingManager, type BufferGeometry } from "three";
import { TercetLoader } from "tercet/three";
import { fixture, setting } from "../fixtures.js";
import { Link } from "../link.js";

const link = new Link();
const address = await link.listen();
const { bytes, digests } = fixture("scan");
link.files.set("/scan.tct", bytes);
after(() => link.close());
beforeEach(() => link.weather.clear());

function loader(manager?: LoadingManager): TercetLoader {
  return new TercetLoader(manager)
    .setModule(readFileSync(join(setting("TERCET_WASM"), "decoder.wasm"))).setWorkerLimit(0).setPath(address);
}

function faces(geometry: BufferGeometry): number {
  return geometry.getIndex()!.count / 3;
}

test("each level is a geometry, the last one is returned", async () => {
  const loading = loader();
  const found: BufferGeometry[] = [];
  loading.onLevel = (geometry, { level }) => {
    assert.equal(geometry.userData["level"], level);
    found.push(geometry);
  };
  const geometry = await loading.loadAsync("/scan.tct");
  assert.equal(found.length, digests.length);
  assert.equal(found.at(-1), geometry);
  assert.ok(found.every((one, i) => i === 0 || faces(one) >= faces(found[i - 1]!)));
  assert.equal(geometry.getAttribute("position").count, geometry.getAttribute("normal").count);
  loading.dispose();
});

test("the manager hears of starts, ends and errors", async () => {
  const heard: string[] = [];
  const manager = new LoadingManager(() => heard.push("all"), undefined, () => heard.push("error"));
  manager.itemStart("another");
  await assert.rejects(loader(manager).loadAsync("/missing.tct"), { name: "TercetError", kind: "status" });
  await loader(manager).loadAsync("/scan.tct");
  manager.itemEnd("another");
  await new Promise((resolve) => setImmediate(resolve));
  assert.deepEqual(heard, ["error", "all"]);
});

test("bytes that are there already are parsed", async () => {
  const { buffer } = Uint8Array.from(bytes);
  const geometry = await new Promise<BufferGeometry>((resolve, reject) => loader().parse(buffer, resolve, reject));
  assert.equal(faces(geometry), faces(await loader().loadAsync("/scan.tct")));
  assert.equal(buffer.byteLength, bytes.length);
  await assert.rejects(new Promise((resolve, reject) => loader().parse(buffer.slice(0, 999), resolve, reject)), { kind: "truncated" });
});

test("an abort ends what is running", async () => {
  link.weather.set("/scan.tct", { rate: 20_000 });
  const loading = loader();
  loading.onLevel = () => loading.abort();
  await assert.rejects(loading.loadAsync("/scan.tct"), { name: "AbortError" });
});

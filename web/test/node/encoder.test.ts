import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { Instance } from "tercet";
import { encode } from "tercet/encoder";
import { setting } from "../fixtures.js";

const read = (name: string) => WebAssembly.compile(readFileSync(join(setting("TERCET_WASM"), name)));
const [decoder, encoder] = await Promise.all([read("decoder.wasm"), read("encoder.wasm")]);

test("a mesh file becomes a file that decodes to it", async () => {
  const text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const { bytes, notes } = await encode(new TextEncoder().encode(text), "obj", undefined, encoder);
  assert.match(notes.join(), /normals/);
  const instance = new Instance(decoder);
  instance.push(bytes);
  const level = instance.next();
  assert.ok(level?.restored);
  const corners = [0, 3, 6, 9].map((at) => [...level.positions.subarray(at, at + 3)].join());
  assert.deepEqual(corners.sort(), ["0,0,0", "0,0,1", "0,1,0", "1,0,0"]);
});

test("what cannot be encoded is refused", async () => {
  const file = new TextEncoder().encode("ply\nthis is none\n");
  await assert.rejects(encode(file, "ply", undefined, encoder), { name: "TercetError", kind: "syntax" });
  await assert.rejects(encode(file, "off", 99, encoder), { name: "TercetError" });
});

// Encodes a mesh with meshoptimizer's codecs, positions unrounded: node meshopt.mjs MESH.ply OUT

import { readFileSync, writeFileSync } from 'node:fs';
import { MeshoptEncoder } from 'meshoptimizer';
import { readPly } from './ply.mjs';

const [, , input, output] = process.argv;
await MeshoptEncoder.ready;

const { positions, indices } = readPly(readFileSync(input));
// Size matters here, not the order of drawing.
const [remap, used] = MeshoptEncoder.reorderMesh(indices, true, true);
const ordered = new Float32Array(used * 3);
remap.forEach((to, from) => {
    // Vertices that no face uses have no place.
    if (to !== 0xffffffff) ordered.set(positions.subarray(3 * from, 3 * from + 3), 3 * to);
});
writeFileSync(output, Buffer.concat([
    MeshoptEncoder.encodeVertexBuffer(new Uint8Array(ordered.buffer), used, 12),
    MeshoptEncoder.encodeIndexBuffer(new Uint8Array(indices.buffer), indices.length, 4),
]));

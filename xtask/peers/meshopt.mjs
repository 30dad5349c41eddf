// Encodes a mesh with meshoptimizer's codecs, positions unrounded: node meshopt.mjs MESH.ply OUT
//
// The PLY file is the bench's own: binary little endian, float x y z, faces as list uchar int.

import { readFileSync, writeFileSync } from 'node:fs';
import { MeshoptEncoder } from 'meshoptimizer';

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

function readPly(bytes) {
    const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
    const header = bytes.toString('latin1', 0, end);
    const layout = /binary_little_endian[^]*element vertex (\d+)\nproperty float x\nproperty float y\nproperty float z\nelement face (\d+)\nproperty list uchar u?int/;
    const [, vertices, faces] = header.match(layout) ?? fail(`${input}: not the expected PLY header`);
    const positions = new Float32Array(3 * vertices);
    const indices = new Uint32Array(3 * faces);
    for (let i = 0; i < positions.length; i++) positions[i] = bytes.readFloatLE(end + 4 * i);
    const start = end + 12 * vertices;
    for (let i = 0; i < indices.length; i++) {
        indices[i] = bytes.readUInt32LE(start + 13 * Math.floor(i / 3) + 1 + 4 * (i % 3));
    }
    return { positions, indices };
}

function fail(message) {
    throw new Error(message);
}

// Simplifies a mesh with meshoptimizer's quadric simplification: node simplify.mjs MESH.ply OUT FACES…
//
// Writes OUT-FACES-kept.ply, whose vertices are some of the mesh's, and OUT-FACES-moved.ply, whose vertices
// lie where their quadrics are least.

import { readFileSync, writeFileSync } from 'node:fs';
import { MeshoptSimplifier } from 'meshoptimizer';
import { readPly, writePly } from './ply.mjs';

const [, , input, output, ...sizes] = process.argv;
await MeshoptSimplifier.ready;
const { positions, indices } = readPly(readFileSync(input));
for (const faces of sizes) {
    const [kept] = MeshoptSimplifier.simplify(indices, positions, 3, 3 * faces, 1e9);
    write('kept', kept, positions);
    const moved = { indices: indices.slice(), positions: positions.slice() };
    const [count] = MeshoptSimplifier.simplifyWithUpdate(
        moved.indices, moved.positions, 3, new Float32Array(0), 0, [], null, 3 * faces, 1e9);
    write('moved', moved.indices.subarray(0, count), moved.positions);

    function write(kind, indices, positions) {
        const [remap, used] = MeshoptSimplifier.compactMesh(indices);
        const compact = new Float32Array(3 * used);
        remap.forEach((to, from) => {
            if (to !== 0xffffffff) compact.set(positions.subarray(3 * from, 3 * from + 3), 3 * to);
        });
        writeFileSync(`${output}-${faces}-${kind}.ply`, writePly(compact, indices));
    }
}

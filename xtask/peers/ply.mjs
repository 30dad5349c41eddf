// The bench's own PLY files: binary little endian, float x y z, faces as list uchar int.

export function readPly(bytes) {
    const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
    const header = bytes.toString('latin1', 0, end);
    const layout = /binary_little_endian[^]*element vertex (\d+)\nproperty float x\nproperty float y\nproperty float z\nelement face (\d+)\nproperty list uchar u?int/;
    const [, vertices, faces] = header.match(layout) ?? fail('not the expected PLY header');
    const positions = new Float32Array(3 * vertices);
    const indices = new Uint32Array(3 * faces);
    for (let i = 0; i < positions.length; i++) positions[i] = bytes.readFloatLE(end + 4 * i);
    const start = end + 12 * vertices;
    for (let i = 0; i < indices.length; i++) {
        indices[i] = bytes.readUInt32LE(start + 13 * Math.floor(i / 3) + 1 + 4 * (i % 3));
    }
    return { positions, indices };
}

export function writePly(positions, indices) {
    const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${positions.length / 3}\n`
        + 'property float x\nproperty float y\nproperty float z\n'
        + `element face ${indices.length / 3}\nproperty list uchar int vertex_indices\nend_header\n`;
    const faces = Buffer.alloc(13 * indices.length / 3);
    for (let i = 0; i < indices.length; i++) {
        const face = 13 * Math.floor(i / 3);
        faces[face] = 3;
        faces.writeUInt32LE(indices[i], face + 1 + 4 * (i % 3));
    }
    const vertices = Buffer.from(positions.buffer, positions.byteOffset, positions.byteLength);
    return Buffer.concat([Buffer.from(header), vertices, faces]);
}

function fail(message) {
    throw new Error(message);
}

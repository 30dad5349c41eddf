/** Normals that leave creases sharp: vertices on them are shown as several, one for each smooth side. */

/** Faces whose normals are nearer than 50° look like one smooth surface. */
const SMOOTH = Math.cos((50 * Math.PI) / 180);
/** If all faces are so near to their mean, no two of them are farther apart than that. */
const SURELY_SMOOTH = Math.cos((25 * Math.PI) / 180);
/** Around a vertex of more faces all are one surface: comparing each with each takes quadratic time. */
const MOST_FACES = 64;

/** A mesh as it is shown. */
export interface Creased {
  indices: Uint32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  /** The mesh's vertex behind each one that is shown; the first ones are all of the mesh's own. */
  source: Uint32Array<ArrayBuffer>;
}

/** Splits vertices on creases. `normals` are the means around each vertex. O(n). */
export function creased(positions: Float32Array, indices: Uint32Array, normals: Float32Array): Creased {
  const faces = faceNormals(positions, indices);
  const rough = roughVertices(faces, indices, normals);
  const shown = indices.slice();
  const means = normals.slice();
  const added: { source: number[]; normals: number[] } = { source: [], normals: [] };
  const vertices = positions.length / 3;
  for (const [vertex, corners] of rough) {
    const found = new Map<string, number>();
    for (const corner of corners) {
      const [key, mean] = sideOf(corner, corners, faces);
      let index = found.get(key);
      if (index === undefined) {
        index = found.size === 0 ? vertex : vertices + added.source.length;
        if (index === vertex) means.set(mean, 3 * vertex);
        else {
          added.source.push(vertex);
          added.normals.push(...mean);
        }
        found.set(key, index);
      }
      shown[corner] = index;
    }
  }
  const source = new Uint32Array(vertices + added.source.length);
  for (let v = 0; v < vertices; v++) source[v] = v;
  source.set(added.source, vertices);
  const all = new Float32Array(3 * source.length);
  all.set(means);
  all.set(added.normals, means.length);
  return { indices: shown, normals: all, source };
}

/** What belongs to the mesh's vertices, `size` numbers each, for the vertices that are shown. */
export function gathered(values: Float32Array<ArrayBuffer>, source: Uint32Array, size: number): Float32Array<ArrayBuffer> {
  if (source.length * size === values.length) return values;
  const all = new Float32Array(source.length * size);
  all.set(values);
  for (let v = values.length / size; v < source.length; v++) {
    const at = source[v]! * size;
    all.set(values.subarray(at, at + size), v * size);
  }
  return all;
}

/** Unit normals and areas: four numbers a face. */
function faceNormals(positions: Float32Array, indices: Uint32Array): Float32Array {
  const faces = new Float32Array((4 * indices.length) / 3);
  for (let i = 0, f = 0; i < indices.length; i += 3, f += 4) {
    const a = 3 * indices[i]!, b = 3 * indices[i + 1]!, c = 3 * indices[i + 2]!;
    const ax = positions[a]!, ay = positions[a + 1]!, az = positions[a + 2]!;
    const ux = positions[b]! - ax, uy = positions[b + 1]! - ay, uz = positions[b + 2]! - az;
    const vx = positions[c]! - ax, vy = positions[c + 1]! - ay, vz = positions[c + 2]! - az;
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const length = Math.hypot(x, y, z);
    if (length > 0) faces.set([x / length, y / length, z / length, length], f);
  }
  return faces;
}

/** The corners around each vertex that may lie on a crease. */
function roughVertices(faces: Float32Array, indices: Uint32Array, normals: Float32Array): Map<number, number[]> {
  const rough = new Map<number, number[]>();
  for (let i = 0; i < indices.length; i++) {
    const f = 4 * Math.floor(i / 3), n = 3 * indices[i]!;
    const cosine = faces[f]! * normals[n]! + faces[f + 1]! * normals[n + 1]! + faces[f + 2]! * normals[n + 2]!;
    if (cosine < SURELY_SMOOTH && faces[f + 3]! > 0) rough.set(indices[i]!, []);
  }
  if (rough.size > 0) indices.forEach((v, corner) => rough.get(v)?.push(corner));
  for (const [vertex, corners] of rough) if (corners.length > MOST_FACES) rough.delete(vertex);
  return rough;
}

/** Which of the corners around a vertex lie on the same side as one of them, as a key, and their normal. */
function sideOf(corner: number, corners: number[], faces: Float32Array): [string, [number, number, number]] {
  const own = 4 * Math.floor(corner / 3);
  const [nx, ny, nz] = [faces[own]!, faces[own + 1]!, faces[own + 2]!];
  let [x, y, z, key] = [0, 0, 0, ""];
  for (const other of corners) {
    const f = 4 * Math.floor(other / 3);
    const joined = other === corner || nx * faces[f]! + ny * faces[f + 1]! + nz * faces[f + 2]! > SMOOTH;
    key += joined ? "1" : "0";
    if (!joined) continue;
    const area = faces[f + 3]!;
    x += area * faces[f]!;
    y += area * faces[f + 1]!;
    z += area * faces[f + 2]!;
  }
  const length = Math.hypot(x, y, z) || 1;
  return [key, [x / length, y / length, z / length]];
}

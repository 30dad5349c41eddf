/** Where a mesh comes from: an address, or a file of the visitor's. */
import { MESH_FORMATS, type Encoded, type MeshFormat } from "tercet/encoder";
import type { Protocol } from "tercet";
import { revived, type PlainError } from "./plain";

/** A mesh that can be asked for any number of times. */
export interface Source {
  name: string;
  /** Where its `.tct` file is. */
  url: string;
  /** What is to be said of it. */
  notes: string[];
  protocol?: Protocol;
}

/** The file behind `?src=`, asked for by `&protocol=`, if that is there. */
export function fromAddress(address: string, protocol: string | null): Source {
  const url = new URL(address, location.href);
  if (!/^(https?|blob):$/.test(url.protocol)) throw new Error(`not an address of a file: ${address}`);
  return { name: nameOf(url), url: url.href, notes: [], protocol: protocol === "wt" || protocol === "ws" ? protocol : "http" };
}

/** The file's name; of a mesh that its server encodes, the mesh's own. */
function nameOf(url: URL): string {
  const last = url.pathname.split("/").at(-1) ?? "";
  let name = last;
  try {
    name = decodeURIComponent(last);
  } catch {
    // A percent sign that stands for itself.
  }
  const mesh = name.replace(/\.tct$/, "");
  return (MESH_FORMATS.some((format) => mesh.toLowerCase().endsWith(`.${format}`)) ? mesh : name) || url.host;
}

/** Whether the file is a mesh that has to be encoded first. */
export function meshFormat(file: File): MeshFormat | undefined {
  const suffix = file.name.split(".").at(-1)?.toLowerCase();
  return MESH_FORMATS.find((format) => format === suffix);
}

/** A file of the visitor's; a mesh file is encoded, in another thread. */
export async function fromFile(file: File): Promise<Source> {
  const format = meshFormat(file);
  if (!format) return { name: file.name, url: URL.createObjectURL(file), notes: [] };
  const bytes = new Uint8Array(await file.arrayBuffer());
  const encoded = await encodeElsewhere(bytes, format);
  const blob = new Blob([encoded.bytes]);
  const seconds = (encoded.milliseconds / 1000).toFixed(1);
  const percent = ((100 * blob.size) / file.size).toPrecision(3);
  const told = `Encoded here in ${seconds} s, every bit kept: ${percent} % of the ${format.toUpperCase()} file.`;
  return { name: file.name, url: URL.createObjectURL(blob), notes: [told, ...encoded.notes] };
}

function encodeElsewhere(bytes: Uint8Array, format: MeshFormat): Promise<Encoded> {
  const worker = new Worker(new URL("./encode.worker.ts", import.meta.url), { type: "module" });
  return new Promise<Encoded>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<{ encoded: Encoded } | { error: PlainError }>) =>
      "encoded" in data ? resolve(data.encoded) : reject(revived(data.error));
    worker.onerror = (event) => reject(new Error(event.message || "the encoder cannot be loaded"));
    worker.postMessage({ bytes, format }, [bytes.buffer]);
  }).finally(() => worker.terminate());
}

/** A thread that encodes one mesh file. */
import { encode, type MeshFormat } from "tercet/encoder";
import { plain } from "./plain";

interface Scope {
  postMessage(message: unknown, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<{ bytes: Uint8Array; format: MeshFormat }>) => void) | null;
}

const scope = globalThis as unknown as Scope;
scope.onmessage = async ({ data: { bytes, format } }) => {
  try {
    const encoded = await encode(bytes, format);
    scope.postMessage({ encoded }, [encoded.bytes.buffer]);
  } catch (error) {
    scope.postMessage({ error: plain(error) }, []);
  }
};

/** A thread that decodes: {@link Sessions} behind messages. */
import { Sessions, type Request } from "./sessions.js";

interface Scope {
  postMessage(message: unknown, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<Request>) => void) | null;
}

const scope = globalThis as unknown as Scope;
const sessions = new Sessions((answer, transfer) => scope.postMessage(answer, transfer));
scope.onmessage = (event) => sessions.handle(event.data);

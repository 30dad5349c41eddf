import { plain, TercetError } from "./errors.js";
import { Sessions, type Answer, type Request } from "./sessions.js";

type Listener = (answer: Answer) => void;

/** A thread, or this one in its stead. */
interface Thread {
  /** How many files it decodes. */
  sessions: number;
  send(request: Request): void;
  end(): void;
}

/** Threads shared by any number of files, started when they are needed. */
export class WorkerPool {
  private readonly threads: Thread[] = [];
  private readonly listeners = new Map<number, { thread: Thread; listen: Listener }>();
  private lastSession = 0;

  /** @param limit Most threads to run; 0 decodes in the calling thread. */
  constructor(public limit = defaultLimit()) {}

  /** Starts a session: `listen` hears its answers. Returns its number. */
  open(listen: Listener): number {
    const session = ++this.lastSession;
    const thread = this.leastBusy();
    thread.sessions += 1;
    this.listeners.set(session, { thread, listen });
    return session;
  }

  /** Sends a request to its session's thread. Its bytes are copied, unless they may be `taken`. */
  send(request: Request): void {
    this.listeners.get(request.session)?.thread.send(request);
  }

  /** Ends a session; nothing is heard of it any more. */
  close(session: number): void {
    const found = this.listeners.get(session);
    if (!found) return;
    found.thread.send({ session, call: 0, do: "close" });
    found.thread.sessions -= 1;
    this.listeners.delete(session);
  }

  /** Starts a thread ahead of the first file. */
  preload(): void {
    if (this.threads.length === 0) this.leastBusy();
  }

  /** Ends all threads and with them every session. */
  dispose(): void {
    for (const thread of this.threads.splice(0)) thread.end();
    this.listeners.clear();
  }

  private leastBusy(): Thread {
    const idlest = this.threads.reduce<Thread | undefined>(
      (best, thread) => (best && best.sessions <= thread.sessions ? best : thread), undefined);
    if (idlest && (idlest.sessions === 0 || this.threads.length >= Math.max(1, this.limit))) return idlest;
    const thread = this.limit > 0 ? this.worker() : this.inline();
    this.threads.push(thread);
    return thread;
  }

  private hear(answer: Answer): void {
    this.listeners.get(answer.session)?.listen(answer);
  }

  private worker(): Thread {
    const worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module", name: "tercet" });
    const thread: Thread = {
      sessions: 0,
      send: (request) => worker.postMessage(request, transfers(request)),
      end: () => worker.terminate(),
    };
    worker.onmessage = (event: MessageEvent<Answer>) => this.hear(event.data);
    worker.onerror = (event) => this.lose(thread, new TercetError("internal", `the worker failed: ${event.message}`));
    return thread;
  }

  private inline(): Thread {
    const sessions = new Sessions((answer) => this.hear(answer));
    return { sessions: 0, send: (request) => queueMicrotask(() => sessions.handle(request)), end: () => {} };
  }

  /** A thread that cannot be started or has died takes its sessions with it. */
  private lose(thread: Thread, error: TercetError): void {
    this.threads.splice(this.threads.indexOf(thread), 1);
    thread.end();
    for (const [session, { thread: its, listen }] of this.listeners) {
      if (its === thread) listen({ session, is: "failed", call: 0, error: plain(error) });
    }
  }
}

/** Bytes that fill their buffer are handed over, others copied. */
function transfers(request: Request): Transferable[] {
  if (request.do === "preview") return request.ahead.flatMap(({ bytes }) => handedOver(bytes));
  return request.do === "push" ? handedOver(request.bytes) : [];
}

function handedOver({ buffer, byteLength }: Uint8Array): Transferable[] {
  return buffer instanceof ArrayBuffer && buffer.byteLength === byteLength ? [buffer] : [];
}

/** One thread fewer than there are processors: the page draws meanwhile. Node decodes in place. */
function defaultLimit(): number {
  if (typeof Worker === "undefined") return 0;
  return Math.max(1, Math.min(4, (navigator.hardwareConcurrency || 2) - 1));
}

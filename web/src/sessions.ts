import { plain, type PlainError } from "./errors.js";
import { Instance, type DecodeOptions } from "./instance.js";
import { buffers, type Level, type Preview, type TercetInfo } from "./level.js";
import type { Ahead } from "./previews.js";

/** What a decoder is asked to do. `session` names a file, `call` this request. */
export type Request = { session: number; call: number } & (
  | { do: "open"; module: WebAssembly.Module; options: DecodeOptions }
  | { do: "push"; bytes: Uint8Array }
  | { do: "preview"; ahead: Ahead[] }
  | { do: "discard" }
  | { do: "finish" }
  | { do: "close" }
);

/** What it answers: infos, levels and previews as they come, and one `done` or `failed` for each request. */
export type Answer = { session: number } & (
  | { is: "info"; info: TercetInfo }
  | { is: "level"; level: Level }
  | { is: "preview"; preview: Preview }
  | { is: "done"; call: number; value: number | undefined }
  | { is: "failed"; call: number; error: PlainError }
);

export type Post = (answer: Answer, transfer: Transferable[]) => void;

/** The files that one thread decodes; the same in a worker and without one. */
export class Sessions {
  private readonly open = new Map<number, Instance>();

  constructor(private readonly post: Post) {}

  /** Does what is asked; never throws. */
  handle(request: Request): void {
    const { session, call } = request;
    try {
      const value = this.act(request);
      this.post({ session, is: "done", call, value }, []);
    } catch (error) {
      this.post({ session, is: "failed", call, error: plain(error) }, []);
    }
  }

  private act(request: Request): number | undefined {
    const { session } = request;
    if (request.do === "open") {
      this.open.set(session, new Instance(request.module, request.options));
      return undefined;
    }
    const instance = this.open.get(session);
    if (!instance) return undefined;
    switch (request.do) {
      case "push":
        return this.push(session, instance, request.bytes);
      case "preview":
        return this.preview(session, instance, request.ahead);
      case "discard":
        return instance.discardDamaged();
      case "finish":
        return void instance.finish();
      case "close":
        return void this.open.delete(session);
    }
  }

  private preview(session: number, instance: Instance, ahead: Ahead[]): undefined {
    const preview = instance.preview(ahead);
    if (preview) this.post({ session, is: "preview", preview }, buffers(preview));
  }

  private push(session: number, instance: Instance, bytes: Uint8Array): undefined {
    let announced = instance.info !== undefined;
    instance.push(bytes);
    for (;;) {
      const level = instance.next();
      if (!announced && instance.info) {
        announced = true;
        this.post({ session, is: "info", info: instance.info }, []);
      }
      if (!level) return undefined;
      this.post({ session, is: "level", level }, buffers(level));
    }
  }
}

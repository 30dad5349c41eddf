/** Tercet for three.js. */
import { BufferAttribute, BufferGeometry, Loader, type LoadingManager } from "three";
import { TercetDecoder } from "./decoder.js";
import type { Level, Preview } from "./level.js";
import { decoderModule, type ModuleSource } from "./module.js";
import { WorkerPool } from "./pool.js";
import { openUrl, type OpenOptions } from "./stream.js";

/**
 * Loads `.tct` files as geometries, in the manner of three.js's own loaders.
 *
 * ```js
 * const loader = new TercetLoader();
 * loader.onLevel = (geometry) => { mesh.geometry.dispose(); mesh.geometry = geometry; };
 * await loader.loadAsync("horse.tct");
 * ```
 */
export class TercetLoader extends Loader<BufferGeometry> {
  /**
   * Hears each level as it is decoded, the last one too, before the geometry is returned. Geometries
   * are the listener's to dispose of.
   */
  onLevel: ((geometry: BufferGeometry, level: Level) => void) | undefined;
  /** Hears the next level while it arrives, as {@link OpenOptions.onPreview} says. Geometries are the listener's. */
  onPreview: ((geometry: BufferGeometry, preview: Preview) => void) | undefined;
  /** How to download: how far to go, how often to try, what to tell. */
  options: OpenOptions = {};
  private readonly pool = new WorkerPool();
  private module: ModuleSource | undefined;
  private running = new AbortController();

  constructor(manager?: LoadingManager) {
    super(manager);
  }

  /** Says where the decoder's code is, where it does not lie beside this module. */
  setModule(module: ModuleSource): this {
    this.module = module;
    return this;
  }

  /** Most threads that decode at a time; 0 decodes in this one. */
  setWorkerLimit(limit: number): this {
    this.pool.limit = limit;
    return this;
  }

  /** Fetches and compiles the decoder ahead of the first file. */
  preload(): this {
    this.pool.preload();
    decoderModule(this.module).catch(() => {}); // Told with the first file.
    return this;
  }

  override load(
    url: string,
    onLoad: (geometry: BufferGeometry) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const resolved = this.manager.resolveURL(this.path + url);
    this.manager.itemStart(resolved);
    this.download(resolved, onProgress)
      .then(onLoad)
      .catch((error: unknown) => {
        (onError ?? console.error)(error);
        this.manager.itemError(resolved);
      })
      .finally(() => this.manager.itemEnd(resolved));
  }

  /** Decodes a whole file that has arrived already. The bytes are copied. */
  parse(
    data: ArrayBuffer, onLoad: (geometry: BufferGeometry) => void, onError: (error: unknown) => void = console.error,
  ): void {
    this.decode(new Uint8Array(data).slice()).then(onLoad, onError);
  }

  /** Ends every download that is running. */
  override abort(): this {
    this.running.abort(new DOMException("the loader was aborted", "AbortError"));
    this.running = new AbortController();
    return this;
  }

  /** Ends downloads and threads. */
  dispose(): this {
    this.abort();
    this.pool.dispose();
    return this;
  }

  private async download(url: string, onProgress?: (event: ProgressEvent) => void): Promise<BufferGeometry> {
    const latest = this.latest();
    const stream = openUrl(url, {
      ...this.decoding(latest.hear),
      signal: this.options.signal ? AbortSignal.any([this.options.signal, this.running.signal]) : this.running.signal,
      request: {
        ...this.options.request,
        headers: { ...this.requestHeader, ...(this.options.request?.headers as Record<string, string> | undefined) },
        credentials: this.withCredentials ? "include" : "same-origin",
      },
      onProgress: (received, total) => {
        this.options.onProgress?.(received, total);
        if (!onProgress) return;
        const lengthComputable = total !== undefined;
        onProgress(new ProgressEvent("progress", { lengthComputable, loaded: received, total: total ?? 0 }));
      },
    });
    await stream.done;
    return latest.geometry();
  }

  private async decode(bytes: Uint8Array): Promise<BufferGeometry> {
    const latest = this.latest();
    const decoder = new TercetDecoder(this.decoding(latest.hear));
    try {
      await decoder.push(bytes);
      await decoder.finish();
    } finally {
      decoder.close();
    }
    return latest.geometry();
  }

  private decoding(onLevel: (level: Level) => void): OpenOptions {
    const { options, pool, module } = this;
    const onPreview = this.onPreview && ((preview: Preview) => {
      this.onPreview?.(geometryOf(preview), preview);
      options.onPreview?.(preview);
    });
    return {
      ...options, normals: true, pool, onLevel,
      ...(module === undefined ? {} : { module }),
      ...(onPreview ? { onPreview } : {}),
    };
  }

  /** Makes a geometry of each level if somebody listens, and of the last one anyhow. */
  private latest(): { hear: (level: Level) => void; geometry: () => BufferGeometry } {
    let level: Level | undefined;
    let made: BufferGeometry | undefined;
    const hear = (next: Level) => {
      level = next;
      made = this.onLevel && geometryOf(next);
      if (made) this.onLevel?.(made, next);
      this.options.onLevel?.(next);
    };
    return { hear, geometry: () => made ?? geometryOf(level!) };
  }
}

/** A geometry with the attributes `position`, `normal` if the level has normals, `predicted` if it has predictions. */
export function geometryOf(level: Level): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(level.positions, 3));
  if (level.normals) geometry.setAttribute("normal", new BufferAttribute(level.normals, 3));
  if (level.predicted) geometry.setAttribute("predicted", new BufferAttribute(level.predicted, 3));
  geometry.setIndex(new BufferAttribute(level.indices, 1));
  geometry.userData = { level: level.level, restored: level.restored, kept: level.kept };
  return geometry;
}

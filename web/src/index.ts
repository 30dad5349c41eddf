/** Progressive triangle meshes in a page: decoding, and downloads that sharpen as they arrive. */
export { TercetError, type ErrorKind } from "./errors.js";
export type { Level, LevelInfo, Preview, TercetInfo } from "./level.js";
export { vertexNormals } from "./level.js";
export { Instance, type DecodeOptions } from "./instance.js";
export { TercetDecoder, defaultPool, type DecoderOptions } from "./decoder.js";
export { TercetStream, openUrl, type Goal, type Mishap, type OpenOptions, type Protocol } from "./stream.js";
export { WorkerPool } from "./pool.js";
export type { Ahead } from "./previews.js";
export { compile, decoderModule, type ModuleSource } from "./module.js";

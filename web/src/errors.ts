/**
 * Who can act on a failure: the file's sender (`format`, `checksum`, `truncated`, `unsupported`), the
 * author of a mesh file (`syntax`, `mesh`), the caller (`limit`, `parameter`, `memory`), the network
 * (`network`, `status`, `changed`); `internal` is a fault of this library.
 */
export type ErrorKind =
  | "format" | "checksum" | "truncated" | "unsupported"
  | "syntax" | "mesh"
  | "limit" | "parameter" | "memory"
  | "network" | "status" | "changed"
  | "io" | "other" | "internal";

/** Any failure of this library, except an abort, which is the signal's own reason. */
export class TercetError extends Error {
  override readonly name = "TercetError";

  constructor(readonly kind: ErrorKind, message: string, options?: ErrorOptions) {
    super(message, options);
  }
}

/** An error as it travels between threads, where classes are lost. */
export interface PlainError {
  kind: ErrorKind;
  message: string;
}

/** The error without its class. */
export function plain(error: unknown): PlainError {
  if (error instanceof TercetError) return { kind: error.kind, message: error.message };
  return { kind: "internal", message: error instanceof Error ? error.message : String(error) };
}

/** The error with its class. */
export function revived(error: PlainError): TercetError {
  return new TercetError(error.kind, error.message);
}

/** Errors between threads. */
import { TercetError, type ErrorKind } from "tercet";

export interface PlainError {
  kind: ErrorKind;
  message: string;
}

export function plain(error: unknown): PlainError {
  const message = error instanceof Error ? error.message : String(error);
  return { kind: error instanceof TercetError ? error.kind : "internal", message };
}

export function revived({ kind, message }: PlainError): TercetError {
  return new TercetError(kind, message);
}

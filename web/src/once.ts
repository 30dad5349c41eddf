/**
 * A function that begins `work` when it is first called and gives its outcome to all callers; after a
 * failure the next caller begins it anew, who may have more luck.
 */
export function once<T>(work: () => Promise<T>): () => Promise<T> {
  let begun: Promise<T> | undefined;
  return () =>
    (begun ??= work().catch((error: unknown) => {
      begun = undefined;
      throw error;
    }));
}

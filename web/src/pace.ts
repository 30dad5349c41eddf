/** Portions handed on in a second where the rate is limited: often enough to look continuous. */
const PORTIONS_PER_SECOND = 25;

/** How fast bytes are let through. */
export class Pace {
  private due = 0;
  private resumed: Promise<void> | undefined;
  private wake: () => void = () => {};

  /** @param bytesPerSecond May be changed at any time; `undefined` is no limit. */
  constructor(public bytesPerSecond?: number) {}

  get paused(): boolean {
    return this.resumed !== undefined;
  }

  pause(): void {
    this.resumed ??= new Promise((resolve) => (this.wake = resolve));
  }

  resume(): void {
    this.resumed = undefined;
    this.wake();
  }

  /** Settled when bytes are let through. */
  async going(): Promise<void> {
    await this.resumed;
  }

  /** The bytes in portions, each when its time has come. */
  async *portions(bytes: Uint8Array): AsyncGenerator<Uint8Array> {
    let rest = bytes;
    while (rest.length > 0) {
      await this.resumed;
      const rate = this.bytesPerSecond;
      if (!rate) {
        yield rest;
        return;
      }
      const portion = rest.subarray(0, Math.max(1, Math.ceil(rate / PORTIONS_PER_SECOND)));
      rest = rest.subarray(portion.length);
      const now = performance.now();
      // What was not used in time is not saved up.
      this.due = Math.max(this.due, now) + (1000 * portion.length) / rate;
      await new Promise((resolve) => setTimeout(resolve, this.due - now));
      yield portion;
    }
  }
}

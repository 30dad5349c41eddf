/** Bytes of a file that have come before their turn. Nothing vouches for them: they are for looking only. */
export interface Ahead {
  /** Where in the file they begin. */
  place: number;
  bytes: Uint8Array<ArrayBuffer>;
}

/** Milliseconds between two previews, each of which takes time linear in its level. */
const BETWEEN = 100;
/** How many times as long as the last preview took the decoder is left alone after it. */
const REST = 3;

/** Has bytes looked at that came before their turn: not too often, and while there is nothing better to do. */
export class Previews {
  private waiting: Ahead[] = [];
  private timer: ReturnType<typeof setTimeout> | undefined;
  private looking = false;
  private ended = false;
  private due = 0;

  /**
   * @param look Shows what these bytes hold; settled when that is done.
   * @param idle Settled when all bytes that have had their turn are decoded.
   */
  constructor(
    private readonly look: (ahead: Ahead[]) => Promise<void>,
    private readonly idle: () => Promise<void>,
  ) {}

  offer(ahead: Ahead): void {
    if (this.ended) return;
    this.waiting.push(ahead);
    this.schedule();
  }

  /** Forgets what lies before this byte of the file, and has had its turn; all, where none is given. */
  forget(before = Infinity): void {
    this.waiting = this.waiting.filter(({ place, bytes }) => place + bytes.length > before);
  }

  /** Nothing is looked at any more. */
  end(): void {
    this.ended = true;
    this.forget();
    clearTimeout(this.timer);
  }

  private schedule(): void {
    if (this.timer !== undefined || this.looking || this.waiting.length === 0) return;
    this.timer = setTimeout(() => void this.next(), Math.max(0, this.due - performance.now()));
  }

  private async next(): Promise<void> {
    this.timer = undefined;
    this.looking = true;
    await this.idle();
    const start = performance.now();
    const ahead = this.waiting.splice(0);
    // What is wrong with a decoder is told to whoever gives it bytes for good.
    if (ahead.length > 0) await this.look(ahead).catch(() => {});
    const now = performance.now();
    this.due = now + Math.max(BETWEEN, REST * (now - start));
    this.looking = false;
    this.schedule();
  }
}

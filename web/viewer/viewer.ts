/** A file on its way to the screen, and what the visitor wants to see of it. */
import { openUrl, type Level, type Mishap, type Preview, type TercetStream } from "tercet";
import { Model, type Stage } from "./model";
import * as panel from "./panel";
import type { Picture } from "./panel";
import type { View } from "./scene";
import type { Source } from "./source";
import { azimuth, standsOnZ } from "./stance";

/** Milliseconds in which a level grows out of the one below. */
const GROWING = 450;
/** Milliseconds without a level after which the page says that it waits. */
const WAITING = 400;
/** How a mesh stands shows from about this many vertices on. */
const TELLING = 1000;

export class Viewer {
  /** How fast a connection to imitate, in bytes per second. */
  private rate: number | undefined;
  private grows = true;
  private picture: Picture = "surface";
  private source: Source | undefined;
  private model: Model | undefined;
  private stream: TercetStream | undefined;
  private shown: Stage | undefined;
  /** Whether each finer level is shown as it comes. */
  private follows = true;
  private growing = false;
  /** The level that is shown as far as it has come, if one is. */
  private previewed: number | undefined;
  private started = 0;
  /** Whether the visitor, or a level that tells, has said which way up the mesh stands. */
  private standing: "guessed" | "settled" = "guessed";
  private waiting: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly view: View) {
    panel.setPicture(this.picture);
    panel.setFigures(undefined, undefined);
  }

  /** Loads a mesh, in place of the one before. */
  open(source: Source): void {
    this.close();
    this.source = source;
    this.model = new Model();
    this.started = performance.now();
    panel.setName(source.name);
    panel.setNotes(source.notes);
    this.setState("loading");
    const model = this.model;
    this.waiting = setTimeout(() => panel.setBusy(`Waiting for ${source.name} …`), WAITING);
    const stream = openUrl(source.url, {
      protocol: source.protocol ?? "http",
      predictions: true,
      normals: true,
      digest: true,
      ...(this.rate === undefined ? {} : { bytesPerSecond: this.rate }),
      onInfo: (info) => {
        model.info = info;
        panel.setMarks(info);
      },
      onLevel: (level) => this.model === model && this.arrive(level),
      onPreview: (preview) => this.model === model && this.foresee(preview),
      onProgress: (received, total) => this.model === model && panel.setProgress(received, total),
      onMishap: (mishap) => this.model === model && this.tell(mishap),
    });
    this.stream = stream;
    stream.done.then(
      () => this.model === model && this.finish(),
      (error: unknown) => this.model === model && this.fail(error, source),
    );
  }

  /** Loads the same mesh once more. */
  replay(): void {
    if (this.source) this.open(this.source);
  }

  /** Says what went wrong; with a mesh, under its name rather than its address. */
  fail(error: unknown, of?: Partial<Source>): void {
    this.endWaiting();
    const message = error instanceof Error ? error.message : String(error);
    panel.say(of ? `${of.name}: ${message.replace(`${of.url}: `, "")}` : message, "failure");
    this.setState(this.shown ? "failed" : "empty");
  }

  togglePause(): void {
    if (document.body.dataset["state"] === "loading") {
      this.stream?.pause();
      this.setState("paused");
    } else if (document.body.dataset["state"] === "paused") {
      this.stream?.resume();
      this.setState("loading");
    }
  }

  setRate(bytesPerSecond: number | undefined): void {
    this.rate = bytesPerSecond;
    if (this.stream) this.stream.pace.bytesPerSecond = bytesPerSecond;
  }

  setPicture(picture: Picture): void {
    this.picture = picture;
    panel.setPicture(picture);
    if (this.shown) this.put(this.shown);
  }

  /** Which axis points up; from then on it is the visitor's choice. */
  setUp(zUp: boolean): void {
    this.standing = "settled";
    this.stand(zUp);
  }

  setGrowing(grows: boolean): void {
    this.grows = grows;
  }

  /** Shows a level, or the nearest that has arrived. */
  goTo(level: number): void {
    const { finest, arriving, stages } = this.model ?? {};
    if (!finest || !stages) return;
    // Whoever asks for the finest whole level while another one is arriving wants to see it whole.
    this.follows = level >= (arriving ?? finest).level;
    const stage = stages[Math.max(0, Math.min(level, finest.level))];
    if (stage && stage !== this.shown) this.change(stage);
    else if (this.shown && !this.growing) this.put(this.shown);
    else panel.setFigures(this.model, this.shown);
  }

  step(by: number): void {
    if (this.shown) this.goTo((this.previewed ?? this.shown.level) + by);
  }

  private close(): void {
    this.stream?.abort();
    this.model?.dispose();
    this.model = this.shown = this.previewed = undefined;
    this.follows = true;
    this.growing = false;
    this.standing = "guessed";
    panel.hush();
    this.endWaiting();
    panel.setMarks(undefined);
    panel.setProgress(0, undefined);
    panel.setFigures(undefined, undefined);
    panel.setLegend("surface");
    delete document.body.dataset["digest"];
    delete document.body.dataset["shown"];
    this.view.clear();
  }

  private arrive(level: Level): void {
    const model = this.model!;
    const wasEstimated = model.stages[level.level]?.estimated;
    const stage = model.take(level, performance.now() - this.started);
    this.endWaiting();
    this.settle(stage);
    // Whoever watches the page from outside hears of it too.
    const { restored, estimated, arrived } = stage;
    dispatchEvent(new CustomEvent("tercet-level", { detail: { level: stage.level, restored, estimated, arrived } }));
    if (this.shown === stage) {
      // The same level, completed: an animation puts it up when it ends.
      if (this.growing) return;
      if (wasEstimated && !estimated && !this.calm) this.grow(stage, "out", GROWING, () => this.put(stage));
      else this.put(stage);
    } else if (this.follows) {
      if (!this.growing) this.change(stage);
    } else {
      panel.setFigures(model, this.shown);
    }
  }

  /** Takes the next level as far as it has come. */
  private foresee(preview: Preview): void {
    const { level, counts: [vertices], pending } = this.model!.takePreview(preview);
    dispatchEvent(new CustomEvent("tercet-preview", { detail: { level, vertices, pending } }));
    if (!this.growing) this.showPreview();
  }

  /** Shows what has come of the next level in place of the one below, unless something else is to be seen. */
  private showPreview(): void {
    const { arriving, finest } = this.model ?? {};
    if (!arriving || !this.follows || this.shown !== finest || this.picture !== "surface") return;
    this.previewed = arriving.level;
    this.view.show({ geometry: arriving.geometry, coloured: false });
    panel.setPreview(this.model!, arriving);
  }

  /** Guesses how the mesh stands while levels are coarse; what turns later would only disturb. */
  private settle(stage: Stage): void {
    if (this.standing === "settled") return;
    if (stage.counts[0] >= TELLING || this.view.touched) this.standing = "settled";
    if (!this.view.touched) this.stand(standsOnZ(stage.triangles), stage);
  }

  private stand(zUp: boolean, stage = this.model?.finest): void {
    panel.element<HTMLInputElement>("up").checked = zUp;
    if (stage) this.view.stand(stage.triangles, zUp, azimuth(stage.triangles, zUp));
  }

  private endWaiting(): void {
    clearTimeout(this.waiting);
    panel.setBusy(undefined);
  }

  private finish(): void {
    if (this.model?.digest) document.body.dataset["digest"] = this.model.digest;
    if (this.stream) document.body.dataset["protocol"] = this.stream.protocol;
    this.setState("done");
  }

  private tell({ kind, at, message }: Mishap): void {
    const what = kind === "damage" ? "A damaged section is fetched again" : "The connection broke; going on";
    panel.say(`${what} at byte ${at} (${message})`);
    dispatchEvent(new CustomEvent("tercet-mishap", { detail: { kind, at } }));
  }

  /** Goes from the level that is shown to another, vertex by vertex if they are neighbours. */
  private change(stage: Stage): void {
    const before = this.shown;
    this.shown = stage;
    const { calm } = this;
    const done = () => {
      this.growing = false;
      const finest = this.model?.finest;
      // Levels that came meanwhile.
      if (this.follows && finest && finest !== this.shown) this.change(this.model!.stages[this.shown!.level + 1] ?? finest);
      else if (this.shown) this.put(this.shown);
    };
    panel.setFigures(this.model, stage);
    // Where levels come faster than they grow, the picture must not lag behind.
    const behind = this.follows ? (this.model?.finest?.level ?? stage.level) - stage.level : 0;
    const milliseconds = GROWING / (1 + 2 * behind);
    const grown = this.previewed === stage.level;
    if (before && !calm && !grown && stage.level > before.level && stage.hasPrediction) {
      this.grow(stage, "out", milliseconds, done);
    } else if (before && !calm && stage.level === before.level - 1 && before.hasPrediction) {
      this.grow(before, "in", milliseconds, done);
    } else {
      this.growing = false;
      this.put(stage);
    }
  }

  /** Whether levels replace each other without a transition. */
  private get calm(): boolean {
    return !this.grows || this.picture === "predicted" || matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  private grow(stage: Stage, direction: "out" | "in", milliseconds: number, done: () => void): void {
    this.growing = true;
    this.view.grow(this.frame(stage, "division"), direction, milliseconds, done);
  }

  private put(stage: Stage): void {
    const still = this.picture === "predicted" && stage.hasPrediction;
    if (still) stage.preparePrediction();
    this.growing = false;
    this.view.show(this.frame(stage, this.picture === "surface" ? "mesh" : "division"), still ? 0 : 1);
    panel.setFigures(this.model, stage);
    document.body.dataset["shown"] = String(stage.level);
    this.previewed = undefined;
    this.showPreview();
  }

  private frame(stage: Stage, wanted: "mesh" | "division") {
    const coloured = this.picture === "division" || this.picture === "details";
    if (this.picture === "division") stage.colourDivision();
    const range = this.picture === "details" ? stage.colourDetails() : undefined;
    const diagonal = this.view.diagonal;
    panel.setLegend(this.picture, range && [range[0] / diagonal, range[1] / diagonal]);
    return { geometry: stage.geometry(wanted), coloured };
  }

  private setState(state: "empty" | "loading" | "paused" | "done" | "failed"): void {
    document.body.dataset["state"] = state;
    const pause = panel.element<HTMLButtonElement>("pause");
    pause.disabled = state !== "loading" && state !== "paused";
    pause.textContent = state === "paused" ? "Go on" : "Pause";
    panel.element<HTMLButtonElement>("replay").disabled = !this.source;
  }
}

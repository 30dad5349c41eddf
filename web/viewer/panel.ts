/** The figures and controls beside the mesh. */
import type { TercetInfo } from "tercet";
import { FRESH, KEPT, SCALE } from "./colours";
import * as format from "./format";
import type { Arriving, Model, Stage } from "./model";

export type Picture = "surface" | "division" | "details" | "predicted";
export const PICTURES: Picture[] = ["surface", "division", "details", "predicted"];

const CAPTIONS: Record<Picture, string> = {
  surface: "The mesh as this level has it.",
  division: "Vertices that the level below had, and those that this one adds.",
  details: "How far each vertex lies from where it was expected when it was new.",
  predicted: "Every new vertex where it is expected: this level if all its details were zero.",
};

const ESTIMATED = "Vertices of this level lie where they are estimated: their positions come after all levels.";

const ARRIVING = "vertices lie where they are expected: their details are still to come.";

/** The element of that id; a page without it is not this one. */
export function element<E extends HTMLElement = HTMLElement>(id: string): E {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found as E;
}

export function setName(name: string): void {
  element("name").textContent = name;
  element("name").title = name;
  document.title = name ? `${name} · Tercet` : "Tercet";
}

/** How much has arrived, with a mark where each level ends. */
export function setProgress(received: number, total: number | undefined): void {
  const part = total ? received / total : 0;
  element("received").textContent = total
    ? `${format.bytes(received)} of ${format.bytes(total)}`
    : received > 0 ? format.bytes(received) : "–";
  const bar = element("progress");
  bar.setAttribute("aria-valuenow", String(Math.round(100 * part)));
  (bar.firstElementChild as HTMLElement).style.width = `${100 * part}%`;
}

export function setMarks(info: TercetInfo | undefined): void {
  const bar = element("progress");
  bar.querySelectorAll("b").forEach((mark) => mark.remove());
  for (const level of info?.levels.filter(({ bytes }) => bytes < info.bytes) ?? []) {
    const mark = document.createElement("b");
    mark.style.left = `${(100 * level.bytes) / info!.bytes}%`;
    bar.append(mark);
  }
}

/** The figures of the level that is shown. */
export function setFigures(model: Model | undefined, stage: Stage | undefined): void {
  const level = stage && model?.info?.levels[stage.level];
  const slider = element<HTMLInputElement>("level");
  const last = (model?.info?.levels.length ?? 1) - 1;
  slider.max = String(last);
  slider.value = String(stage?.level ?? 0);
  slider.disabled = !stage || last === 0;
  element<HTMLButtonElement>("coarser").disabled = !stage || stage.level === 0;
  element<HTMLButtonElement>("finer").disabled = !stage || (stage === model?.finest && !model.arriving);
  const figures: Record<string, string> = { vertices: "–", faces: "–", bytes: "–", percent: "–", error: "–", time: "–" };
  const text = element("level-text");
  if (stage && level && model?.info) {
    // The finest level is complete with the file's last byte.
    const bytes = stage.restored ? model.info.bytes : level.bytes;
    const [vertices, faces] = stage.counts;
    slider.setAttribute("aria-valuetext", `${stage.level} of ${last}, ${vertices} vertices`);
    const remark = stage.level === 0 ? ", the base" : stage.estimated ? ", estimated" : "";
    text.innerHTML = `${stage.level} <small>of ${last}${remark}</small>`;
    text.title = stage.estimated ? ESTIMATED : "";
    Object.assign(figures, {
      vertices: format.count(vertices),
      faces: format.count(faces),
      bytes: format.bytes(bytes),
      percent: format.percent(bytes / model.info.bytes),
      error: errorOf(model.info, stage),
      time: format.duration(stage.arrived),
    });
    element("time").title = `decoded in ${stage.decoding.toFixed(1)} ms`;
  } else {
    text.textContent = "–";
  }
  for (const [id, value] of Object.entries(figures)) element(id).textContent = value;
}

/** The figures of a level that is shown as far as it has come. */
export function setPreview(model: Model, { level, counts: [vertices, faces], pending, fresh }: Arriving): void {
  const last = (model.info?.levels.length ?? 1) - 1;
  const part = format.percent(fresh > 0 ? 1 - pending / fresh : 1);
  const slider = element<HTMLInputElement>("level");
  slider.value = String(level);
  slider.setAttribute("aria-valuetext", `${level} of ${last}, ${part} has arrived`);
  element<HTMLButtonElement>("coarser").disabled = false;
  element<HTMLButtonElement>("finer").disabled = true;
  const text = element("level-text");
  text.innerHTML = `${level} <small>of ${last}, ${part} here</small>`;
  text.title = `${format.count(pending)} of ${format.count(vertices)} ${ARRIVING}`;
  const figures = { vertices: format.count(vertices), faces: format.count(faces), bytes: "–", percent: "–", error: "–", time: "–" };
  for (const [id, value] of Object.entries(figures)) element(id).textContent = value;
}

/** The error of what is shown: the index has that of late levels as they are estimated. */
function errorOf({ bits, levels }: TercetInfo, { level, restored }: Stage): string {
  if (restored && bits === 0) return "none";
  const { kind, error } = levels[level]!;
  // Half the diagonal of a cell of the lattice, whose longest side is at most the mesh's diagonal.
  const rounding = Math.sqrt(3) / 2 / (2 ** bits - 1);
  return restored && kind === "late" ? `≤ ${format.percent(Math.min(rounding, error))}` : format.percent(error);
}

export function setPicture(picture: Picture): void {
  for (const button of element("picture").querySelectorAll("button")) {
    const chosen = button.dataset["value"] === picture;
    button.setAttribute("aria-checked", String(chosen));
    button.tabIndex = chosen ? 0 : -1;
  }
  element("caption").textContent = CAPTIONS[picture];
}

/** What the colours mean; `range` as a part of the diagonal. */
export function setLegend(picture: Picture, range?: [number, number]): void {
  const legend = element("legend");
  legend.hidden = picture !== "division" && !range;
  if (picture === "division") {
    legend.innerHTML = `<span class="dot" style="background:${KEPT}"></span>even, kept<span class="dot" style="background:${FRESH}"></span>odd, new`;
  } else if (range) {
    const [low, high] = range.map(format.percent);
    legend.innerHTML = `<div class="scale" style="background:linear-gradient(90deg,${SCALE.join()})"></div>
      <div class="ends"><span>${low}</span><span>of the diagonal</span><span>${high}</span></div>`;
  }
}

export function setNotes(notes: string[]): void {
  const section = element("notes");
  section.hidden = notes.length === 0;
  section.replaceChildren(...notes.map((note) => {
    const line = document.createElement("p");
    line.textContent = note;
    return line;
  }));
}

export function setBusy(text: string | undefined): void {
  element("busy").hidden = text === undefined;
  element("busy").querySelector("p")!.textContent = text ?? "";
}

let vanishing: ReturnType<typeof setTimeout> | undefined;

/** Says something in passing; a failure stays until the next word. */
export function say(text: string, kind: "passing" | "failure" = "passing"): void {
  const toast = element("toast");
  clearTimeout(vanishing);
  toast.hidden = false;
  toast.textContent = text;
  toast.classList.toggle("failure", kind === "failure");
  if (kind === "passing") vanishing = setTimeout(hush, 3500);
}

export function hush(): void {
  element("toast").hidden = true;
}

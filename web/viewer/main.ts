/** The page: what its controls, its keys and files dropped on it do. */
import { decoderModule, defaultPool } from "tercet";
import { element, PICTURES, say, setBusy, type Picture } from "./panel";
import { View } from "./scene";
import { fromAddress, fromFile, meshFormat } from "./source";
import { Viewer } from "./viewer";

const view = new View(element<HTMLCanvasElement>("canvas"));
const viewer = new Viewer(view);
const rate = element<HTMLSelectElement>("rate");

async function openFile(file: File): Promise<void> {
  if (meshFormat(file)) setBusy(`Encoding ${file.name} …`);
  try {
    viewer.open(await fromFile(file));
  } catch (error) {
    viewer.fail(error, file);
  }
}

function setTheme(dark: boolean): void {
  document.documentElement.dataset["theme"] = dark ? "dark" : "light";
  view.dark = dark;
}

function toggle(id: string): void {
  const box = element<HTMLInputElement>(id);
  box.checked = !box.checked;
  box.dispatchEvent(new Event("change"));
}

function chooseFile(): void {
  element<HTMLInputElement>("file").click();
}

function nextRate(): void {
  rate.selectedIndex = (rate.selectedIndex + 1) % rate.options.length;
  rate.dispatchEvent(new Event("change"));
  say(`Link: ${rate.selectedOptions[0]!.text}`);
}

const isDark = () => document.documentElement.dataset["theme"] === "dark";
const showKeys = () => element<HTMLDialogElement>("keys").showModal();
const click = (id: string, act: () => void) => element(id).addEventListener("click", act);
const change = <E extends HTMLElement>(id: string, act: (control: E) => void) =>
  element(id).addEventListener("change", () => act(element<E>(id)));

click("choose", chooseFile);
click("open", chooseFile);
click("help", showKeys);
click("theme", () => setTheme(!isDark()));
click("coarser", () => viewer.step(-1));
click("finer", () => viewer.step(1));
click("pause", () => viewer.togglePause());
click("replay", () => viewer.replay());
click("reset", () => view.reset());
element("level").addEventListener("input", () => viewer.goTo(Number(element<HTMLInputElement>("level").value)));
change<HTMLSelectElement>("rate", ({ value }) => viewer.setRate(value ? Number(value) : undefined));
change<HTMLInputElement>("flat", ({ checked }) => (view.flat = checked));
change<HTMLInputElement>("wireframe", ({ checked }) => (view.wireframe = checked));
change<HTMLInputElement>("up", ({ checked }) => viewer.setUp(checked));
change<HTMLInputElement>("grow", ({ checked }) => viewer.setGrowing(checked));
change<HTMLInputElement>("file", (input) => {
  const file = input.files?.[0];
  input.value = "";
  if (file) void openFile(file);
});
for (const button of element("picture").querySelectorAll("button")) {
  button.addEventListener("click", () => viewer.setPicture(button.dataset["value"] as Picture));
}

const TURN = Math.PI / 18;
const KEYS: Record<string, () => void> = {
  ArrowLeft: () => viewer.step(-1),
  ArrowRight: () => viewer.step(1),
  PageUp: () => viewer.goTo(Infinity),
  PageDown: () => viewer.goTo(0),
  Home: () => view.reset(),
  "+": () => view.approach(1.2),
  "=": () => view.approach(1.2),
  "-": () => view.approach(1 / 1.2),
  "?": showKeys,
  " ": () => viewer.togglePause(),
  w: () => toggle("wireframe"),
  f: () => toggle("flat"),
  g: () => toggle("grow"),
  u: () => toggle("up"),
  r: () => viewer.replay(),
  l: nextRate,
  o: chooseFile,
  t: () => setTheme(!isDark()),
};
PICTURES.forEach((picture, i) => (KEYS[String(i + 1)] = () => viewer.setPicture(picture)));
const TURNS: Record<string, () => void> = {
  ArrowLeft: () => view.turn(-TURN, 0),
  ArrowRight: () => view.turn(TURN, 0),
  ArrowUp: () => view.turn(0, TURN),
  ArrowDown: () => view.turn(0, -TURN),
};

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || element<HTMLDialogElement>("keys").open) return;
  const target = event.target as HTMLElement;
  // A control that has the focus keeps the keys that it understands.
  const own = target.matches("select") || (target.matches("button, input[type=checkbox]") && event.key === " ");
  if (own && (event.key.length === 1 || event.key.startsWith("Arrow"))) return;
  const act = event.shiftKey && TURNS[event.key] ? TURNS[event.key] : KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!act) return;
  event.preventDefault();
  act();
});

addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", (event) => {
  // Leaving an element for its child is not leaving the page.
  if (event.relatedTarget === null) document.body.classList.remove("dropping");
});
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  const file = event.dataTransfer?.files[0];
  if (file) void openFile(file);
});

const scheme = matchMedia("(prefers-color-scheme: dark)");
scheme.addEventListener("change", () => setTheme(scheme.matches));
setTheme(scheme.matches);

// Before the first file is asked for: its bytes shall find the decoder waiting.
decoderModule().catch((error: unknown) => viewer.fail(error));
defaultPool().preload();

const parameters = new URLSearchParams(location.search);
const address = parameters.get("src");
if (address) {
  try {
    viewer.open(fromAddress(address, parameters.get("protocol")));
  } catch (error) {
    viewer.fail(error);
  }
}

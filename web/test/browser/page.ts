/** The viewer in Chromium, as its visitors have it. */
import { join } from "node:path";
import { chromium, type Browser, type BrowserContextOptions, type Page } from "playwright-core";
import { setting } from "../fixtures.js";

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: setting("TERCET_CHROMIUM").includes("/") ? setting("TERCET_CHROMIUM") : `/usr/bin/${setting("TERCET_CHROMIUM")}`,
    args: [
      "--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic",
      "--no-first-run", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    ],
  });
}

/** What the page told of its levels and mishaps, each with the milliseconds since it was opened. */
export interface Told {
  levels: { level: number; restored: boolean; estimated: boolean; arrived: number; painted: number }[];
  previews: { level: number; vertices: number; pending: number }[];
  mishaps: { kind: string; at: number }[];
}

/** A page that counts what it is told and refuses to leave this machine. */
export async function visit(browser: Browser, url: string, options: BrowserContextOptions = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 760 }, ...options });
  const page = await context.newPage();
  const foreign: string[] = [];
  const errors: string[] = [];
  page.on("request", (request) => {
    const { protocol, hostname } = new URL(request.url());
    if (protocol.startsWith("http") && hostname !== "127.0.0.1") foreign.push(request.url());
  });
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  await page.addInitScript(() => {
    const told: Told = { levels: [], previews: [], mishaps: [] };
    Object.assign(globalThis, { told });
    addEventListener("tercet-level", (event) => {
      const seen = { ...(event as CustomEvent<Told["levels"][0]>).detail, painted: Infinity };
      told.levels.push(seen);
      // The frame after the one in which it is drawn.
      requestAnimationFrame(() => requestAnimationFrame(() => (seen.painted = performance.now())));
    });
    addEventListener("tercet-preview", (event) => told.previews.push((event as CustomEvent<Told["previews"][0]>).detail));
    addEventListener("tercet-mishap", (event) => told.mishaps.push((event as CustomEvent<Told["mishaps"][0]>).detail));
  });
  await page.goto(url);
  return { page, foreign, errors, close: () => context.close() };
}

export function told(page: Page): Promise<Told> {
  return page.evaluate(() => (globalThis as unknown as { told: Told }).told);
}

/** Waits until the page is in a state. */
export async function reach(page: Page, state: string, timeout = 60_000): Promise<void> {
  await page.waitForFunction((state) => document.body.dataset["state"] === state, state, { timeout });
}

/** Waits until a level is shown, its vertices in their places. */
export async function shows(page: Page, level: number): Promise<void> {
  await page.waitForFunction((level) => document.body.dataset["shown"] === level, String(level), { timeout: 60_000 });
}

/** Keeps a picture of the page, for people. */
export async function keep(page: Page, name: string): Promise<void> {
  await page.screenshot({ path: join(setting("TERCET_SCREENSHOTS"), `${name}.png`) });
}

/** The canvas as pixels: red, green and blue from 0 to 255 at parts of its width and height. */
export async function sample(page: Page, points: [number, number][]): Promise<[number, number, number][]> {
  const picture = (await page.locator("#stage").screenshot()).toString("base64");
  return page.evaluate(async ([picture, points]) => {
    const bytes = Uint8Array.from(atob(picture), (character) => character.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d")!;
    context.drawImage(bitmap, 0, 0);
    return points.map(([x, y]) => {
      const [r, g, b] = context.getImageData(Math.floor(x * bitmap.width), Math.floor(y * bitmap.height), 1, 1).data;
      return [r!, g!, b!] as [number, number, number];
    });
  }, [picture, points] as const);
}

/** How many of a grid of pixels satisfy a test, as a part. */
export async function share(page: Page, test: (pixel: [number, number, number]) => boolean): Promise<number> {
  const grid: [number, number][] = [];
  for (let x = 0.02; x < 1; x += 0.02) for (let y = 0.02; y < 1; y += 0.02) grid.push([x, y]);
  const pixels = await sample(page, grid);
  return pixels.filter(test).length / pixels.length;
}

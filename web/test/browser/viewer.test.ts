import assert from "node:assert/strict";
import { after, before, beforeEach, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { fixture, large, setting, type Fixture } from "../fixtures.js";
import { Link } from "../link.js";
import { keep, launch, reach, sample, share, shows, told, visit, type Told } from "./page.js";

const link = new Link(setting("TERCET_VIEWER"));
const address = await link.listen();
const small = fixture("scan");
/** The finest level. */
const last = ({ ends }: Fixture) => ends.length - 1;
/** The numbers of the levels as they come: the finest once more for each time that it is completed. */
const numbers = (file: Fixture) => file.digests.map((_, i) => Math.min(i, last(file)));
let browser: Browser;

before(async () => {
  browser = await launch();
  link.files.set("/small.tct", small.bytes);
  link.files.set("/large.tct", large.bytes);
  link.files.set("/soup.tct", fixture("soup").bytes);
});
after(async () => {
  await browser.close();
  await link.close();
});
beforeEach(() => {
  link.weather.clear();
  link.sent.length = 0;
});

const view = (file: string) => `${address}/view/?src=${encodeURIComponent(file)}`;
/** What the mesh's plain colour, lit from any side, has and the ground around it has not. */
const bright = ([r, g, b]: [number, number, number], [x, y, z]: [number, number, number]) =>
  Math.abs(r - x) + Math.abs(g - y) + Math.abs(b - z) > 24;

/** Loads the page with a mesh, and makes it forget what it was told. */
async function ready(file: string) {
  const visitor = await visit(browser, view(file));
  await reach(visitor.page, "done");
  await shows(visitor.page, last(large));
  await visitor.page.evaluate(() => { (globalThis as unknown as { told: Told }).told.levels.length = 0; });
  link.sent.length = 0;
  return visitor;
}

test("on a slow link the base is on the screen before 5 % of the bytes are sent, and levels come in order", async (t) => {
  const { page, foreign, errors, close } = await ready("/large.tct");
  const weather = { rate: 2_000, roundTrip: 100 };
  link.weather.set("/large.tct", weather);
  await page.click("#replay");
  await page.waitForFunction(() => (globalThis as unknown as { told: Told }).told.levels[0]?.painted! < Infinity);
  const sent = link.bytesOf("/large.tct") / large.bytes.length;
  t.diagnostic(`base on the screen after ${(100 * sent).toFixed(2)} % of the bytes`);
  assert.ok(sent < 0.05, `${sent}`);
  // The mesh covers the middle of the stage; the corners are ground.
  const [middle, corner] = await sample(page, [[0.5, 0.5], [0.02, 0.02]]);
  assert.ok(bright(middle!, corner!), `${middle} on ${corner}`);
  await keep(page, "base");
  weather.rate = 1e6;
  await reach(page, "done");
  await shows(page, last(large));
  const { levels } = await told(page);
  assert.deepEqual(levels.map(({ level }) => level), numbers(large));
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), large.digests.at(-1));
  await keep(page, "desktop-light");
  assert.deepEqual([foreign, errors], [[], []]);
  await close();
});

test("a first picture within 0.4 s on 1 Mbit/s and 100 ms, and all bytes within 1.05 of a plain download", async (t) => {
  // The page is there already: what counts begins with the connection for the mesh.
  const { page, close } = await ready("/large.tct");
  link.weather.set("/large.tct", { rate: 125_000, roundTrip: 100 });
  let [first, arrived, whole, plain] = [Infinity, Infinity, Infinity, Infinity];
  for (let run = 0; run < 4; run++) {
    link.forget();
    plain = Math.min(plain, await page.evaluate(async () => {
      const start = performance.now();
      await (await fetch("/large.tct")).arrayBuffer();
      return performance.now() - start;
    }));
    link.forget();
    await page.evaluate(() => {
      (globalThis as unknown as { told: Told }).told.levels.length = 0;
      performance.clearResourceTimings();
    });
    await page.click("#replay");
    await reach(page, "done");
    await shows(page, last(large));
    const { startTime, responseEnd } = await page.evaluate(() => {
      const [entry] = performance.getEntriesByType("resource") as PerformanceResourceTiming[];
      return { startTime: entry!.startTime, responseEnd: entry!.responseEnd };
    });
    const { levels } = await told(page);
    first = Math.min(first, levels[0]!.painted - startTime);
    arrived = Math.min(arrived, responseEnd - startTime);
    whole = Math.min(whole, levels.at(-1)!.painted - startTime);
  }
  const ratio = (time: number) => `${time.toFixed(0)} ms (${(time / plain).toFixed(3)})`;
  t.diagnostic(`${large.name}: first picture ${first.toFixed(0)} ms; plain download ${plain.toFixed(0)} ms, all bytes ${ratio(arrived)}, the whole mesh painted ${ratio(whole)}`);
  assert.ok(first < 400, `${first}`);
  assert.ok(arrived < 1.05 * plain, `${arrived} against ${plain}`);
  await close();
});

test("a level whose positions are late is shown as estimated, then in its place", async () => {
  const file = fixture("late");
  const weather = { rate: 1e6, stopsAt: file.ends.at(-1)! };
  link.files.set("/late.tct", file.bytes);
  link.weather.set("/late.tct", weather);
  const { page, errors, close } = await visit(browser, view("/late.tct"));
  await shows(page, last(file));
  assert.match(await page.innerText("#level-text"), /estimated/);
  const [bytes, error] = [await page.innerText("#bytes"), await page.innerText("#error")];
  await keep(page, "late-estimated");
  weather.stopsAt = Infinity;
  await reach(page, "done");
  await page.waitForFunction(() => !document.getElementById("level-text")!.textContent!.includes("estimated"));
  assert.notEqual(await page.innerText("#bytes"), bytes);
  assert.equal(await page.innerText("#percent"), "100 %");
  assert.notEqual(await page.innerText("#error"), error);
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), file.digests.at(-1));
  const { levels } = await told(page);
  assert.deepEqual(levels.map(({ level }) => level), numbers(file));
  assert.deepEqual(levels.slice(-2).map(({ estimated }) => estimated), [true, false]);
  await page.keyboard.press("3");
  await page.waitForTimeout(600);
  await keep(page, "late-details");
  await page.keyboard.press("ArrowLeft");
  await shows(page, last(file) - 1);
  assert.deepEqual(errors, []);
  await close();
});

test("a connection that is cut resumes", async () => {
  link.weather.set("/small.tct", { cuts: [4_000, 15_000], rate: 200_000 });
  const { page, close } = await visit(browser, view("/small.tct"));
  await reach(page, "done");
  const { levels, mishaps } = await told(page);
  assert.deepEqual(mishaps.map(({ kind }) => kind), ["connection", "connection"]);
  assert.deepEqual(levels.map(({ level }) => level), numbers(small));
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), small.digests.at(-1));
  await close();
});

test("a damaged level is reported and asked for again", async () => {
  link.weather.set("/small.tct", { damage: { at: Math.floor(small.bytes.length / 2), times: 1 }, rate: 200_000 });
  const { page, close } = await visit(browser, view("/small.tct"));
  await page.waitForFunction(() => /damaged/.test(document.getElementById("toast")!.textContent!));
  await keep(page, "damage");
  await reach(page, "done");
  assert.deepEqual((await told(page)).mishaps.map(({ kind }) => kind), ["damage"]);
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), small.digests.at(-1));
  await close();
});

test("a file that cannot be had is said so", async () => {
  const { page, close } = await visit(browser, view("/missing.tct"));
  await page.waitForSelector("#toast.failure:not([hidden])");
  assert.equal(await page.innerText("#toast"), "missing.tct: 404 Not Found: there is no such file");
  assert.ok(await page.isDisabled("#finer"));
  // What went wrong does not hide what can be done.
  const [toast, button] = [await page.locator("#toast").boundingBox(), await page.locator("#choose").boundingBox()];
  assert.ok(toast!.y + toast!.height < button!.y);
  await close();
});

/** Drops a file on the page, as a hand would. */
async function drop(page: Page, name: string, bytes: Buffer): Promise<void> {
  const transfer = await page.evaluateHandle(([name, text]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(text!), (c) => c.charCodeAt(0))], name!));
    return transfer;
  }, [name, bytes.toString("base64")]);
  for (const type of ["dragover", "drop"]) await page.dispatchEvent("#stage", type, { dataTransfer: transfer });
}

test("a dropped .tct file is decoded, a dropped mesh file encoded first", async () => {
  const { page, errors, close } = await visit(browser, `${address}/view/`);
  await keep(page, "welcome");
  await drop(page, "soup.tct", fixture("soup").bytes);
  await reach(page, "done");
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), fixture("soup").digests.at(-1));
  const obj = "v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 2 4\nf 1 3 2\nf 1 4 3\nf 2 3 4\n";
  await drop(page, "tetrahedron.obj", Buffer.from(obj));
  await page.waitForFunction(() => document.getElementById("notes")!.textContent!.includes("Encoded here"));
  await reach(page, "done");
  assert.equal(await page.innerText("#vertices"), "4");
  await drop(page, "broken.ply", Buffer.from("ply\nnonsense\n"));
  await page.waitForSelector("#toast.failure:not([hidden])");
  assert.match(await page.innerText("#toast"), /^broken\.ply: /);
  assert.deepEqual(errors, []);
  await close();
});

/** An animal of boxes, its length along one axis and its height along another, as an OBJ file. */
function animal(place: (right: number, up: number, forward: number) => number[]): Buffer {
  const boxes = [
    ...[[-1, -2], [-1, 2], [1, -2], [1, 2]].map(([x, z]) => [[x! - 0.2, 0, z! - 0.2], [x! + 0.2, 2, z! + 0.2]]),
    [[-1.2, 2, -2.2], [1.2, 4, 2.2]], [[-0.6, 4, 0.8], [0.6, 6, 2.8]], [[-0.1, 3, -2.7], [0.1, 3.2, -2.1]],
  ];
  const quads = [[1, 2, 4, 3], [5, 7, 8, 6], [1, 5, 6, 2], [3, 4, 8, 7], [1, 3, 7, 5], [2, 6, 8, 4]];
  const lines = boxes.flatMap(([low, high], i) => [
    ...Array.from({ length: 8 }, (_, v) => {
      const [x, y, z] = [0, 1, 2].map((k) => ((v >> k) & 1 ? high : low)![k]!);
      return `v ${place(x!, y!, z!).join(" ")}`;
    }),
    ...quads.map((quad) => `f ${quad.map((v) => v + 8 * i).join(" ")}`),
  ]);
  return Buffer.from(lines.join("\n"));
}

test("a mesh stands on its feet, whichever axis points up, and the visitor has the last word", async () => {
  const { page, errors, close } = await visit(browser, `${address}/view/`);
  for (const [name, zUp, file] of [
    ["y-up", false, animal((right, up, forward) => [right, up, forward])],
    ["z-up", true, animal((right, up, forward) => [right, -forward, up])],
  ] as const) {
    await drop(page, `${name}.obj`, file);
    await page.waitForFunction((name) => document.getElementById("name")!.textContent === `${name}.obj`, name);
    await reach(page, "done");
    assert.equal(await page.isChecked("#up"), zUp, name);
    await page.waitForTimeout(800);
    await keep(page, name);
  }
  await page.keyboard.press("u");
  assert.equal(await page.isChecked("#up"), false);
  assert.deepEqual(errors, []);
  await close();
});

test("the slider and the keys go back and forth", async () => {
  const { page, errors, close } = await visit(browser, view("/small.tct"));
  await reach(page, "done");
  await shows(page, last(small));
  await page.keyboard.press("ArrowLeft");
  await shows(page, last(small) - 1);
  assert.match(await page.innerText("#level-text"), new RegExp(`^${last(small) - 1}\\s+of ${last(small)}`));
  await page.keyboard.press("PageDown");
  await shows(page, 0);
  await page.keyboard.press("ArrowRight");
  await shows(page, 1);
  await page.locator("#level").fill("4");
  await shows(page, 4);
  await page.keyboard.press("PageUp");
  await shows(page, last(small));
  for (const [key, id] of [["w", "wireframe"], ["f", "flat"], ["g", "grow"]] as const) {
    const checked = await page.isChecked(`#${id}`);
    await page.keyboard.press(key);
    assert.equal(await page.isChecked(`#${id}`), !checked);
  }
  await page.keyboard.press("?");
  await page.waitForSelector("#keys[open]");
  await keep(page, "keys");
  assert.deepEqual(errors, []);
  await close();
});

test("the paper's pictures have their colours", async () => {
  const { page, close } = await visit(browser, view("/small.tct"));
  await reach(page, "done");
  await page.locator("#level").fill(String(last(small) - 3));
  await shows(page, last(small) - 3);
  const blue = ([r, , b]: [number, number, number]) => b > r + 25;
  const orange = ([r, , b]: [number, number, number]) => r > b + 40;
  assert.equal(await share(page, orange), 0);
  await page.keyboard.press("2");
  await page.waitForTimeout(200);
  const [kept, fresh] = [await share(page, blue), await share(page, orange)];
  assert.ok(kept > 0.02 && fresh > 0.02, `${kept} ${fresh}`);
  await keep(page, "division");
  await page.keyboard.press("3");
  await page.waitForTimeout(200);
  assert.ok((await share(page, orange)) > 0.02);
  await keep(page, "details");
  const before = await sample(page, [[0.4, 0.4], [0.5, 0.5], [0.6, 0.6], [0.5, 0.3]]);
  await page.keyboard.press("4");
  await page.waitForTimeout(200);
  assert.notDeepEqual(await sample(page, [[0.4, 0.4], [0.5, 0.5], [0.6, 0.6], [0.5, 0.3]]), before);
  await keep(page, "predicted");
  await close();
});

test("dragging turns, the wheel comes closer", async () => {
  const { page, close } = await visit(browser, view("/small.tct"));
  await reach(page, "done");
  await shows(page, last(small));
  const [ground] = await sample(page, [[0.02, 0.02]]);
  const covered = () => share(page, (pixel) => bright(pixel, ground!));
  const before = await covered();
  await page.mouse.move(400, 350);
  await page.mouse.wheel(0, -400);
  await page.waitForTimeout(800);
  assert.ok((await covered()) > before + 0.03);
  await page.keyboard.press("Home");
  await page.waitForTimeout(300);
  assert.ok(Math.abs((await covered()) - before) < 0.03);
  await close();
});

test("the limiter slows the link, pausing holds it", async () => {
  const { page, close } = await ready("/large.tct");
  await page.selectOption("#rate", "8000");
  // The page presses the button itself: on a slow machine this process may come when all is done.
  const level = large.ends.findIndex((end) => end >= 8000);
  await page.evaluate((level) => addEventListener("tercet-level", (event) => {
    if ((event as CustomEvent<Told["levels"][0]>).detail.level === level) document.getElementById("pause")!.click();
  }), level);
  await page.click("#replay");
  await reach(page, "paused");
  const { arrived } = (await told(page)).levels.find((seen) => seen.level === level)!;
  assert.ok(arrived >= (0.9 * 1000 * large.ends[level]!) / 8000, `level ${level} after ${arrived} ms`);
  await page.waitForTimeout(200);
  const received = await page.innerText("#received");
  await page.waitForTimeout(300);
  assert.equal(await page.innerText("#received"), received);
  await page.selectOption("#rate", "");
  await page.click("#pause");
  await reach(page, "done");
  await close();
});

test("a phone and the dark have a legible page", async () => {
  for (const [name, options] of Object.entries({
    "desktop-dark": { colorScheme: "dark" as const },
    "phone-light": { viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 },
    "phone-dark": { viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2, colorScheme: "dark" as const },
  })) {
    const { page, errors, close } = await visit(browser, view("/large.tct"), options);
    await reach(page, "done");
    await shows(page, last(large));
    assert.deepEqual(errors, []);
    // Nothing is wider than the screen, and what matters most needs no scrolling.
    const [width, inner] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(width! <= inner!, `${width} > ${inner}`);
    for (const id of ["level", "vertices", "error", "progress"]) assert.ok(await page.locator(`#${id}`).isVisible(), id);
    const box = await page.locator("#figures").boundingBox();
    assert.ok(box!.y + box!.height <= (await page.evaluate(() => innerHeight)), name);
    await keep(page, name);
    await close();
  }
});

/** Datagrams in Chromium, from `tercet serve` over a link that loses packets. */
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { fixture, large, setting } from "../fixtures.js";
import { Link } from "../link.js";
import { radio } from "../radio.js";
import { requestsForFiles, serve, type Running } from "../server.js";
import { keep, launch, reach, told, visit } from "./page.js";

const link = new Link(setting("TERCET_VIEWER"));
const address = await link.listen();
const groups = fixture("groups");
const files = { "large.tct": large.bytes, "small.tct": fixture("scan").bytes, "groups.tct": groups.bytes };
let browser: Browser;
before(async () => { browser = await launch(); });
after(async () => {
  await browser.close();
  await link.close();
});

const view = (server: Running, file: string) =>
  `${address}/view/?protocol=wt&src=${encodeURIComponent(`${server.address}/${file}`)}`;
const dataset = () => ({ digest: document.body.dataset["digest"], protocol: document.body.dataset["protocol"] });

test("a mesh comes by datagrams, a tenth of which is lost, and is the original", async (t) => {
  const server = await serve(files, ["--webtransport", "--inject-loss", "0.1", "--inject-seed", "1"]);
  t.after(() => server.close());
  const { page, foreign, errors, close } = await visit(browser, view(server, "large.tct"));
  await reach(page, "done");
  assert.deepEqual(await page.evaluate(dataset), { digest: large.digests.at(-1), protocol: "wt" });
  assert.equal(await requestsForFiles(server.address), 0, "nothing came by HTTP");
  const { levels, mishaps } = await told(page);
  assert.deepEqual(mishaps, []);
  assert.ok(levels.length > 3, "levels come one after the other");
  t.diagnostic(`${large.name}: first level ${levels[0]!.arrived.toFixed(0)} ms, whole ${levels.at(-1)!.arrived.toFixed(0)} ms`);
  assert.deepEqual([foreign, errors], [[], []]);
  await close();
});

test("a level in groups is shown while it arrives, and is the original in the end", async (t) => {
  const server = await serve(files, ["--webtransport", "--inject-loss", "0.1", "--inject-seed", "1"]);
  t.after(() => server.close());
  const { port } = (await (await fetch(`${server.address}/webtransport.json`)).json()) as { port: number };
  // The machine's own way would bring the file between two frames.
  const way = await radio(port, 20, 20);
  t.after(() => way.close());
  // Levels that grow would keep previews waiting.
  const { page, foreign, errors, close } = await visit(browser, "about:blank", { reducedMotion: "reduce" });
  await page.addInitScript((port) => {
    globalThis.WebTransport = class extends WebTransport {
      constructor(url: string | URL, options?: WebTransportOptions) {
        super(String(url).replace(/:\d+\//, `:${port}/`), options);
      }
    };
  }, way.port);
  await page.goto(view(server, "groups.tct"));
  // The page says how much of the level is there.
  await page.waitForFunction(() => / % here$/.test(document.getElementById("level-text")!.textContent!));
  await keep(page, "holes");
  await reach(page, "done");
  assert.deepEqual(await page.evaluate(dataset), { digest: groups.digests.at(-1), protocol: "wt" });
  assert.equal(await requestsForFiles(server.address), 0, "nothing came by HTTP");
  const { levels, previews, mishaps } = await told(page);
  t.diagnostic(`level: vertices pending: ${previews.map(({ level, pending }) => `${level}: ${pending}`).join(", ")}`);
  assert.ok(previews.length > 1, `${previews.length}`);
  assert.equal(levels.length, groups.digests.length, "previews are no levels");
  assert.ok(previews.every(({ pending, vertices }) => pending < vertices));
  assert.deepEqual([mishaps, foreign, errors], [[], [], []]);
  await close();
});

test("where datagrams are not offered the file comes by the command protocol", async (t) => {
  const server = await serve(files);
  t.after(() => server.close());
  const { page, close } = await visit(browser, view(server, "small.tct"));
  await reach(page, "done");
  const digest = fixture("scan").digests.at(-1);
  assert.deepEqual(await page.evaluate(dataset), { digest, protocol: "ws" });
  assert.deepEqual((await told(page)).mishaps.map(({ kind }) => kind), ["connection"]);
  await close();
});

test("a session that breaks is gone on with by the command protocol", async (t) => {
  const server = await serve(files, ["--webtransport", "--inject-loss", "0.1", "--inject-seed", "1"]);
  t.after(() => server.close());
  const { page, close } = await visit(browser, "about:blank");
  await page.addInitScript(() => {
    // Breaks after some datagrams, fewer than the file takes.
    globalThis.WebTransport = class extends WebTransport {
      override get datagrams(): WebTransportDatagramDuplexStream {
        let left = 20;
        const some = new TransformStream<Uint8Array, Uint8Array>({
          transform: (datagram, out) => (left-- > 0 ? out.enqueue(datagram) : this.close()),
        });
        const { readable, writable } = super.datagrams;
        const datagrams = { readable: readable.pipeThrough(some), writable };
        Object.defineProperty(this, "datagrams", { value: datagrams });
        return datagrams as WebTransportDatagramDuplexStream;
      }
    };
  });
  await page.goto(view(server, "large.tct"));
  await reach(page, "done");
  assert.deepEqual(await page.evaluate(dataset), { digest: large.digests.at(-1), protocol: "ws" });
  const { mishaps } = await told(page);
  assert.ok(mishaps.length === 1 && mishaps[0]!.at > 0, "what had come was kept");
  await close();
});

/** The command protocol, from a page to `tercet serve`. */
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { fixture, setting, type Fixture } from "../fixtures.js";
import { Link } from "../link.js";
import { breaking, serve, type Running } from "../server.js";
import { launch, reach, shows, told, visit } from "./page.js";

const link = new Link(setting("TERCET_VIEWER"));
const address = await link.listen();
const file = fixture("scan");
const numbers = ({ digests, ends }: Fixture) => digests.map((_, i) => Math.min(i, ends.length - 1));
let browser: Browser;
let server: Running;

before(async () => {
  browser = await launch();
  server = await serve({ "a b%.tct": file.bytes });
  link.files.set("/plain.tct", file.bytes);
});
after(async () => {
  await browser.close();
  await server.close();
  await link.close();
});

const name = "/a%20b%25.tct";
const view = (url: string) => `${address}/view/?src=${encodeURIComponent(url)}&protocol=ws`;

/** Which addresses a page asks for, of WebSockets and of files. */
async function watched(url: string) {
  const context = await browser.newContext();
  const page = await context.newPage();
  const [sessions, files]: [string[], string[]] = [[], []];
  page.on("websocket", (socket) => {
    sessions.push(decodeURIComponent(new URL(socket.url()).search.replaceAll("+", " ")));
  });
  page.on("request", (request) => { if (request.url().includes(".tct") && !request.url().includes("/view/")) files.push(request.url()); });
  await page.goto(url);
  return { page, sessions, files, close: () => context.close() };
}

test("a page asks by the command protocol where it is told to", async () => {
  const { page, sessions, files, close } = await watched(view(server.address + name));
  await reach(page, "done");
  await shows(page, file.ends.length - 1);
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), file.digests.at(-1));
  assert.equal(await page.innerText("#name"), "a b%.tct");
  assert.deepEqual(sessions, ["?command=UNTIL 0"]);
  assert.deepEqual(files, []);
  await close();
});

test("a session that breaks is resumed where it broke", async () => {
  const weak = await breaking(server.address, "GET /ws/", [20_000, 20_000]);
  const { page, errors, close } = await visit(browser, view(weak.address + name));
  await reach(page, "done");
  const { levels, mishaps } = await told(page);
  assert.deepEqual(mishaps.map(({ kind }) => kind), ["connection", "connection"]);
  assert.ok(mishaps[0]!.at > 8_000 && mishaps[1]!.at > mishaps[0]!.at + 8_000, JSON.stringify(mishaps));
  assert.deepEqual(levels.map(({ level }) => level), numbers(file));
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), file.digests.at(-1));
  assert.deepEqual(errors.filter((error) => !error.includes("WebSocket")), []);
  await close();
  await weak.close();
});

test("where a server has no sessions the file is asked for as from any other", async () => {
  const { page, sessions, files, close } = await watched(view("/plain.tct"));
  await reach(page, "done");
  assert.equal(await page.evaluate(() => document.body.dataset["digest"]), file.digests.at(-1));
  assert.deepEqual([sessions.length, files.length], [1, 1]);
  await close();
});

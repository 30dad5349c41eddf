/** `tercet serve` as a process of its own. */
import { spawn, type ChildProcess } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { setting } from "./fixtures.js";

export class Server {
  private constructor(readonly address: string, private readonly process: ChildProcess, private readonly folder: string) {}

  /** Serves files by their names; `words` are further ones of the command line. */
  static async start(files: Record<string, Uint8Array>, words: string[]): Promise<Server> {
    const folder = mkdtempSync(join(tmpdir(), "tercet-serve-"));
    for (const [name, bytes] of Object.entries(files)) writeFileSync(join(folder, name), bytes);
    const common = ["serve", folder, "--cache", join(folder, ".cache"), "--quiet"];
    const process = spawn(setting("TERCET_COMMAND"), [...common, ...(words.includes("--addr") ? [] : ["--addr", "127.0.0.1:0"]), ...words], { stdio: ["ignore", "pipe", "inherit"] });
    // Its first line is its address.
    for await (const line of createInterface(process.stdout!)) return new Server(line.replace(/\/$/, ""), process, folder);
    throw new Error("the server says nothing");
  }

  /** Requests for files by plain HTTP that were answered so far. */
  async requestsForFiles(): Promise<number> {
    const text = await (await fetch(`${this.address}/metrics`)).text();
    const lines = text.split("\n").filter((line) => line.includes('route="/{*name}"'));
    return lines.reduce((sum, line) => sum + Number(line.split(" ").at(-1)), 0);
  }

  async stop(): Promise<void> {
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.process.kill();
    await ended;
    rmSync(this.folder, { recursive: true });
  }
}

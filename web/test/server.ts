/** `tercet serve` itself, and a link to it that breaks. */
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { connect, createServer, type AddressInfo, type Socket } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setting } from "./fixtures.js";

/** A server of some files, until it is closed. */
export interface Running {
  /** `http://HOST:PORT`. */
  address: string;
  close(): Promise<void>;
}

/** Starts `tercet serve` on a folder with these files; `more` are further words of its command line. */
export async function serve(files: Record<string, Uint8Array>, more: string[] = []): Promise<Running> {
  const folder = mkdtempSync(join(tmpdir(), "tercet-"));
  for (const [name, bytes] of Object.entries(files)) writeFileSync(join(folder, name), bytes);
  const words = ["serve", folder, "--addr", "127.0.0.1:0", "--cache", join(folder, "cache"), "--quiet", ...more];
  const process = spawn(setting("TERCET_COMMAND"), words, { stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise<void>((resolve) => process.once("exit", () => resolve()));
  const address = await new Promise<string>((resolve, reject) => {
    process.stdout.once("data", (line: Buffer) => resolve(line.toString().trim().replace(/\/$/, "")));
    process.once("exit", (code) => reject(new Error(`the server ended with ${code}`)));
    process.once("error", reject);
  });
  const close = async () => {
    process.kill();
    await ended;
    rmSync(folder, { recursive: true });
  };
  return { address, close };
}

/** Passes connections on to a server; those whose requests begin with a text break after so many bytes of the answer, once for each entry. */
export async function breaking(address: string, begins: string, cuts: number[]): Promise<Running> {
  const { hostname, port } = new URL(address);
  const sockets = new Set<Socket>();
  const passing = createServer((client) => {
    const server = connect(Number(port), hostname);
    let [cut, answered]: [number | undefined, number] = [undefined, 0];
    for (const socket of [client, server]) {
      sockets.add(socket);
      socket.on("error", () => {});
      socket.on("close", () => [client, server].forEach((one) => (one.destroy(), sockets.delete(one))));
    }
    client.on("data", (bytes) => {
      if (bytes.subarray(0, begins.length).toString() === begins) cut = cuts.shift();
      server.write(bytes);
    });
    server.on("data", (bytes) => {
      answered += bytes.length;
      if (cut === undefined || answered < cut) return void client.write(bytes);
      client.end(bytes.subarray(0, bytes.length - (answered - cut)));
    });
  });
  await new Promise<void>((resolve) => passing.listen(0, "127.0.0.1", resolve));
  const close = async () => {
    sockets.forEach((socket) => socket.destroy());
    await new Promise((resolve) => passing.close(resolve));
  };
  return { address: `http://127.0.0.1:${(passing.address() as AddressInfo).port}`, close };
}

/** Requests for files by plain HTTP that a server has answered so far. */
export async function requestsForFiles(address: string): Promise<number> {
  const text = await (await fetch(`${address}/metrics`)).text();
  const lines = text.split("\n").filter((line) => line.includes('route="/{*name}"'));
  return lines.reduce((sum, line) => sum + Number(line.split(" ").at(-1)), 0);
}

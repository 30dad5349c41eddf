/** Files written by the native encoder, with what the native decoder makes of them. */
import { readFileSync } from "node:fs";
import { join } from "node:path";

export interface Fixture {
  name: string;
  /** Whether it has levels in groups, which the small module lacks. */
  grouped: boolean;
  /** Of each level, then of the original where sections restore it. */
  digests: string[];
  /** Bytes from the file's start to the end of each level. */
  ends: number[];
  /** The native decoder's time. */
  milliseconds: number;
  bytes: Buffer<ArrayBuffer>;
}

function setting(name: string): string {
  const value = process.env[name];
  if (!value) throw new Error(`${name} is not set: run this by \`cargo xtask test --only web,browser\``);
  return value;
}

const folder = setting("TERCET_FIXTURES");

export const fixtures: Fixture[] = (JSON.parse(readFileSync(join(folder, "fixtures.json"), "utf8")) as Fixture[])
  .map((fixture) => ({ ...fixture, bytes: readFileSync(join(folder, `${fixture.name}.tct`)) as Buffer<ArrayBuffer> }));

/** The fixture of that name. */
export function fixture(name: string): Fixture {
  const found = fixtures.find((fixture) => fixture.name === name);
  if (!found) throw new Error(`there is no fixture ${name}`);
  return found;
}

/** What a sender sends of a file in groups. */
export interface Sent {
  identity: Buffer;
  opening: Buffer;
  datagrams: Buffer[];
}

export function sent(name: string): Sent {
  const bytes = readFileSync(join(folder, `${name}.sent`));
  const records: Buffer[] = [];
  for (let at = 0; at < bytes.length; at += 4 + records.at(-1)!.length) {
    records.push(bytes.subarray(at + 4, at + 4 + bytes.readUInt32LE(at)));
  }
  const [identity, opening, ...datagrams] = records as [Buffer, Buffer, ...Buffer[]];
  return { identity, opening, datagrams };
}

/** A real mesh of 48 485 vertices where there are real meshes, otherwise a generated one of 20 000. */
export const large = fixtures.find(({ name }) => name === "horse-12") ?? fixture("scan");

export { setting };

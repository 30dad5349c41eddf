/** Colours of vertices, as three.js takes them: red, green and blue in linear light. */
import { Color } from "three";

export const KEPT = "#3f7fc4";
export const FRESH = "#ee7f2d";
/** Where there is nothing to tell. */
export const NEUTRAL = "#8d949c";
/** From small to large; lightness rises all the way, so that it reads without colour too. */
export const SCALE = ["#2b1a5e", "#6b2a83", "#b53b79", "#ea6a53", "#fbb04c", "#f6f39a"];

/** Colours for a division: the first `kept` vertices are even, the others odd. */
export function division(vertices: number, kept: number): Float32Array<ArrayBuffer> {
  const colours = new Float32Array(3 * vertices);
  const [even, odd] = [new Color(KEPT), new Color(FRESH)];
  for (let v = 0; v < vertices; v++) (v < kept ? even : odd).toArray(colours, 3 * v);
  return colours;
}

/** The range of a set of lengths that the colours tell apart: without the outermost hundredths. */
export function extent(lengths: Float32Array): [number, number] {
  const sorted = lengths.filter((length) => length > 0).sort();
  if (sorted.length === 0) return [1e-6, 1e-5];
  const high = sorted[Math.floor(0.99 * (sorted.length - 1))]!;
  return [Math.max(sorted[Math.floor(0.01 * sorted.length)]!, high / 1000), high * 1.001];
}

/** Colours for lengths on a logarithmic scale; NaN is neutral. */
export function magnitudes(lengths: Float32Array, [low, high]: [number, number]): Float32Array<ArrayBuffer> {
  const colours = new Float32Array(3 * lengths.length);
  const stops = SCALE.map((stop) => new Color(stop));
  const neutral = new Color(NEUTRAL);
  const colour = new Color();
  const width = Math.log(high / low);
  lengths.forEach((length, v) => {
    if (Number.isNaN(length)) return void neutral.toArray(colours, 3 * v);
    const place = Math.min(1, Math.max(0, Math.log(Math.max(length, low) / low) / width)) * (stops.length - 1);
    const stop = Math.min(stops.length - 2, Math.floor(place));
    colour.lerpColors(stops[stop]!, stops[stop + 1]!, place - stop).toArray(colours, 3 * v);
  });
  return colours;
}

/** Numbers for people. */

/** With thin spaces between thousands. */
export function count(value: number): string {
  return Math.round(value).toString().replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

export function bytes(value: number): string {
  if (value < 1000) return `${value} B`;
  return value < 1e6 ? `${short(value / 1e3)} kB` : `${short(value / 1e6)} MB`;
}

export function percent(part: number): string {
  if (part === 0) return "0 %";
  return part < 1e-8 ? "< 0.000001 %" : `${plainDigits(100 * part)} %`;
}

export function duration(milliseconds: number): string {
  return milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${short(milliseconds / 1000)} s`;
}

function short(value: number): string {
  return value >= 100 ? count(value) : value.toPrecision(value >= 10 ? 3 : 2);
}

/** Two significant digits without an exponent. */
function plainDigits(value: number): string {
  if (value >= 99.95) return "100";
  return value >= 1 ? value.toPrecision(value >= 10 ? 3 : 2) : value.toFixed(Math.min(8, 1 - Math.floor(Math.log10(value))));
}

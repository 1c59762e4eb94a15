/** Numbers for people: millimetres, degrees, units with prefixes. Data stay in SI. */

/** Stands where a value is absent. */
export const ABSENT = "–";

/**
 * Three significant digits, without an exponent where that is readable.
 * @param {number} x
 */
export function short(x) {
  if (!Number.isFinite(x)) return ABSENT;
  const size = Math.abs(x);
  if (Number.isInteger(x) && size < 1e6) return String(x);
  if (size >= 1e6 || (size > 0 && size < 1e-3)) return x.toExponential(2).replace("e+", "e");
  if (size >= 100) return x.toFixed(0);
  if (size >= 10) return x.toFixed(1);
  if (size >= 1) return x.toFixed(2);
  return x.toFixed(3);
}

/**
 * A factor and a unit in which values as large as `size` are readable.
 * @param {string} unit as the server spells it; "P" is the unit of pressure
 * @param {number} size
 * @param {string} quantity what P is
 * @returns {{factor: number, unit: string}}
 */
export function scaleFor(unit, size, quantity) {
  switch (unit === "P" ? quantity : unit) {
    case "m":
      // The least distance that is told, 0.1 mm, is a little less in single precision.
      return size > 0 && size < 9.9e-5 ? { factor: 1e6, unit: "µm" } : { factor: 1e3, unit: "mm" };
    case "m²":
      return size >= 1e-2 ? { factor: 1e4, unit: "cm²" } : { factor: 1e6, unit: "mm²" };
    case "m/s":
      return { factor: 1e3, unit: "mm/s" };
    case "rad":
      return { factor: 180 / Math.PI, unit: "°" };
    case "Pa":
      if (size >= 1e6) return { factor: 1e-6, unit: "MPa" };
      return size >= 1e3 ? { factor: 1e-3, unit: "kPa" } : { factor: 1, unit: "Pa" };
    case "N":
      return size > 0 && size < 0.1 ? { factor: 1e3, unit: "mN" } : { factor: 1, unit: "N" };
    case "N m":
      return { factor: 1e3, unit: "mN m" };
    case "count":
      return { factor: 1, unit: "counts" };
    case "count/s":
      return { factor: 1, unit: "counts/s" };
    case "1":
    case "":
      return { factor: 1, unit: "" };
    default:
      return { factor: 1, unit };
  }
}

/**
 * @param {number | null | undefined} x
 * @param {string} unit
 * @param {string} quantity
 */
export function withUnit(x, unit, quantity) {
  if (x === null || x === undefined || !Number.isFinite(x)) return ABSENT;
  const by = scaleFor(unit, Math.abs(x), quantity);
  const number = by.unit === "°" ? (x * by.factor).toFixed(1) : short(x * by.factor);
  return by.unit === "°" ? `${number}°` : by.unit ? `${number} ${by.unit}` : number;
}

/**
 * All components of a value.
 * @param {ArrayLike<number> | null} value
 * @param {string} unit
 * @param {string} quantity
 */
export function vectorWithUnit(value, unit, quantity) {
  if (!value) return ABSENT;
  const parts = Array.from(value);
  if (parts.length === 1) return withUnit(parts[0], unit, quantity);
  const by = scaleFor(unit, Math.max(...parts.map(Math.abs)), quantity);
  const fixed = (/** @type {number} */ x) => x.toFixed(2).replace(/^-(0\.00)$/, "$1");
  const text = parts.map((x) => (by.unit === "mm" ? fixed(x * by.factor) : short(x * by.factor)));
  return `${text.join(", ")}${by.unit ? ` ${by.unit}` : ""}`;
}

/** @param {number} t seconds */
export function seconds(t) {
  if (!Number.isFinite(t)) return ABSENT;
  if (Math.abs(t) < 600) return `${t.toFixed(2)} s`;
  const [h, m, s] = [Math.floor(t / 3600), Math.floor(t / 60) % 60, t % 60];
  const two = (/** @type {number} */ x) => String(Math.floor(x)).padStart(2, "0");
  return `${h ? `${h}:` : ""}${two(m)}:${two(s)}.${String(Math.floor((s % 1) * 10))}`;
}

/** @param {Date} date */
export function clock(date) {
  return [date.getHours(), date.getMinutes(), date.getSeconds()]
    .map((x) => String(x).padStart(2, "0"))
    .join(":");
}

/**
 * Round places of an axis: about `count` between two values.
 * @param {number} least
 * @param {number} most
 * @param {number} count
 */
export function ticks(least, most, count) {
  const span = most - least;
  if (!(span > 0)) return [least];
  const raw = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = ([1, 2, 5, 10].find((s) => s * power >= raw) ?? 10) * power;
  const places = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + step * 1e-9; k++)
    places.push(k * step || 0);
  return places;
}

/**
 * The text of a tick, with as many digits as the step needs.
 * @param {number} x
 * @param {number[]} places
 */
export function tickText(x, places) {
  const step = places.length > 1 ? Math.abs(places[1] - places[0]) : Math.abs(x) || 1;
  if (Math.abs(x) >= 1e6 || (step < 1e-4 && step > 0)) return x.toExponential(1).replace("e+", "e");
  return x.toFixed(Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9))));
}

/** Characters of a path that are shown. */
const PATH_MAX = 40;

/**
 * A path cut off at its beginning where it is long: its end says more.
 * @param {string} path
 */
export function shortPath(path) {
  if (path.length <= PATH_MAX) return path;
  const end = path.slice(-(PATH_MAX - 1));
  const slash = end.indexOf("/");
  // From the beginning of a folder's name, unless that leaves little.
  return `…${slash >= 0 && slash < PATH_MAX / 2 ? end.slice(slash) : end}`;
}

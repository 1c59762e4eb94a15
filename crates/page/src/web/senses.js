/** What taxels read beside pressure: temperatures, distances and tangential forces. Nothing here touches the document. */

import { HEALTH } from "./wire.js";

/** @typedef {"pressure" | "shear" | "temperature" | "proximity"} Sense */
/** @typedef {{least: number, most: number, from: string}} Ends */
/** @typedef {{temperature: Ends | null, proximity: Ends | null, shear: Ends | null}} SenseScales */
/** @typedef {{shear: number[], tangents: number[][][], temperature: number[], proximity: number[], temperature_colours: number[][],
 *   distance_colours: number[][], scales: SenseScales}} SensesOfWelcome */

const NOT_SENT = HEALTH.indexOf("not sent");
const OUT_OF_RANGE = HEALTH.indexOf("out of range");
const GOOD = HEALTH.indexOf("good");
/** The coldest of a scale has a colour, too, which only what is above 0 has. */
const LEAST_SHARE = 1e-6;

export class Senses {
  /**
   * @param {SensesOfWelcome} about
   * @param {number} taxels
   */
  constructor(about, taxels) {
    this.about = about;
    this.scales = about.scales;
    /** By taxel. @type {Sense[]} */
    this.of = new Array(taxels).fill("pressure");
    for (const taxel of about.temperature) this.of[taxel] = "temperature";
    for (const taxel of about.proximity) this.of[taxel] = "proximity";
    /** By taxel, which of those with three axes it is. @type {Map<number, number>} */
    this.pulled = new Map(about.shear.map((taxel, i) => [taxel, i]));
    /** Pressures, °C and m by taxel, as they came. */
    this.values = /** @type {Float32Array} */ (new Float32Array(taxels).fill(NaN));
    /** @type {Uint8Array} */
    this.health = new Uint8Array(taxels).fill(HEALTH.indexOf("missing"));
    /** Along both tangents. @type {Float32Array} */
    this.shear = new Float32Array(2 * about.shear.length);
  }

  /** @param {import("./wire.js").Frame} frame */
  take(frame) {
    if (frame.pressure) this.values = frame.pressure;
    if (frame.health) this.health = frame.health;
    if (frame.shear) this.shear = frame.shear;
  }

  /**
   * The scale of tangential forces, where it is not the one of pressures, `pressures`: one that is known is for both, but for a range
   * of their own.
   * @param {{from: string}} pressures
   */
  shearEnds(pressures) {
    const own = this.scales.shear;
    const isOfData = pressures.from === "recording" || pressures.from === "grown";
    return own && (isOfData || own.from === "raw range") ? own : null;
  }

  /**
   * Whether a taxel reads that.
   * @param {number} taxel
   * @param {Sense} sense
   */
  reads(taxel, sense) {
    return sense === "shear" ? this.pulled.has(taxel) : this.of[taxel] === sense;
  }

  /**
   * The tangential forces of a taxel along both tangents; null where it has none or they are not known.
   * @param {number} taxel
   */
  shearOf(taxel) {
    const at = this.pulled.get(taxel);
    if (at === undefined || Number.isNaN(this.shear[2 * at])) return null;
    return [this.shear[2 * at], this.shear[2 * at + 1]];
  }

  /**
   * Both tangents of a taxel with three axes, in the frame of its link.
   * @param {number} taxel
   */
  tangentsOf(taxel) {
    return this.about.tangents[this.pulled.get(taxel) ?? 0];
  }

  /**
   * The ends of a sense's scale, °C or m; null of pressures and shear, which are in the unit of P, or where nothing is known.
   * @param {Sense} sense
   */
  ends(sense) {
    return sense === "temperature" || sense === "proximity" ? this.scales[sense] : null;
  }

  /**
   * What taxels are coloured by in a sense: pressures or tangential forces, or shares of its scale above 0; and their states, those
   * of others being that they are not sent.
   * @param {Sense} sense
   */
  shown(sense) {
    const count = this.values.length;
    const values = new Float32Array(count).fill(NaN);
    const health = new Uint8Array(count).fill(NOT_SENT);
    const ends = this.ends(sense);
    for (let i = 0; i < count; i++) {
      if (!this.reads(i, sense)) continue;
      health[i] = this.health[i];
      const value = this.values[i];
      if (sense === "pressure") values[i] = value;
      else if (sense === "shear") values[i] = this.shownShear(i);
      else if (ends && !Number.isNaN(value))
        values[i] = Math.min(1, Math.max(LEAST_SHARE, (value - ends.least) / (ends.most - ends.least)));
      // Where nothing is near, a taxel feels nothing.
      if (sense === "proximity" && health[i] === OUT_OF_RANGE) [values[i], health[i]] = [0, GOOD];
    }
    return { values, health };
  }

  /** @param {number} taxel */
  shownShear(taxel) {
    if (Number.isNaN(this.values[taxel])) return NaN;
    const shear = this.shearOf(taxel);
    return shear ? Math.hypot(...shear) : NaN;
  }
}

/**
 * What a letter is called: `sustained` is the pressure itself where no other letter is made of pressures.
 * @param {string | null} letter
 * @param {{letter: string | null, sense: Sense}[]} fields
 */
export function letterName(letter, fields) {
  const ofPressure = new Set(fields.filter(({ sense }) => sense === "pressure").map((field) => field.letter));
  return letter === null || (ofPressure.has(letter) && ofPressure.size === 1) ? "pressure" : letter;
}

/**
 * The unit of a column for fields in a letter, where P is a `quantity`: those of change have the change of P in its place.
 * @param {{name: string, unit: string} | undefined} column
 * @param {string | null | undefined} letter
 * @param {string} quantity
 */
export function unitOf(column, letter, quantity) {
  const unit = column?.unit ?? "1";
  const isOfPressures = unit === "P" || (unit === quantity && column?.name !== "force");
  return letter === "change" && isOfPressures ? `${quantity}/s` : unit;
}

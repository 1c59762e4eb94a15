/** What the newest frame reports of each field. */

import { Observed } from "./dom.js";
import { withUnit } from "./format.js";
import { REASONS } from "./reasons.js";
import { unitOf } from "./senses.js";
import { IN_WORLD_BIT, isPresent } from "./wire.js";

export class Reported extends Observed {
  constructor() {
    super();
    /** @type {import("./wire.js").Welcome | null} */
    this.welcome = null;
    /** @type {Map<string, number>} */
    this.columnIndex = new Map();
    /** @type {import("./wire.js").Percepts | null} */
    this.percepts = null;
    /** Where a field in contact stands in `percepts`. @type {Map<number, number>} */
    this.inContact = new Map();
    /** Whether the area of any taxel is known. */
    this.hasAreas = true;
    /** What is shown of taxels and fields. @type {import("./senses.js").Sense} */
    this.sense = "pressure";
    /** The letter that is shown. @type {string | null} */
    this.letter = null;
  }

  /**
   * Takes what a run computes; nothing of it has come yet.
   * @param {import("./wire.js").Welcome} welcome
   */
  describe(welcome) {
    this.welcome = welcome;
    this.columnIndex = new Map(welcome.columns.map((column, i) => [column.name, i]));
    this.percepts = null;
    this.inContact = new Map();
  }

  /** @param {import("./wire.js").Percepts} percepts */
  report(percepts) {
    this.percepts = percepts;
    this.inContact = new Map(Array.from(percepts.field, (field, k) => [field, k]));
  }

  get quantity() {
    return this.welcome?.quantity ?? "count";
  }

  /**
   * What a field reports in a column; null where it is absent.
   * @param {number} field
   * @param {string} column
   */
  value(field, column) {
    const k = this.inContact.get(field);
    const index = this.columnIndex.get(column);
    if (k === undefined || index === undefined || !this.percepts || !this.welcome) return null;
    const values = this.percepts.columns.get(index);
    if (!values || !isPresent(this.percepts, k, index)) return null;
    const components = this.welcome.columns[index].components;
    return values.subarray(k * components, (k + 1) * components);
  }

  /**
   * The same as people read it: places in the world from the world's own origin, not from the picture's.
   * @param {number} field
   * @param {string} column
   */
  forPeople(field, column) {
    const value = this.value(field, column);
    if (!value || column !== "position" || !this.isInWorld(field)) return value;
    return value.map((x, i) => x + (this.welcome?.origin[i] ?? 0));
  }

  /**
   * Whether a field in contact has its places in the world.
   * @param {number} field
   */
  isInWorld(field) {
    const k = this.inContact.get(field);
    return k !== undefined && !!this.percepts && isPresent(this.percepts, k, IN_WORLD_BIT);
  }

  /**
   * The column that says how hard a field is pressed: its force where that is computed and can be known, else the sum of its pressures, else the
   * highest of them; null where the run computes none of these. Changes make no force. Of another sense what it reads first: the
   * tangential force, the mean temperature, the least distance.
   */
  get loadColumn() {
    if (this.sense !== "pressure") {
      const first = { shear: "shear_vector", temperature: "temperature", proximity: "nearest" }[this.sense];
      return this.columnIndex.has(first) ? first : null;
    }
    // Counts have no unit, and pressures without areas make no force.
    const isKnown = this.quantity === "Pa" ? this.hasAreas : this.quantity !== "count";
    if (this.columnIndex.has("force") && isKnown && this.letter !== "change") return "force";
    return ["total", "peak", "force"].find((name) => this.columnIndex.has(name)) ?? null;
  }

  /** Its unit. */
  get loadUnit() {
    if (this.sense === "temperature") return "°C";
    if (this.sense === "proximity") return "m";
    const name = this.loadColumn ?? "";
    return unitOf({ name, unit: name === "force" ? "N" : "P" }, this.letter, this.quantity);
  }

  /** The column that is plotted first: how hard fields are pressed, or where that is not computed the run's first output. */
  get plottedColumn() {
    if (this.sense === "shear" && this.columnIndex.has("friction")) return "friction";
    return this.loadColumn ?? this.welcome?.columns[0]?.name ?? null;
  }

  /**
   * How hard a field is pressed, or what else it reads; 0 where that is absent.
   * @param {number} field
   */
  load(field) {
    const value = this.loadColumn && this.value(field, this.loadColumn);
    if (!value) return 0;
    return (value.length > 1 ? Math.hypot(...value) : value[0]) || 0;
  }

  /**
   * How much a field says: its load, or of distances how near something is.
   * @param {number} field
   */
  strength(field) {
    const load = this.load(field);
    return this.sense === "proximity" && load > 0 ? 1 / load : load;
  }

  /**
   * It as text; a dash where it is absent, and only that it is touched where a run computes none.
   * @param {number} field
   */
  loadText(field) {
    if (!this.loadColumn) return "touched";
    const value = this.value(field, this.loadColumn);
    return value ? withUnit(this.load(field), this.loadUnit, this.quantity) : "–";
  }

  /**
   * Names of a field's flags.
   * @param {number} field
   */
  flagsOf(field) {
    const k = this.inContact.get(field);
    if (k === undefined || !this.percepts || !this.welcome) return ["no_contact"];
    const flags = this.percepts.flags[k];
    return this.welcome.flags.filter((name, bit) => name !== null && (flags >>> bit) & 1).map(String);
  }

  /**
   * The flag that says why a column is absent.
   * @param {number} field
   * @param {string} column
   */
  reason(field, column) {
    const flags = this.flagsOf(field);
    const likely = REASONS[column]?.find((name) => flags.includes(name));
    return likely ?? flags.join(", ");
  }
}

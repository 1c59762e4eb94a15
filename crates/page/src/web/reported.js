/** What the newest frame reports of each field. */

import { Observed } from "./dom.js";
import { withUnit } from "./format.js";
import { REASONS } from "./reasons.js";
import { IN_WORLD_BIT } from "./wire.js";

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
    if (!values || !((this.percepts.present[k] >>> index) & 1)) return null;
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
    const present = this.percepts?.present[this.inContact.get(field) ?? 0] ?? 0;
    if (!value || column !== "position" || !((present >>> IN_WORLD_BIT) & 1)) return value;
    return value.map((x, i) => x + (this.welcome?.origin[i] ?? 0));
  }

  /**
   * The column that says how hard a field is pressed: its force where that is computed and can be known, else the sum of its pressures, else the
   * highest of them; null where the run computes none of these.
   */
  get loadColumn() {
    // Counts have no unit, and pressures without areas make no force.
    const isKnown = this.quantity === "Pa" ? this.hasAreas : this.quantity !== "count";
    if (this.columnIndex.has("force") && isKnown) return "force";
    return ["total", "peak", "force"].find((name) => this.columnIndex.has(name)) ?? null;
  }

  /** Its unit. */
  get loadUnit() {
    return this.loadColumn === "force" ? "N" : "P";
  }

  /** The column that is plotted first: how hard fields are pressed, or where that is not computed the run's first output. */
  get plottedColumn() {
    return this.loadColumn ?? this.welcome?.columns[0]?.name ?? null;
  }

  /**
   * How hard a field is pressed; 0 where that is absent.
   * @param {number} field
   */
  load(field) {
    return (this.loadColumn && this.value(field, this.loadColumn)?.[0]) || 0;
  }

  /**
   * It as text; a dash where it is absent, and only that it is touched where a run computes none.
   * @param {number} field
   */
  loadText(field) {
    if (!this.loadColumn) return "touched";
    const value = this.value(field, this.loadColumn);
    return value ? withUnit(value[0], this.loadUnit, this.quantity) : "–";
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

/** Saves what the plots show as a table. */

import { columnsOfBand, csvOf, headOf, rowsOf } from "./csv.js";
import { saveFile } from "./dom.js";
import { short } from "./format.js";
import { fileName } from "./photo.js";
import { say } from "./wire.js";

/** @typedef {import("./csv.js").Column} Column */
/** @typedef {import("./wire.js").Series} Series */

/** Parts of the time that are asked for: the most that the server gives. */
const BINS = 4096;

export class PlotFile {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./socket.js").Connection} connection
   * @param {import("./plots.js").Plots} plots
   * @param {(text: string) => void} tell
   */
  constructor(model, connection, plots, tell) {
    this.model = model;
    this.connection = connection;
    this.plots = plots;
    this.tell = tell;
    /** What the server was asked for. @type {{id: number, series: Series[]} | null} */
    this.asked = null;
    model.on("history", () => this.answered());
    model.on("scene", () => (this.asked = null));
  }

  save() {
    const { model, plots } = this;
    const { series, span } = plots;
    if (!series.length && plots.touches.root.hidden) this.tell("Nothing is plotted.");
    else if (model.welcome?.time && series.length) {
      this.asked = { id: plots.nextId(), series: [...series] };
      this.connection.send(say.history(this.asked.id, span.from, span.to, BINS, this.asked.series));
    } else this.write([...series.flatMap((one) => this.columnOfRing(one)), ...this.columnsOfTouches()], "");
  }

  answered() {
    const { history, welcome } = this.model;
    const { asked } = this;
    if (!history || !asked || history.id !== asked.id || !welcome?.time) return;
    this.asked = null;
    const rows = rowsOf(history, welcome.time);
    const columns = asked.series.flatMap((one, i) => {
      const band = { least: history.least[i], most: history.most[i] };
      return columnsOfBand(this.nameOf(one), this.unitOf(one), band, rows);
    });
    const isParted = columns.length > asked.series.length;
    const part = `${short((1e3 * (history.to - history.from)) / history.bins)} ms`;
    this.write([...columns, ...this.columnsOfTouches()], isParted ? `, least and most of each ${part}` : "");
  }

  /** @param {Series} series */
  nameOf(series) {
    const field = this.model.welcome?.fields[series.field];
    return `${field?.name ?? ""}${this.plots.labelOf(series)}`;
  }

  /** @param {Series} series */
  unitOf(series) {
    const unit = this.plots.unitOf(series);
    return unit === "P" ? this.model.quantity : unit;
  }

  /**
   * @param {Series} series
   * @returns {Column[]}
   */
  columnOfRing(series) {
    const ring = this.plots.ringOf(series);
    const { from, to } = this.plots.range();
    /** @type {Column & {t: number[], v: number[]}} */
    const column = { name: headOf(this.nameOf(series), this.unitOf(series)), t: [], v: [] };
    for (let k = 0; ring && k < ring.size; k++) {
      const at = (ring.begin + k) & (ring.t.length - 1);
      if (!(ring.t[at] >= from && ring.t[at] <= to)) continue;
      column.t.push(ring.t[at]);
      column.v.push(ring.v[at]);
    }
    return [column];
  }

  /** @returns {Column[]} */
  columnsOfTouches() {
    const { touches } = this.plots;
    if (touches.root.hidden) return [];
    const { from, to } = this.plots.range();
    const [what, unit] = touches.past.hasForce ? ["force", "N"] : ["total", this.model.quantity];
    return touches.past.within(from, to).map(({ id, t, v }) => {
      const kept = t.flatMap((time, i) => (time >= from && time <= to ? [i] : []));
      return {
        name: headOf(`touch ${id} ${what}`, unit),
        t: kept.map((i) => t[i]),
        v: kept.map((i) => v[i]),
      };
    });
  }

  /**
   * @param {Column[]} columns
   * @param {string} how rows were made
   */
  write(columns, how) {
    const { text, rows } = csvOf(columns);
    const name = fileName(this.model, "-plots.csv");
    saveFile(new Blob([text], { type: "text/csv" }), name);
    this.tell(`${name}: ${rows} ${rows === 1 ? "time" : "times"}${how}`);
  }
}

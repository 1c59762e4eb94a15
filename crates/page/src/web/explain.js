/** The percept of the field that is shown: all its outputs, and on demand how they came about, beside the reference. */

import { byId, make, setText } from "./dom.js";
import { ABSENT, scaleFor, seconds, short, vectorWithUnit, withUnit } from "./format.js";
import { readingRows } from "./inspect.js";
import { unitOf } from "./senses.js";
import { say } from "./wire.js";

export class PerceptPanel {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   * @param {import("./socket.js").Connection} connection
   * @param {import("./plots.js").Plots} plots
   */
  constructor(model, choices, connection, plots) {
    this.model = model;
    this.choices = choices;
    this.connection = connection;
    this.plots = plots;
    this.title = byId("percept-title", HTMLElement);
    this.body = byId("percept-values", HTMLElement);
    this.flags = byId("percept-flags", HTMLElement);
    this.result = byId("explanation", HTMLElement);
    this.button = byId("explain", HTMLButtonElement);
    this.button.addEventListener("click", () => this.ask());
    /** @type {Map<string, {row: HTMLElement, value: HTMLElement, plot: HTMLElement}>} */
    this.rows = new Map();
    model.on("scene", () => this.build());
    model.on("explain", () => this.showExplanation());
    model.on("series", () => this.markPlots());
    choices.on("field", () => {
      this.result.replaceChildren();
      this.markPlots();
    });
  }

  build() {
    this.rows.clear();
    this.result.replaceChildren();
    this.body.replaceChildren(
      ...(this.model.welcome?.columns ?? []).map((column) => {
        const row = make("div", "output");
        row.title = column.help;
        const value = make("span", "output-value");
        const plot = make("button", "plot-button", "∿");
        plot.title = `Plot ${column.name} over time`;
        plot.addEventListener("click", () => {
          const { field } = this.choices;
          if (field !== null) this.plots.toggle(field, column.name);
        });
        row.append(make("span", "output-name", column.name.replaceAll("_", " ")), value, plot);
        this.rows.set(column.name, { row, value, plot });
        return row;
      }),
    );
    this.markPlots();
  }

  markPlots() {
    const { field } = this.choices;
    for (const [column, { plot }] of this.rows)
      plot.setAttribute("aria-pressed", String(field !== null && this.plots.has(field, column)));
  }

  /** Values of the newest frame. */
  update() {
    const { model, choices } = this;
    const { welcome } = model;
    const { field } = choices;
    this.button.disabled = field === null;
    if (!welcome || field === null) {
      setText(this.title, "");
      return;
    }
    const about = welcome.fields[field];
    setText(this.title, about.label);
    this.title.title = about.name;
    setText(byId("chart-title", HTMLElement), about.label);
    byId("percept-follow", HTMLElement).hidden = choices.chosen !== null;
    const touched = model.inContact.has(field);
    // A sum of pressures says less than the force that they make, and looks like a pressure.
    const force = model.value(field, "force");
    for (const column of welcome.columns) {
      const row = this.rows.get(column.name);
      if (!row) continue;
      const isTold = column.name === "total" && force !== null && Number.isFinite(force[0]);
      row.row.hidden = isTold || column.sense !== about.sense;
      const value = model.forPeople(field, column.name);
      const text = value
        ? vectorWithUnit(value, unitOf(column, about.letter, model.quantity), model.quantity)
        : `${ABSENT} ${touched ? model.reason(field, column.name).replaceAll("_", " ") : ""}`;
      setText(row.value, text);
      row.value.classList.toggle("absent", !value);
    }
    const flags = model.flagsOf(field).map((flag) => flag.replaceAll("_", " "));
    if (this.flags.textContent !== flags.join(""))
      this.flags.replaceChildren(...flags.map((flag) => make("span", "flag", flag)));
  }

  /** @param {number | null} [field] */
  ask(field = this.choices.field) {
    if (field === null) return;
    byId("percept-panel", HTMLDetailsElement).open = true;
    this.result.replaceChildren(make("p", "note", "Computing …"));
    this.button.scrollIntoView({ block: "start" });
    this.connection.send(say.explain(field));
  }

  showExplanation() {
    const { explanation } = this.model;
    const { welcome, mesh } = this.model;
    if (!explanation || !welcome || !mesh) return;
    if (explanation.error) {
      this.result.replaceChildren(make("p", "note", explanation.error));
      return;
    }
    const { quantity } = welcome;
    const { sense = "pressure", letter = null } = welcome.fields[explanation.field] ?? {};
    const head = make(
      "p",
      "note",
      `Frame ${explanation.frame} at ${seconds(explanation.t_s)}, by ${explanation.backend}; the f64 reference starts from the same state.`,
    );
    const values = make("table", "explain-values");
    values.append(line("th", ["percept", `${explanation.backend}, reference`, "difference, bound", ""]));
    for (const column of explanation.columns) {
      const shown = welcome.columns.find((c) => c.name === column.name);
      const unit = unitOf(shown, letter, quantity);
      const { value, reference } = column;
      if (!value && !reference && !column.recorded) continue;
      const apart = value && reference ? Math.hypot(...value.map((x, i) => x - (reference[i] ?? NaN))) : null;
      const by = scaleFor(unit, Math.max(...(value ?? reference ?? [0]).map(Math.abs)), quantity);
      const row = line("td", [
        `${column.name.replaceAll("_", " ")}${by.unit ? `, ${by.unit}` : ""}`,
        [digits(value, by.factor, 7), digits(reference, by.factor, 7)],
        [digits(apart, by.factor, 2), digits(column.bound, by.factor, 2)],
        column.verdict,
      ]);
      row.classList.add(`verdict-${column.verdict.replaceAll(" ", "-")}`);
      if (column.recorded) {
        row.classList.add("differs-from-recording");
        const other = `recorded: ${digits(column.recorded.value, by.factor, 7)}`;
        row.children[1].append(make("div", "recorded", other));
      }
      values.append(row);
    }
    const isPressure = sense === "pressure";
    const members = make("table", "explain-members");
    const what = sense === "proximity" ? "distance" : sense;
    members.append(line("th", ["taxel", "raw", "→", isPressure && quantity === "N" ? "force" : what]));
    const sorted = [...explanation.members].sort((a, b) => (b.pressure ?? -1) - (a.pressure ?? -1));
    const pressed = sorted.filter((member) => (member.pressure ?? 0) > 0).length;
    const shown = sorted.slice(0, Math.max(4, Math.min(pressed, 40)));
    for (const member of shown)
      members.append(
        line("td", [
          String(mesh.taxelId[member.taxel]),
          member.raw === null ? ABSENT : short(member.raw),
          "→",
          isPressure
            ? withUnit(member.pressure, "P", quantity)
            : (readingRows(this.model, member.taxel).at(-1)?.[1] ?? ABSENT),
        ]),
      );
    const rest = sorted.length - shown.length;
    this.result.replaceChildren(head, members);
    if (rest > 0)
      this.result.append(
        make("p", "note", `and ${rest} more taxels${isPressure ? ", pressed less or not at all" : ""}`),
      );
    this.result.append(values);
    this.button.scrollIntoView({ block: "start" });
  }
}

/**
 * @param {"td" | "th"} cell
 * @param {(string | string[])[]} texts several of them stand below each other
 */
function line(cell, texts) {
  const row = make("tr");
  for (const text of texts) {
    const box = make(cell);
    box.append(...(Array.isArray(text) ? text.map((one) => make("div", "", one)) : [text]));
    row.append(box);
  }
  return row;
}

/**
 * All components with so many significant digits.
 * @param {number[] | number | null} value
 * @param {number} factor
 * @param {number} count
 */
function digits(value, factor, count) {
  if (value === null) return ABSENT;
  const parts = (Array.isArray(value) ? value : [value]).map((x) => {
    const y = x * factor;
    if (Number.isInteger(y) && Math.abs(y) < 1e6) return String(y);
    return Math.abs(y) < 1e-3 ? y.toExponential(count - 1) : y.toPrecision(count);
  });
  return parts.join(", ");
}

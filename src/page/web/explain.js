/** The percept of the field that is shown: all its outputs, and on demand how they came about, beside the reference. */

import { byId, make, setText } from "./dom.js";
import { ABSENT, seconds, short, vectorWithUnit, withUnit } from "./format.js";
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
    /** @type {Map<string, {value: HTMLElement, plot: HTMLElement}>} */
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
        this.rows.set(column.name, { value, plot });
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
    for (const column of welcome.columns) {
      const row = this.rows.get(column.name);
      if (!row) continue;
      const value = model.value(field, column.name);
      const text = value
        ? vectorWithUnit(value, column.unit, model.quantity)
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
    const panel = byId("percept-panel", HTMLDetailsElement);
    panel.open = true;
    this.result.replaceChildren(make("p", "note", "Computing …"));
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
    const head = make(
      "p",
      "note",
      `Frame ${explanation.frame} at ${seconds(explanation.t_s)}, by ${explanation.backend}; the f64 reference starts from the same state.`,
    );
    const values = make("table", "explain-values");
    values.append(line("th", ["output", explanation.backend, "reference", "bound", ""]));
    for (const column of explanation.columns) {
      const unit = welcome.columns.find((c) => c.name === column.name)?.unit ?? "1";
      if (!column.value && !column.reference) continue;
      const difference =
        column.value && column.reference
          ? Math.hypot(...column.value.map((x, i) => x - (column.reference?.[i] ?? NaN)))
          : NaN;
      const row = line("td", [
        column.name.replaceAll("_", " "),
        vectorWithUnit(column.value, unit, quantity),
        vectorWithUnit(column.reference, unit, quantity),
        column.bound === null ? ABSENT : withUnit(column.bound, unit, quantity),
        column.verdict,
      ]);
      if (Number.isFinite(difference)) row.title = `They differ by ${difference.toExponential(2)} (SI).`;
      row.classList.add(`verdict-${column.verdict.replaceAll(" ", "-")}`);
      values.append(row);
    }
    const members = make("table", "explain-members");
    members.append(line("th", ["taxel", "raw", "→", quantity === "N" ? "force" : "pressure"]));
    const sorted = [...explanation.members].sort((a, b) => (b.pressure ?? -1) - (a.pressure ?? -1));
    const pressed = sorted.filter((member) => (member.pressure ?? 0) > 0).length;
    const shown = sorted.slice(0, Math.max(12, Math.min(pressed, 60)));
    for (const member of shown)
      members.append(
        line("td", [
          String(mesh.taxelId[member.taxel]),
          member.raw === null ? ABSENT : short(member.raw),
          "→",
          withUnit(member.pressure, "P", quantity),
        ]),
      );
    const rest = sorted.length - shown.length;
    this.result.replaceChildren(head, values, members);
    if (rest > 0)
      this.result.append(make("p", "note", `and ${rest} more taxels, not pressed or pressed less`));
  }
}

/**
 * @param {"td" | "th"} cell
 * @param {string[]} texts
 */
function line(cell, texts) {
  const row = make("tr");
  for (const text of texts) row.append(make(cell, "", text));
  return row;
}

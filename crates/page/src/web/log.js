/** The log of events, newest first. */

import { byId, make, setText } from "./dom.js";
import { seconds } from "./format.js";

const SHOWN_MAX = 200;

export class Log {
  /**
   * @param {import("./model.js").Model} model
   * @param {(field: number) => void} choose
   * @param {(t: number) => void} seek
   */
  constructor(model, choose, seek) {
    this.model = model;
    this.choose = choose;
    this.seek = seek;
    this.list = byId("events", HTMLElement);
    this.count = byId("event-count", HTMLElement);
    /** Rows by the sequence numbers of their events. @type {Map<number, HTMLElement>} */
    this.rows = new Map();
    model.on("events scene", () => this.update());
  }

  update() {
    const { events, eventsLost } = this.model;
    setText(
      this.count,
      eventsLost ? `${events.length}, ${eventsLost} older ones lost` : String(events.length),
    );
    const shown = events.slice(-SHOWN_MAX).reverse();
    const rows = shown.map((event) => this.rows.get(event.seq) ?? this.row(event));
    this.rows = new Map(shown.map((event, i) => [event.seq, rows[i]]));
    this.list.replaceChildren(...(rows.length ? rows : [make("p", "note", "Nothing has happened yet.")]));
  }

  /** @param {import("./wire.js").Event} event */
  row(event) {
    const row = make("div", `event ${event.kind}`);
    const field = event.field === null ? null : this.model.welcome?.fields[event.field];
    row.append(make("time", "", seconds(event.t_s)), make("span", "event-kind", event.kind));
    if (field) row.append(make("b", "", field.label));
    if (event.touch !== null) row.append(make("b", "", `#${event.touch}`));
    row.append(make("span", "event-text", event.text));
    row.addEventListener("click", () => {
      if (event.field !== null) this.choose(event.field);
      this.seek(event.t_s);
    });
    return row;
  }
}

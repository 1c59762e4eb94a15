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
    this.newest = 0;
    model.on("events scene", () => this.update());
  }

  update() {
    const { events, eventsLost, welcome } = this.model;
    if (!events.length) this.newest = 0;
    setText(
      this.count,
      eventsLost ? `${events.length}, ${eventsLost} older ones lost` : String(events.length),
    );
    const rows = [];
    for (const event of events) {
      if (event.seq <= this.newest) continue;
      const row = make("div", `event ${event.kind}`);
      const field = event.field === null ? null : welcome?.fields[event.field];
      row.append(make("time", "", seconds(event.t_s)), make("span", "event-kind", event.kind));
      if (field) row.append(make("b", "", field.label));
      if (event.touch !== null) row.append(make("b", "", `#${event.touch}`));
      row.append(make("span", "event-text", event.text));
      row.addEventListener("click", () => {
        if (event.field !== null) this.choose(event.field);
        this.seek(event.t_s);
      });
      rows.unshift(row);
      this.newest = event.seq;
    }
    if (!events.length) this.list.replaceChildren(make("p", "note", "Nothing has happened yet."));
    else if (this.list.firstElementChild?.tagName === "P") this.list.replaceChildren();
    this.list.prepend(...rows);
    while (this.list.childElementCount > SHOWN_MAX) this.list.lastElementChild?.remove();
  }
}

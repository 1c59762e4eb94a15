/** Where the robot touches itself: a list of the contacts between links. */

import { byId, make, setText } from "./dom.js";
import { withUnit } from "./format.js";

/** @typedef {import("./wire.js").Contact} Contact */

export class ContactsPanel {
  /**
   * @param {import("./model.js").Model} model
   * @param {(field: number) => void} choose
   */
  constructor(model, choose) {
    this.model = model;
    this.choose = choose;
    this.panel = byId("contacts-panel", HTMLElement);
    this.list = byId("contacts", HTMLElement);
    this.count = byId("contact-count", HTMLElement);
  }

  update() {
    const { welcome, contacts, inContact } = this.model;
    this.panel.hidden = !welcome?.contacts;
    if (this.panel.hidden) return;
    const unknown = !contacts.known && inContact.size > 0;
    setText(this.count, unknown ? "–" : String(contacts.list.length));
    const note = unknown
      ? "Where touches are in the world is not known: the frame has no pose."
      : "No two links touch at one place.";
    this.list.replaceChildren(
      ...(contacts.list.length
        ? contacts.list.map((contact) => this.row(contact))
        : [make("p", "note", note)]),
    );
  }

  /** @param {Contact} contact */
  row(contact) {
    const { model } = this;
    const row = make("div", "contact");
    row.append(make("i"));
    for (const { field, total } of contact.sides) {
      const button = make("button", "contact-side", model.welcome?.fields[field]?.label ?? "");
      button.title = "Choose this field";
      button.addEventListener("click", () => this.choose(field));
      row.append(button, make("span", "contact-total", withUnit(total, "P", model.quantity)));
    }
    const angle = Number.isNaN(contact.angle) ? "" : ` · ${Math.round((contact.angle * 180) / Math.PI)}°`;
    row.append(make("span", "contact-numbers", `${(contact.distance * 1e3).toFixed(1)} mm apart${angle}`));
    return row;
  }
}

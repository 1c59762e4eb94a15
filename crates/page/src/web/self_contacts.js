/** Where the robot touches itself: a list of the self-contacts. A click on a side chooses its touch. */

import { byId, make, setText } from "./dom.js";
import { withUnit } from "./format.js";

/** @typedef {import("./wire.js").SelfContact} SelfContact */

export class SelfContactsPanel {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./choices.js").Choices} choices
   */
  constructor(model, choices) {
    this.model = model;
    this.choices = choices;
    this.panel = byId("self-contacts-panel", HTMLElement);
    this.list = byId("self-contacts", HTMLElement);
    this.count = byId("self-contact-count", HTMLElement);
  }

  update() {
    const { welcome, selfContacts, inContact } = this.model;
    this.panel.hidden = !welcome?.self_contacts;
    if (this.panel.hidden) return;
    const unknown = !selfContacts.known && inContact.size > 0;
    setText(this.count, unknown ? "–" : String(selfContacts.list.length));
    const note = unknown
      ? "Where touches are in the world is not known: the frame has no pose."
      : "No two links touch at one place.";
    this.list.replaceChildren(
      ...(selfContacts.list.length
        ? selfContacts.list.map((contact) => this.row(contact))
        : [make("p", "note", note)]),
    );
  }

  /** @param {SelfContact} contact */
  row(contact) {
    const { model, choices } = this;
    const row = make("div", "contact");
    row.append(make("i"));
    for (const side of contact.sides) {
      const { link, touch } = side;
      const isListed = model.welcome?.touches;
      const name = make(isListed ? "button" : "span", "contact-side", model.welcome?.links[link]?.name ?? "");
      if (isListed) name.addEventListener("click", () => choices.chooseTouch(touch));
      row.append(name, make("span", "contact-load", sideLoadText(model, side)));
    }
    const angle = Math.round((contact.angle * 180) / Math.PI);
    row.append(
      make("span", "contact-numbers", `${(contact.distance * 1e3).toFixed(1)} mm apart · ${angle}°`),
    );
    return row;
  }
}

/**
 * How hard a side presses as text: the force of its touch where that is known, else the sum of pressures.
 * @param {import("./model.js").Model} model
 * @param {import("./wire.js").SelfContactSide} side
 */
export function sideLoadText(model, side) {
  const touch = model.touch(side.touch);
  return touch ? model.touchLoadText(touch) : withUnit(side.total, "P", model.quantity);
}

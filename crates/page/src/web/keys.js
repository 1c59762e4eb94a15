/** The keyboard does everything the pointer does. */

import { byId, make } from "./dom.js";

/** @typedef {{keys: string[], does: string, act: () => void, group: string}} Key */
/** What the pointer and fingers do. @typedef {{where: string, how: string, does: string}} Gesture */

export class Keys {
  /**
   * @param {Key[]} keys
   * @param {Gesture[]} gestures
   */
  constructor(keys, gestures) {
    this.keys = keys;
    this.gestures = gestures;
    this.dialog = byId("help", HTMLDialogElement);
    /** @type {Map<string, Key>} */
    const byKey = new Map(keys.flatMap((key) => key.keys.map((name) => [name, key])));
    document.addEventListener("keydown", (event) => {
      // On some keyboards brackets need AltGr, which looks like Ctrl and Alt.
      const isPlain = event.getModifierState("AltGraph") || !(event.ctrlKey || event.altKey);
      if (event.metaKey || !isPlain) return;
      const { target } = event;
      if (target instanceof HTMLInputElement && target.type !== "checkbox") return;
      if (target instanceof HTMLSelectElement && event.key !== "Escape") return;
      // Enter presses the button that has the focus. Space pauses wherever the focus was left by a click.
      if (target instanceof HTMLButtonElement && event.key === "Enter") return;
      if (target instanceof HTMLInputElement && event.key === " ") return;
      if (this.dialog.open && event.key !== "?") return;
      const shift = event.shiftKey && event.key.startsWith("Arrow") ? "Shift+" : "";
      const key = byKey.get(shift + event.key) ?? byKey.get(event.key.toLowerCase());
      if (!key) return;
      key.act();
      event.preventDefault();
    });
    // Firefox presses a button when the space bar comes up.
    document.addEventListener("keyup", (event) => {
      const isPressed =
        event.target instanceof HTMLButtonElement ||
        (event.target instanceof HTMLElement && event.target.tagName === "SUMMARY");
      if (event.key === " " && isPressed && !this.dialog.open) event.preventDefault();
    });
    this.build();
  }

  build() {
    const row = (/** @type {string[]} */ names, /** @type {string} */ does) => {
      const line = make("div", "key");
      const keys = make("span", "key-names");
      for (const name of names) keys.append(make("kbd", "", name));
      line.append(keys, make("span", "", does));
      return line;
    };
    const section = (/** @type {string} */ title, /** @type {HTMLElement[]} */ rows) => {
      const box = make("section");
      box.append(make("h3", "", title), ...rows);
      return box;
    };
    const groups = [...new Set(this.keys.map((key) => key.group))];
    byId("help-keys", HTMLElement).replaceChildren(
      ...groups.map((group) =>
        section(
          group,
          this.keys.filter((key) => key.group === group).map((key) => row(key.keys.map(label), key.does)),
        ),
      ),
    );
    const places = [...new Set(this.gestures.map((gesture) => gesture.where))];
    byId("help-gestures", HTMLElement).replaceChildren(
      ...places.map((where) =>
        section(
          where,
          this.gestures
            .filter((one) => one.where === where)
            .map(({ how, does }) => row(how.split("|"), does)),
        ),
      ),
    );
  }

  toggleHelp() {
    if (this.dialog.open) this.dialog.close();
    else this.dialog.showModal();
  }
}

/** @param {string} name */
function label(name) {
  const signs = /** @type {Record<string, string>} */ ({
    " ": "space",
    ArrowLeft: "←",
    ArrowRight: "→",
    ArrowUp: "↑",
    ArrowDown: "↓",
    Escape: "Esc",
  });
  const isCapital = name.length === 1 && name !== name.toLowerCase();
  const [plain, shifted] = [name.replace("Shift+", ""), isCapital || name.startsWith("Shift+")];
  const sign = signs[plain] ?? (plain.length === 1 ? plain.toUpperCase() : plain);
  return shifted ? `⇧ ${sign}` : sign;
}

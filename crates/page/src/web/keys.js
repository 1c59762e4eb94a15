/** The keyboard does everything the pointer does. */

import { byId, make } from "./dom.js";

/** @typedef {{keys: string[], does: string, act: () => void, group: string}} Key */

export class Keys {
  /** @param {Key[]} keys */
  constructor(keys) {
    this.keys = keys;
    this.dialog = byId("help", HTMLDialogElement);
    /** @type {Map<string, Key>} */
    const byKey = new Map(keys.flatMap((key) => key.keys.map((name) => [name, key])));
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const { target } = event;
      if (target instanceof HTMLInputElement && target.type !== "checkbox") return;
      if (target instanceof HTMLSelectElement && event.key !== "Escape") return;
      // Space and Enter press the button that has the focus.
      if (target instanceof HTMLButtonElement && (event.key === " " || event.key === "Enter")) return;
      if (target instanceof HTMLElement && target.tagName === "SUMMARY" && event.key === " ") return;
      if (this.dialog.open && event.key !== "?") return;
      const shift = event.shiftKey && event.key.startsWith("Arrow") ? "Shift+" : "";
      const key = byKey.get(shift + event.key) ?? byKey.get(event.key.toLowerCase());
      if (!key) return;
      key.act();
      event.preventDefault();
    });
    this.build();
  }

  build() {
    const list = byId("help-keys", HTMLElement);
    const groups = [...new Set(this.keys.map((key) => key.group))];
    list.replaceChildren(
      ...groups.map((group) => {
        const box = make("section");
        box.append(make("h3", "", group));
        for (const key of this.keys.filter((one) => one.group === group)) {
          const row = make("div", "key");
          const names = make("span", "key-names");
          for (const name of key.keys) names.append(make("kbd", "", label(name)));
          row.append(names, make("span", "", key.does));
          box.append(row);
        }
        return box;
      }),
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
  const [plain, shifted] = [name.replace("Shift+", ""), name.startsWith("Shift+")];
  const sign = signs[plain] ?? (plain.length === 1 ? plain.toUpperCase() : plain);
  return shifted ? `⇧ ${sign}` : sign;
}

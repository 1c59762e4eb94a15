/** The buttons over the picture: from where the body is seen, and what is shown of it. */

import { byId } from "./dom.js";

/**
 * @param {import("./choices.js").Choices} choices
 * @param {(name: string) => void} look from a side, or at `all`
 */
export function joinToolbar(choices, look) {
  for (const button of document.querySelectorAll("[data-view]"))
    button.addEventListener("click", () => button instanceof HTMLElement && look(button.dataset.view ?? ""));
  for (const button of document.querySelectorAll("[data-toggle]")) {
    if (!(button instanceof HTMLElement)) continue;
    const name = /** @type {"xray" | "tint" | "labels" | "ids"} */ (button.dataset.toggle);
    const show = () => button.setAttribute("aria-pressed", String(choices[name]));
    button.addEventListener("click", () => choices.toggle(name));
    choices.on("look", show);
    show();
  }
  const marksBox = byId("marks-choice", HTMLSelectElement);
  marksBox.addEventListener("change", () => {
    choices.marks = choices.offered[marksBox.selectedIndex];
    choices.tell("look");
  });
  choices.on("offered", () =>
    marksBox.replaceChildren(...choices.offered.map((name) => new Option(`Marks: ${name}`, name))),
  );
  choices.on("look offered", () => (marksBox.selectedIndex = choices.offered.indexOf(choices.marks)));
}

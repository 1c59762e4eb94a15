/** Boards with their health. */

import { byId, make, setText } from "./dom.js";
import { ABSENT, short } from "./format.js";
import { SPEAKING } from "./wire.js";

export class Boards {
  /** @param {import("./model.js").Model} model */
  constructor(model) {
    this.model = model;
    this.panel = byId("boards-panel", HTMLElement);
    this.list = byId("boards", HTMLElement);
    this.count = byId("board-count", HTMLElement);
    model.on("boards scene", () => this.update());
  }

  update() {
    const { boards } = this.model;
    this.panel.hidden = !boards.length;
    setText(this.count, countOf(boards));
    this.list.replaceChildren(
      ...boards.map((board) => {
        const row = make("div", `board ${board.state === SPEAKING ? "good" : "bad"}`);
        const numbers = [
          board.rate_hz === null ? ABSENT : `${short(board.rate_hz)} Hz`,
          `${board.frames} frames`,
          board.lost ? `${board.lost} lost` : "none lost",
        ];
        if (board.age_s !== null && board.age_s > 0.5) numbers.push(`${board.age_s.toFixed(1)} s old`);
        row.append(
          make("i"),
          make("span", "board-name", board.name),
          make("span", "board-state", board.state),
          make("span", "board-numbers", numbers.join(" · ")),
        );
        return row;
      }),
    );
  }
}

/**
 * How many boards speak.
 * @param {import("./wire.js").Board[]} boards
 */
export function countOf(boards) {
  const speaking = boards.filter((board) => board.state === SPEAKING).length;
  return speaking === boards.length
    ? `${speaking} ${SPEAKING}`
    : `${speaking} of ${boards.length} ${SPEAKING}`;
}

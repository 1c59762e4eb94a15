/** The pointer over the picture: orbit, pan, zoom, what a taxel is, choosing fields and percepts. */

import { byId, make } from "./dom.js";
import { ABSENT, short, withUnit } from "./format.js";
import { HEALTH, say } from "./wire.js";

/** A press that moves less is a click. */
const CLICK_PX = 4;

export class Inspector {
  /**
   * @param {HTMLElement} stage
   * @param {{model: import("./model.js").Model, camera: import("./camera.js").Camera,
   *   choices: import("./choices.js").Choices, connection: import("./socket.js").Connection,
   *   picker: import("./pick.js").Picker, marks: import("./percepts.js").Marks,
   *   onMove: () => void, onPercept: (field: number) => void, lookAt: (field: number) => void}} parts
   */
  constructor(stage, parts) {
    this.stage = stage;
    this.parts = parts;
    this.tip = byId("tip", HTMLElement);
    this.pointer = { x: 0, y: 0 };
    /** @type {{x: number, y: number, pan: boolean, moved: number} | null} */
    this.drag = null;
    this.asked = /** @type {number | null} */ (null);
    this.looking = false;
    stage.addEventListener("pointerdown", (event) => this.down(event));
    stage.addEventListener("pointermove", (event) => this.move(event));
    stage.addEventListener("pointerup", (event) => this.up(event));
    stage.addEventListener("pointercancel", () => (this.drag = null));
    stage.addEventListener("pointerleave", () => this.hover(null));
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    stage.addEventListener("dblclick", () => {
      const { chosen } = parts.choices;
      if (chosen !== null) parts.lookAt(chosen);
    });
    stage.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        parts.camera.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
        parts.onMove();
      },
      { passive: false },
    );
    parts.choices.on("hover", () => this.show());
    parts.model.on("taxel", () => this.show());
  }

  /** @param {PointerEvent} event */
  down(event) {
    this.stage.setPointerCapture(event.pointerId);
    this.stage.focus();
    const pan = event.button !== 0 || event.shiftKey;
    this.drag = { x: event.clientX, y: event.clientY, pan, moved: 0 };
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { camera, onMove } = this.parts;
    this.pointer = { x: event.offsetX, y: event.offsetY };
    const { drag } = this;
    if (!drag) {
      this.look();
      return;
    }
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    [drag.x, drag.y] = [event.clientX, event.clientY];
    drag.moved += Math.abs(dx) + Math.abs(dy);
    if (drag.moved < CLICK_PX) return;
    this.hover(null);
    if (drag.pan) camera.pan(dx, dy);
    else camera.orbit(-dx * 0.008, dy * 0.008);
    onMove();
  }

  /** @param {PointerEvent} event */
  up(event) {
    const click = this.drag && this.drag.moved < CLICK_PX && event.button === 0;
    this.drag = null;
    if (click) this.click(event.offsetX, event.offsetY);
  }

  /** Looks what is under the pointer, once a drawing at most. */
  look() {
    if (this.looking) return;
    this.looking = true;
    requestAnimationFrame(() => {
      this.looking = false;
      const { picker, choices } = this.parts;
      if (!this.drag) this.hover(picker.taxelAt(this.pointer.x, this.pointer.y, choices.xray));
    });
  }

  /** @param {number | null} taxel */
  hover(taxel) {
    const { choices } = this.parts;
    if (taxel === choices.hoveredTaxel) {
      if (taxel !== null) this.place();
      return;
    }
    choices.hoveredTaxel = taxel;
    choices.tell("hover");
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  click(x, y) {
    const { marks, choices, picker, model, onPercept } = this.parts;
    const mark = marks.places.find((place) => Math.hypot(place.x - x, place.y - y) < 12);
    if (mark?.touch !== undefined) {
      choices.chooseTouch(mark.touch);
      return;
    }
    if (mark?.field !== undefined) {
      choices.choose(mark.field);
      onPercept(mark.field);
      return;
    }
    const taxel = picker.taxelAt(x, y, choices.xray);
    if (taxel === null) {
      choices.choose(null);
      return;
    }
    const around = fieldsOf(model, taxel, choices.letter);
    const at = choices.chosen === null ? -1 : around.indexOf(choices.chosen);
    choices.choose(around.length ? around[(at + 1) % around.length] : null);
  }

  /** Shows what is hovered, and asks for its raw value. */
  show() {
    const { choices, connection, model } = this.parts;
    const taxel = choices.hoveredTaxel;
    if (taxel !== this.asked) {
      this.asked = taxel;
      connection.send(say.taxel(taxel));
    }
    const { welcome, mesh } = model;
    this.tip.hidden = taxel === null || !welcome || !mesh;
    if (taxel === null || !welcome || !mesh) return;
    const value = model.taxelValue?.taxel === taxel ? model.taxelValue : null;
    const touch = model.touchOf(taxel);
    const channel = welcome.channels?.[taxel];
    const link = welcome.links[mesh.taxelLink[taxel]]?.name ?? "world";
    const area = mesh.taxelArea[taxel];
    const rows = [
      ["link", link],
      ["channel", channel ? `${channel[0]}, ${channel[1]}` : ABSENT],
      [
        "size",
        area > 0 ? withUnit(area, "m²", "") : `${withUnit(2 * mesh.taxelRadius[taxel], "m", "")} ⌀ (default)`,
      ],
      [
        "fields",
        fieldsOf(model, taxel, choices.letter)
          .map((f) => welcome.fields[f].label)
          .join(", ") || ABSENT,
      ],
      ...(welcome.touches ? [["touch", touch ? `#${touch.id}` : ABSENT]] : []),
      ["raw", value && value.raw !== null ? short(value.raw) : ABSENT],
      [welcome.quantity === "N" ? "force" : "pressure", withUnit(model.pressure[taxel], "P", model.quantity)],
      ["state", value?.health ?? HEALTH[model.health[taxel]]],
    ];
    this.tip.replaceChildren(make("b", "", `Taxel ${mesh.taxelId[taxel]}`), table(rows));
    this.place();
  }

  /** Puts the tip beside the pointer, within the picture. */
  place() {
    const { tip, stage } = this;
    if (tip.hidden) return;
    const [w, h] = [tip.offsetWidth, tip.offsetHeight];
    const inside = stage.matches(":hover");
    const x = inside ? this.pointer.x : stage.clientWidth - w - 20;
    const y = inside ? this.pointer.y : 60;
    const left = x + 18 + w > stage.clientWidth ? x - 18 - w : x + 18;
    tip.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, Math.min(stage.clientHeight - h - 4, y - 20))}px)`;
  }
}

/**
 * The fields that hold a taxel, smallest first.
 * @param {import("./model.js").Model} model
 * @param {number} taxel
 * @param {string | null} letter
 */
function fieldsOf(model, taxel, letter) {
  const fields = model.welcome?.fields ?? [];
  return fields
    .map((_, i) => i)
    .filter((i) => fields[i].letter === letter && fields[i].members.includes(taxel))
    .sort((a, b) => fields[a].members.length - fields[b].members.length);
}

/**
 * A list of names and values.
 * @param {string[][]} rows
 */
export function table(rows) {
  const list = make("dl");
  for (const [name, value] of rows) list.append(make("dt", "", name), make("dd", "", value));
  return list;
}

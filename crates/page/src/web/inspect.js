/** The pointer over the picture: orbit, pan, zoom, what a taxel is, choosing fields and percepts. */

import { byId, make } from "./dom.js";
import { ABSENT, short, withUnit } from "./format.js";
import { HEALTH, say } from "./wire.js";

/** A press that moves less is a click, by a finger a tap. */
const CLICK_PX = 4;
const TAP_PX = 12;

export class Inspector {
  /**
   * @param {HTMLElement} stage
   * @param {{model: import("./model.js").Model, camera: import("./camera.js").Camera,
   *   choices: import("./choices.js").Choices, connection: import("./socket.js").Connection,
   *   picker: import("./pick.js").Picker, marks: import("./percepts.js").Marks,
   *   measure: import("./measure.js").Measure,
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
    /** Fingers on the picture, by their ids. @type {Map<number, {x: number, y: number}>} */
    this.fingers = new Map();
    /** Whether what is described was tapped by a finger. */
    this.tapped = false;
    stage.addEventListener("pointerdown", (event) => this.down(event));
    stage.addEventListener("pointermove", (event) => this.move(event));
    stage.addEventListener("pointerup", (event) => this.up(event));
    stage.addEventListener("pointercancel", (event) => {
      this.fingers.delete(event.pointerId);
      this.drag = null;
    });
    // A finger always leaves: what it tapped stays described.
    stage.addEventListener("pointerleave", (event) => event.pointerType !== "touch" && this.hover(null));
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
    if (event.pointerType === "touch")
      this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const pan = event.button !== 0 || event.shiftKey;
    this.drag = { x: event.clientX, y: event.clientY, pan, moved: 0 };
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { camera, onMove } = this.parts;
    this.pointer = { x: event.offsetX, y: event.offsetY };
    if (this.pinch(event)) return;
    const { drag } = this;
    if (!drag) {
      if (event.pointerType !== "touch") this.look();
      return;
    }
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    [drag.x, drag.y] = [event.clientX, event.clientY];
    drag.moved += Math.abs(dx) + Math.abs(dy);
    if (drag.moved < (event.pointerType === "touch" ? TAP_PX : CLICK_PX)) return;
    this.hover(null);
    if (drag.pan) camera.pan(dx, dy);
    else camera.orbit(-dx * 0.008, dy * 0.008);
    onMove();
  }

  /** @param {PointerEvent} event */
  up(event) {
    const byFinger = event.pointerType === "touch";
    const slack = byFinger ? TAP_PX : CLICK_PX;
    const click = this.drag && this.drag.moved < slack && event.button === 0;
    this.fingers.delete(event.pointerId);
    this.drag = null;
    this.tapped = byFinger;
    if (!click) return;
    const [x, y] = [event.offsetX, event.offsetY];
    this.click(x, y);
    if (byFinger) {
      this.pointer = { x, y };
      this.hover(this.parts.picker.taxelAt(x, y, this.parts.choices.xray));
    }
  }

  /**
   * Two fingers: the picture follows the point between them, and comes nearer as they part.
   * @param {PointerEvent} event
   */
  pinch(event) {
    const finger = this.fingers.get(event.pointerId);
    if (!finger || this.fingers.size !== 2) return false;
    const other = [...this.fingers].find(([id]) => id !== event.pointerId)?.[1] ?? finger;
    const before = { ...finger };
    [finger.x, finger.y] = [event.clientX, event.clientY];
    const [apart, apartNow] = [before, finger].map((f) =>
      Math.max(1, Math.hypot(f.x - other.x, f.y - other.y)),
    );
    const { camera, onMove } = this.parts;
    const box = this.stage.getBoundingClientRect();
    camera.pan((finger.x - before.x) / 2, (finger.y - before.y) / 2);
    const middle = [(finger.x + other.x) / 2 - box.left, (finger.y + other.y) / 2 - box.top];
    camera.zoom(apartNow / apart, middle[0], middle[1]);
    // What is left of it when one finger goes is neither a click nor a turn.
    this.drag = null;
    this.hover(null);
    onMove();
    return true;
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
    const { marks, measure, choices, picker, model, onPercept } = this.parts;
    if (measure.isOn) {
      measure.click(x, y, choices.xray);
      return;
    }
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
      ...readingRows(model, taxel),
      ...(model.peaks ? [["highest", withUnit(model.peaks.peaks[taxel], "P", model.quantity)]] : []),
      ["state", value?.health ?? HEALTH[(model.senses?.health ?? model.health)[taxel]]],
    ];
    this.tip.replaceChildren(make("b", "", `Taxel ${mesh.taxelId[taxel]}`), table(rows));
    this.place();
  }

  /** Puts the tip beside the pointer, within the picture. */
  place() {
    const { tip, stage } = this;
    if (tip.hidden) return;
    const [w, h] = [tip.offsetWidth, tip.offsetHeight];
    const inside = stage.matches(":hover") || this.tapped;
    const x = inside ? this.pointer.x : stage.clientWidth - w - 20;
    const y = inside ? this.pointer.y : 60;
    const left = x + 18 + w > stage.clientWidth ? x - 18 - w : x + 18;
    tip.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, Math.min(stage.clientHeight - h - 4, y - 20))}px)`;
  }
}

/**
 * What a taxel reads.
 * @param {import("./model.js").Model} model
 * @param {number} taxel
 */
export function readingRows({ senses, pressure, quantity }, taxel) {
  const value = (senses?.values ?? pressure)[taxel];
  const sense = senses?.of[taxel] ?? "pressure";
  if (sense === "temperature") return [[sense, withUnit(value, "°C", "")]];
  if (sense === "proximity") return [["distance", withUnit(value, "m", "")]];
  const shear = senses?.shearOf(taxel);
  return [
    [quantity === "N" ? "force" : "pressure", withUnit(value, "P", quantity)],
    ...(senses?.pulled.has(taxel)
      ? [["shear", shear ? withUnit(Math.hypot(...shear), "P", quantity) : ABSENT]]
      : []),
  ];
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

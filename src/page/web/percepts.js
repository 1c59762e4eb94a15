/** Marks of percepts over the picture: place, identity, load, orientation, axis, motion, self-contacts. */

import { cssColour, fitCanvas, paletteColour } from "./dom.js";
import { withUnit } from "./format.js";
import { dot, subtract, toWorld } from "./math.js";
import {
  axisEllipse,
  motionArrow,
  onPlane,
  orientationLine,
  positionInWorld,
  tangentPlane,
} from "./places.js";
import { NO_LINK } from "./wire.js";

/** @typedef {{x: number, y: number}} Point */

const LABELS_MAX = 6;

/** Keeps the colour of a touch from onset to release. */
export class IdentityColours {
  constructor() {
    /** @type {Map<string, number>} */
    this.colours = new Map();
  }

  /** @param {import("./wire.js").Touch[]} touches */
  update(touches) {
    const present = new Set(touches.map((touch) => `${touch.field}:${touch.identity}`));
    for (const key of this.colours.keys()) if (!present.has(key)) this.colours.delete(key);
    for (const key of present) {
      if (this.colours.has(key)) continue;
      const used = new Set(this.colours.values());
      let free = 0;
      while (used.has(free)) free++;
      this.colours.set(key, free);
    }
  }

  /** @param {import("./wire.js").Touch} touch */
  of(touch) {
    return paletteColour(this.colours.get(`${touch.field}:${touch.identity}`) ?? 0);
  }
}

export class Marks {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   * @param {import("./choices.js").Choices} choices
   */
  constructor(canvas, model, camera, choices) {
    this.canvas = canvas;
    this.model = model;
    this.camera = camera;
    this.choices = choices;
    this.colours = new IdentityColours();
    /** Where marks are, to be clicked. @type {{x: number, y: number, field: number}[]} */
    this.places = [];
    this.drawn = "";
  }

  draw() {
    const { model, camera, choices } = this;
    const marked = choices.marked(model);
    const selfContacts = choices.marks === "none" ? [] : model.selfContacts.list;
    this.places = [];
    if (!marked.length && !selfContacts.length && !this.drawn) return;
    this.drawn = marked.join() || (selfContacts.length ? "selfContacts" : "");
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    const { context } = fitted;
    context.lineCap = context.lineJoin = "round";
    this.halo = cssColour("halo");
    const touches = model.touches.filter((touch) => marked.includes(touch.field));
    this.colours.update(touches);
    /** @type {{at: Point, text: string, colour: string, load: number}[]} */
    const labels = [];
    for (const field of marked) {
      const plane = tangentPlane(model, field);
      if (!plane) continue;
      const own = touches.filter((touch) => touch.field === field);
      const colour = own.length ? this.colours.of(own[0]) : paletteColour(field);
      const facing = !plane.normal || dot(plane.normal, subtract(camera.eye, plane.point)) > 0;
      // What lies behind the body is a faint ring only.
      context.globalAlpha = facing ? 1 : 0.3;
      if (facing) this.shapes(context, field, plane, colour);
      const places = own.length
        ? own.map((touch) => ({
            at: camera.project(positionInWorld(model, field, touch.position)),
            colour: this.colours.of(touch),
            load: touch.total,
            text: `#${touch.identity}  ${withUnit(touch.total, "P", model.quantity)}`,
          }))
        : [
            {
              at: camera.project(plane.point),
              colour,
              load: model.load(field),
              text: model.loadText(field),
            },
          ];
      for (const { at, colour: fill, text, load } of places) {
        this.ring(context, at, fill, field === choices.field);
        this.places.push({ x: at.x, y: at.y, field });
        if (choices.labels && facing) labels.push({ at, text, colour: fill, load });
      }
    }
    context.globalAlpha = 1;
    for (const contact of selfContacts) this.contact(context, contact);
    // The strongest touches only, from the lowest place up, so that labels stand above what they name.
    labels.sort((a, b) => b.load - a.load).splice(LABELS_MAX);
    labels.sort((a, b) => b.at.y - a.at.y);
    /** @type {Point[]} */
    const taken = [];
    for (const { at, text, colour } of labels) this.label(context, at, text, colour, taken);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} field
   * @param {NonNullable<ReturnType<typeof tangentPlane>>} plane
   * @param {string} colour
   */
  shapes(context, field, plane, colour) {
    const { model, camera } = this;
    if (!plane.u) return;
    const at = (/** @type {number} */ du, /** @type {number} */ dv) => camera.project(onPlane(plane, du, dv));
    const ellipse = axisEllipse(model, field);
    if (ellipse) {
      const [c, s] = [Math.cos(ellipse.angle), Math.sin(ellipse.angle)];
      const point = (/** @type {number} */ x, /** @type {number} */ y) => at(x * c - y * s, x * s + y * c);
      const round = Array.from({ length: 49 }, (_, i) =>
        point(ellipse.a * Math.cos((i * Math.PI) / 24), ellipse.b * Math.sin((i * Math.PI) / 24)),
      );
      this.line(context, round, colour, 1.5, []);
      this.line(context, [point(-ellipse.a, 0), point(ellipse.a, 0)], colour, 1.25, [4, 4]);
    }
    const line = orientationLine(model, field);
    const centroid = model.value(field, "centroid");
    if (line && centroid) {
      const ends = line.map(([u, v]) => at(u - centroid[0], v - centroid[1]));
      this.line(context, ends, colour, 2.75, []);
      for (const end of ends) this.dot(context, end, 3.2, colour);
    }
    const arrow = motionArrow(model, field);
    if (arrow) this.arrow(context, at(0, 0), at(arrow[0], arrow[1]), colour);
  }

  /**
   * A diamond where two links touch, seen through the body: a contact lies between them.
   * @param {CanvasRenderingContext2D} context
   * @param {import("./wire.js").SelfContact} contact
   */
  contact(context, contact) {
    const { x, y } = this.camera.project(toWorld(this.model.rows, NO_LINK, contact.position, 1));
    const corner = (/** @type {number} */ dx, /** @type {number} */ dy) => ({
      x: x + 12 * dx,
      y: y + 12 * dy,
    });
    const corners = [corner(0, -1), corner(1, 0), corner(0, 1), corner(-1, 0), corner(0, -1)];
    this.line(context, corners, cssColour("meeting"), 2.5, []);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Point[]} points
   * @param {string} colour
   * @param {number} width
   * @param {number[]} dash
   */
  line(context, points, colour, width, dash) {
    context.beginPath();
    points.forEach(({ x, y }, i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.setLineDash(dash);
    context.strokeStyle = this.halo ?? "";
    context.lineWidth = width + 1.6;
    context.stroke();
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
    context.setLineDash([]);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Point} at
   * @param {number} radius
   * @param {string} colour
   */
  dot(context, at, radius, colour) {
    context.beginPath();
    context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 1;
    context.strokeStyle = this.halo ?? "";
    context.stroke();
  }

  /**
   * A ring with a free middle, so that it never hides the colour of a taxel at its centre.
   * @param {CanvasRenderingContext2D} context
   * @param {Point} at
   * @param {string} colour
   * @param {boolean} chosen
   */
  ring(context, at, colour, chosen) {
    for (const [width, style] of /** @type {[number, string][]} */ ([
      [4.4, this.halo ?? ""],
      [chosen ? 3 : 2.25, colour],
    ])) {
      context.beginPath();
      context.arc(at.x, at.y, 7, 0, 2 * Math.PI);
      context.lineWidth = width;
      context.strokeStyle = style;
      context.stroke();
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Point} from
   * @param {Point} to
   * @param {string} colour
   */
  arrow(context, from, to, colour) {
    const [dx, dy] = [to.x - from.x, to.y - from.y];
    const size = Math.hypot(dx, dy);
    if (size < 5) return;
    const [ux, uy] = [dx / size, dy / size];
    const start = { x: from.x + 9 * ux, y: from.y + 9 * uy };
    const end = { x: to.x + 9 * ux, y: to.y + 9 * uy };
    const head = Math.min(9, 4 + size * 0.2);
    const wing = (/** @type {number} */ side) => ({
      x: end.x - head * ux - side * head * 0.6 * uy,
      y: end.y - head * uy + side * head * 0.6 * ux,
    });
    this.line(context, [start, end], colour, 2, []);
    this.line(context, [wing(1), end, wing(-1)], colour, 2, []);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Point} at
   * @param {string} text
   * @param {string} colour
   * @param {Point[]} taken places of labels that have been drawn
   */
  label(context, at, text, colour, taken) {
    const place = { x: at.x + 22, y: at.y - 24 };
    while (taken.some((other) => Math.abs(other.x - place.x) < 120 && Math.abs(other.y - place.y) < 21))
      place.y -= 22;
    taken.push(place);
    this.line(
      context,
      [
        { x: at.x + 5, y: at.y - 5 },
        { x: place.x + 8, y: place.y },
      ],
      colour,
      1,
      [],
    );
    context.font = "600 11.5px system-ui, sans-serif";
    const width = context.measureText(text).width + 24;
    context.beginPath();
    context.roundRect(place.x, place.y - 10, width, 20, 10);
    context.fillStyle = cssColour("label");
    context.fill();
    context.beginPath();
    context.arc(place.x + 10, place.y, 3.6, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
    context.fillStyle = cssColour("text");
    context.textBaseline = "middle";
    context.fillText(text, place.x + 18, place.y + 0.5);
  }
}

/** Marks over the picture: of touches their place, id, load, normal, axis, motion and trail; of fields; of self-contacts. */

import { drawArrows, hasArrows } from "./arrows.js";
import { cssColour, fitCanvas, paletteColour } from "./dom.js";
import { add, dot, scale, subtract, toWorld } from "./math.js";
import { axisEllipse, motionArrow, onPlane, orientationLine, tangentPlane, touchInWorld } from "./places.js";
import { NO_LINK } from "./wire.js";

/** @typedef {{x: number, y: number}} Point */
/** @typedef {{at: Point, text: string, colour: string, load: number}} Label */

const LABELS_MAX = 6;
/** Length of the line along a touch's normal, pixels. */
const NORMAL_PX = 26;
/** A trail goes back so long, s, and its oldest part is so opaque. */
const TRAIL_S = 1;
const OLDEST_OPACITY = 0.1;

export class Marks {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("./model.js").Model} model
   * @param {import("./camera.js").Camera} camera
   * @param {import("./choices.js").Choices} choices
   * @param {import("./taxel_ids.js").TaxelIds} ids
   * @param {import("./measure.js").Measure} measure
   */
  constructor(canvas, model, camera, choices, ids, measure) {
    this.canvas = canvas;
    this.model = model;
    this.camera = camera;
    this.choices = choices;
    this.ids = ids;
    this.measure = measure;
    /** Where marks are, to be clicked. @type {{x: number, y: number, field?: number, touch?: number}[]} */
    this.places = [];
    this.drawn = false;
  }

  draw() {
    const { model, camera, choices } = this;
    const marked = choices.marked(model);
    const touches = choices.showsTouches(model) ? model.touches : [];
    const selfContacts = choices.marks === "none" ? [] : model.selfContacts.list;
    this.places = [];
    const { length: measured } = this.measure.places;
    const drawn =
      choices.ids || hasArrows(model) || marked.length + touches.length + selfContacts.length + measured > 0;
    if (!drawn && !this.drawn) return;
    this.drawn = drawn;
    const fitted = fitCanvas(this.canvas);
    if (!fitted) return;
    const { context } = fitted;
    context.lineCap = context.lineJoin = "round";
    this.halo = cssColour("halo");
    /** @type {Label[]} */
    const labels = [];
    if (choices.ids) this.ids.draw(context, () => this.draw());
    if (choices.taxels) drawArrows(context, model, camera);
    for (const touch of touches) this.touch(context, touch, labels);
    for (const field of marked) {
      const plane = tangentPlane(model, field);
      if (!plane) continue;
      const colour = paletteColour(model.fieldColour(field));
      const facing = !plane.normal || dot(plane.normal, subtract(camera.eye, plane.point)) > 0;
      // What lies behind the body is a faint ring only.
      context.globalAlpha = facing ? 1 : 0.3;
      if (facing) this.shapes(context, field, plane, colour);
      const at = camera.project(plane.point);
      this.ring(context, at, colour, field === choices.field);
      this.places.push({ x: at.x, y: at.y, field });
      if (choices.labels && facing)
        labels.push({ at, text: model.loadText(field), colour, load: model.load(field) });
    }
    context.globalAlpha = 1;
    for (const contact of selfContacts) this.contact(context, contact);
    // The strongest touches only, from the lowest place up, so that labels stand above what they name.
    labels.sort((a, b) => b.load - a.load).splice(LABELS_MAX);
    labels.sort((a, b) => b.at.y - a.at.y);
    /** @type {Point[]} */
    const taken = [];
    for (const { at, text, colour } of labels) this.label(context, at, text, colour, taken);
    this.measure.draw(context, this);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("./wire.js").Touch} touch
   * @param {Label[]} labels
   */
  touch(context, touch, labels) {
    const { model, camera, choices } = this;
    const colour = paletteColour(model.touchColour(touch.id));
    const { point, normal, halfAxes, motion, trail } = touchInWorld(model, touch);
    const at = camera.project(point);
    if (at.depth <= 0) return;
    const facing = dot(normal, subtract(camera.eye, point)) > 0;
    if (facing) {
      this.trail(context, trail, colour);
      if (halfAxes) {
        const [along, across] = halfAxes;
        const round = Array.from({ length: 49 }, (_, i) => {
          const [c, s] = [Math.cos((i * Math.PI) / 24), Math.sin((i * Math.PI) / 24)];
          return camera.project(add(point, add(scale(along, c), scale(across, s))));
        });
        this.line(context, round, colour, 1.5, []);
        this.line(context, [round[24], round[0]], colour, 2.25, []);
      }
      const end = camera.project(add(point, scale(normal, NORMAL_PX / camera.pixelsPerMetre(at.depth))));
      this.line(context, [at, end], colour, 1.5, []);
      this.dot(context, end, 2.4, colour);
      if (motion) this.arrow(context, at, camera.project(add(point, motion)), colour);
    }
    // What lies behind the body is a faint ring only.
    context.globalAlpha = facing ? 1 : 0.3;
    this.ring(context, at, colour, touch.id === choices.touch);
    context.globalAlpha = 1;
    this.places.push({ x: at.x, y: at.y, touch: touch.id });
    if (choices.labels && facing)
      labels.push({ at, text: `#${touch.id}  ${model.touchLoadText(touch)}`, colour, load: touch.total });
  }

  /**
   * Where a touch was, fading towards its beginning.
   * @param {CanvasRenderingContext2D} context
   * @param {{ago: number, point: import("./math.js").Vec3}[]} points the oldest first
   * @param {string} colour
   */
  trail(context, points, colour) {
    const places = points.map(({ point }) => this.camera.project(point));
    context.strokeStyle = colour;
    context.lineWidth = 3.5;
    // Round ends would lie over each other.
    context.lineCap = "butt";
    for (let i = 1; i < places.length; i++) {
      const fresh = 1 - Math.min(1, points[i].ago / TRAIL_S);
      context.globalAlpha = OLDEST_OPACITY + (1 - OLDEST_OPACITY) * fresh;
      context.beginPath();
      context.moveTo(places[i - 1].x, places[i - 1].y);
      context.lineTo(places[i].x, places[i].y);
      context.stroke();
    }
    context.lineCap = "round";
    context.globalAlpha = 1;
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

/** Arrows of tangential forces on taxels with three axes. */

import { cssColour } from "./dom.js";
import { add, dot, scale, subtract, toWorld } from "./math.js";
import { taxelInWorld } from "./places.js";

/** An arrow of the highest pressure of the scale is so many discs' widths long. */
export const WIDTHS_AT_MOST = 3;
/** Shorter arrows are not drawn, pixels. */
const SHORTEST_PX = 2.5;

/**
 * The ends of a taxel's arrow in the world; null where there is none.
 * @param {import("./model.js").Model} model
 * @param {number} taxel
 * @returns {{from: import("./math.js").Vec3, to: import("./math.js").Vec3, normal: import("./math.js").Vec3} | null}
 */
export function arrowOf(model, taxel) {
  const { senses, mesh, rows } = model;
  const shear = senses?.shearOf(taxel);
  const place = taxelInWorld(model, taxel);
  if (!senses || !mesh || !shear || !place) return null;
  const metres = (2 * place.radius * WIDTHS_AT_MOST) / model.scaleMax;
  const [one, two] = senses
    .tangentsOf(taxel)
    .map((tangent, axis) => scale(toWorld(rows, mesh.taxelLink[taxel], tangent, 0), metres * shear[axis]));
  return { from: place.point, to: add(place.point, add(one, two)), normal: place.normal };
}

/**
 * Whether arrows are shown: of a moment, in letters of pressure and shear.
 * @param {import("./model.js").Model} model
 */
export function hasArrows({ senses, sense, peaks }) {
  return !!senses?.pulled.size && (sense === "pressure" || sense === "shear") && !peaks;
}

/**
 * Draws the arrows of the taxels that look at the eye.
 * @param {CanvasRenderingContext2D} context
 * @param {import("./model.js").Model} model
 * @param {import("./camera.js").Camera} camera
 */
export function drawArrows(context, model, camera) {
  if (!hasArrows(model)) return;
  context.lineCap = context.lineJoin = "round";
  const strokes = new Path2D();
  for (const taxel of model.senses?.pulled.keys() ?? []) {
    const arrow = arrowOf(model, taxel);
    if (!arrow || dot(arrow.normal, subtract(camera.eye, arrow.from)) <= 0) continue;
    const [from, to] = [camera.project(arrow.from), camera.project(arrow.to)];
    const [dx, dy] = [to.x - from.x, to.y - from.y];
    const size = Math.hypot(dx, dy);
    if (from.depth <= 0 || to.depth <= 0 || size < SHORTEST_PX) continue;
    const head = Math.min(6, 0.4 * size);
    const [ux, uy] = [(head * dx) / size, (head * dy) / size];
    strokes.moveTo(from.x, from.y);
    strokes.lineTo(to.x, to.y);
    strokes.moveTo(to.x - ux - 0.6 * uy, to.y - uy + 0.6 * ux);
    strokes.lineTo(to.x, to.y);
    strokes.lineTo(to.x - ux + 0.6 * uy, to.y - uy - 0.6 * ux);
  }
  for (const [width, colour] of /** @type {[number, string][]} */ ([
    [3.6, cssColour("arrow-halo")],
    [1.6, cssColour("arrow")],
  ])) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.stroke(strokes);
  }
}

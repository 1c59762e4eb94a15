/** Where percepts and taxels are, in the world and in charts. */

import { add, cross, dot, scale, subtract, toWorld, unit } from "./math.js";
import { NO_LINK } from "./wire.js";

/** @typedef {import("./model.js").Model} Model */
/** @typedef {import("./math.js").Vec3} Vec3 */

/** The motion arrow ends where the touch would be after so long. */
const ARROW_S = 0.2;
/** An ellipse has half axes of so many standard deviations: about the edge of what presses evenly. */
const ELLIPSE_SIGMAS = 2;

/**
 * What marks a touch, in the world: its best known place and normal, the half axes of its ellipse, its motion in `ARROW_S`, and the
 * trail of its position.
 * @param {Model} model
 * @param {import("./wire.js").Touch} touch
 */
export function touchInWorld(model, touch) {
  const { rows } = model;
  const turned = (/** @type {number[]} */ direction) =>
    direction.some(Number.isNaN) ? null : toWorld(rows, touch.frame, direction, 0);
  const position = toWorld(rows, touch.frame, touch.position, 1);
  const point = touch.place.some(Number.isNaN) ? position : toWorld(rows, touch.frame, touch.place, 1);
  const normal = toWorld(rows, touch.frame, touch.normal, 0);
  const axis = turned(touch.axis);
  const [along, across] = touch.spread.map((sigma) => ELLIPSE_SIGMAS * sigma);
  const velocity = turned(touch.velocity);
  return {
    point,
    normal,
    halfAxes:
      axis && !Number.isNaN(along)
        ? [scale(axis, along), scale(unit(cross(normal, axis)), Math.max(across, 0.05 * along))]
        : null,
    motion: velocity && scale(velocity, ARROW_S),
    trail: [
      ...touch.trail.map(({ ago, frame, position }) => ({ ago, point: toWorld(rows, frame, position, 1) })),
      { ago: 0, point: position },
    ],
  };
}

/**
 * Where a percept's position is in the world.
 * @param {Model} model
 * @param {number} field
 * @param {ArrayLike<number>} position
 */
export function positionInWorld(model, field, position) {
  const link = model.isInWorld(field) ? NO_LINK : (model.welcome?.fields[field].link ?? NO_LINK);
  return toWorld(model.rows, link, position, 1);
}

/**
 * The plane that touches the body at a percept: its point, normal, and the chart's u and v laid into it.
 * @param {Model} model
 * @param {number} field
 */
export function tangentPlane(model, field) {
  const position = model.value(field, "position");
  const about = model.welcome?.fields[field];
  if (!position || !about) return null;
  const point = positionInWorld(model, field, position);
  const inWorld = model.isInWorld(field);
  const measured = model.value(field, "normal");
  const { chart } = about;
  const normal = measured
    ? toWorld(model.rows, inWorld ? NO_LINK : about.link, measured, 0)
    : chart && toWorld(model.rows, about.link, chart.normal, 0);
  if (!chart || !normal) return { point, normal: normal && unit(normal), u: null, v: null };
  const along = toWorld(model.rows, about.link, chart.u, 0);
  const u = unit(subtract(along, scale(normal, dot(along, normal))));
  return { point, normal: unit(normal), u, v: cross(unit(normal), u) };
}

/**
 * @param {Model} model
 * @param {number} taxel
 */
export function taxelInWorld(model, taxel) {
  const { mesh } = model;
  if (!mesh) return null;
  const link = mesh.taxelLink[taxel];
  return {
    point: toWorld(model.rows, link, mesh.taxelPosition, 1, 3 * taxel),
    normal: toWorld(model.rows, link, mesh.taxelNormal, 0, 3 * taxel),
    radius: mesh.taxelRadius[taxel],
  };
}

/**
 * The ends of a field's orientation line in its chart. The engine says the angle. Each pressed taxel puts a point on the way from
 * the centroid to itself, as far out as it is pressed: c + w P / P_max (x − c). The two farthest points are the ends where they
 * agree with the angle. Else the line runs through the centroid over the pressed taxels.
 * @param {Model} model
 * @param {number} f
 * @returns {[number[], number[]] | null}
 */
export function orientationLine(model, f) {
  const field = model.welcome?.fields[f];
  const angle = model.value(f, "orientation");
  const centroid = model.value(f, "centroid");
  if (!field?.chart || !angle || !centroid) return null;
  const along = [Math.cos(angle[0]), Math.sin(angle[0])];
  /** @type {[number, number[]][]} */
  const ends = [];
  let [least, most] = [0, 0];
  const pressed = (/** @type {number} */ i) =>
    model.pressure[field.members[i]] * (field.weights?.[i] ?? 1) || 0;
  const hardest = field.members.reduce((most, _, i) => Math.max(most, pressed(i)), 0);
  field.members.forEach((_, i) => {
    const uv = field.chart?.uv[i];
    const share = pressed(i) / hardest;
    if (!uv || !(share > 0)) return;
    const [du, dv] = [uv[0] - centroid[0], uv[1] - centroid[1]];
    ends.push([share * Math.hypot(du, dv), [centroid[0] + share * du, centroid[1] + share * dv]]);
    const s = du * along[0] + dv * along[1];
    [least, most] = [Math.min(least, s), Math.max(most, s)];
  });
  ends.sort((a, b) => b[0] - a[0]);
  if (ends.length > 1) {
    const [a, b] = [ends[0][1], ends[1][1]];
    const size = Math.hypot(a[0] - b[0], a[1] - b[1]);
    const off = Math.abs((a[0] - b[0]) * along[1] - (a[1] - b[1]) * along[0]);
    if (size > 0 && off < 0.01 * size) return [a, b];
  }
  return [
    [centroid[0] + least * along[0], centroid[1] + least * along[1]],
    [centroid[0] + most * along[0], centroid[1] + most * along[1]],
  ];
}

/**
 * The ellipse of a field's axis and anisotropy: half axes in metres, of a disc as large as the pressed area.
 * @param {Model} model
 * @param {number} f
 */
export function axisEllipse(model, f) {
  const axis = model.value(f, "principal_axis");
  const anisotropy = model.value(f, "anisotropy");
  const area = model.value(f, "area");
  if (!axis || !anisotropy || !area || !(area[0] > 0)) return null;
  const radius = Math.sqrt(area[0] / Math.PI);
  const [a, b] = [
    radius * Math.sqrt(1 + anisotropy[0]),
    radius * Math.sqrt(Math.max(0.02, 1 - anisotropy[0])),
  ];
  return { angle: axis[0], a, b };
}

/**
 * How far a field's centroid goes in `ARROW_S`, in the chart.
 * @param {Model} model
 * @param {number} f
 */
export function motionArrow(model, f) {
  const step = model.value(f, "displacement");
  const speed = model.value(f, "speed");
  if (!step || !speed) return null;
  const size = Math.hypot(step[0], step[1]);
  if (!(size > 0)) return null;
  const s = (speed[0] * ARROW_S) / size;
  return [step[0] * s, step[1] * s];
}

/**
 * A point of a tangent plane.
 * @param {{point: Vec3, u: Vec3 | null, v: Vec3 | null}} plane
 * @param {number} du
 * @param {number} dv
 */
export function onPlane(plane, du, dv) {
  if (!plane.u || !plane.v) return plane.point;
  return add(plane.point, add(scale(plane.u, du), scale(plane.v, dv)));
}

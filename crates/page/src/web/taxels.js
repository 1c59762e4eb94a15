/**
 * Draws taxels as flat discs of their true size. A disc has one colour, that of its pressure in the server's table, without
 * light, so that a pixel in its middle can be read against the legend. One that feels nothing is a quiet grey. States have marks of their own near the rim.
 */

import { changedRects } from "./dirty.js";
import { attribute, makeProgram, makeTexture, POSE_GLSL } from "./gl.js";
import { HEALTH } from "./wire.js";

/** How steep the cones are that discs are to the depth test. */
export const CONE = 1.5;

/** Of taxels that no source sends: they have the colours of their fields, or that of the body. */
const NOT_SENT = HEALTH.indexOf("not sent");
/** Taxels that are not sent, or measure something else than what is shown, are so far behind others, of the largest radius: more than cones
 * are high, so that no disc of theirs covers one that is shown. */
const BEHIND = 2;

/**
 * How far behind others taxels are drawn that are not sent, m.
 * @param {import("./wire.js").Mesh} mesh
 */
export function unsentBehind({ taxelRadius }) {
  return BEHIND * taxelRadius.reduce((most, radius) => Math.max(most, radius), 0);
}

/** In place of a state: a good taxel that feels nothing. */
const REST = 15;
/** How much darker than the body a taxel is that no source sends. */
const BARE_SHADE = 0.9;
/** Taxels in a row of the textures of colours. */
const ROW = 1024;

/** Rings around small discs are thinner, or they would cover their neighbours. */
const RING_SIZE = `
float ringSize(float radius) { return clamp(radius / 6.0, 0.3, 1.0); }`;

const VERTEX = `
${RING_SIZE}
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_radius;
layout(location = 3) in uint a_link;
uniform highp sampler2D u_fills;
uniform highp sampler2D u_rings;
uniform mat4 u_clipFromWorld;
uniform vec3 u_eye;
uniform float u_pixels;
${POSE_GLSL}
out vec2 v_corner;
flat out vec4 v_fill;
flat out vec4 v_ring;
flat out float v_radius;
flat out float v_metres;
flat out int v_state;
void main() {
  int corner = gl_VertexID & 3;
  int taxel = gl_VertexID >> 2;
  ivec2 cell = ivec2(taxel % ${ROW}, taxel / ${ROW});
  vec4 fill = texelFetch(u_fills, cell, 0);
  vec4 ring = texelFetch(u_rings, cell, 0);
  vec3 place = toWorld(a_link, vec4(a_position, 1.0));
  vec3 normal = toWorld(a_link, vec4(a_normal, 0.0));
  vec3 toEye = u_eye - place;
  float distance = length(toEye);
  v_state = int(fill.a * 255.0 + 0.5);
  // A disc smaller than a pixel or two would flicker or vanish.
  float radius = max(a_radius, 1.3 * distance / u_pixels);
  v_radius = radius * u_pixels / distance;
  v_metres = radius;
  float grown = 1.0 + (ring.a > 0.0 ? 3.2 * ringSize(v_radius) + 1.3 : 1.0) / v_radius;
  v_corner = (vec2(corner & 1, corner >> 1) * 2.0 - 1.0) * grown;
  vec3 one = normalize(cross(normal, abs(normal.z) < 0.9 ? vec3(0, 0, 1) : vec3(0, 1, 0)));
  vec3 two = cross(normal, one);
  vec3 p = place + (v_corner.x * one + v_corner.y * two) * radius;
  gl_Position = u_clipFromWorld * vec4(p, 1.0);
  // A curved surface would cut a flat disc: its depth is taken a little nearer.
  vec4 nearer = u_clipFromWorld * vec4(p + toEye / distance * a_radius * 0.7, 1.0);
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  v_fill = fill;
  v_ring = ring;
}`;

const FRAGMENT_HEAD = `
in vec2 v_corner;
flat in vec4 v_fill;
flat in vec4 v_ring;
flat in float v_radius;
flat in float v_metres;
flat in int v_state;
uniform highp sampler2D u_depth;
uniform vec3 u_ink;
uniform vec3 u_paper;
uniform bool u_through;
uniform vec2 u_planes;
uniform float u_behind;
out vec4 o_colour;
// Discs are cones to the depth test: where two overlap, each pixel shows the one whose middle is nearer, and no
// disc covers the middle of another. Those that are not sent are behind.
float coneDepth(float d) {
  float away = 1.0 / gl_FragCoord.w + ${CONE.toFixed(1)} * d * v_metres;
  if (v_state == ${NOT_SENT}) away += u_behind;
  float near = u_planes.x;
  float far = u_planes.y;
  return clamp(far / (far - near) * (1.0 - near / away), 0.0, 1.0);
}
bool isHidden() {
  return gl_FragCoord.z > texelFetch(u_depth, ivec2(gl_FragCoord.xy), 0).r;
}`;

/** Of taxels in a good state without a ring: nearly all, so it is short. */
const PLAIN = `
${FRAGMENT_HEAD}
void main() {
  float d = length(v_corner);
  float pixel = 0.8 / v_radius;
  float alpha = clamp(0.5 + (1.0 - d) / (2.0 * pixel), 0.0, 1.0);
  bool hidden = isHidden();
  if (alpha <= 0.0 || (hidden && !u_through)) discard;
  float rim = clamp((d - 1.0 + 2.6 * pixel) / pixel, 0.0, 1.0) * clamp((v_radius - 3.0) / 3.0, 0.0, 1.0);
  // Seen through: what feels nothing gives way to what is behind it.
  if (u_through) alpha *= v_state == ${REST} ? (hidden ? 0.12 : 0.3) : (hidden ? 0.75 : 1.0);
  gl_FragDepth = coneDepth(d);
  o_colour = vec4(v_fill.rgb * (1.0 - 0.3 * rim), alpha);
}`;

/** Of all others. */
const SPECIAL = `
${FRAGMENT_HEAD}
${RING_SIZE}
void main() {
  bool hidden = isHidden();
  if (hidden && !u_through) discard;
  float d = length(v_corner);
  float pixel = max(1e-4, 0.7 * fwidth(d));
  float inside = 1.0 - smoothstep(1.0 - pixel, 1.0 + pixel, d);
  float large = smoothstep(3.0, 6.0, v_radius);
  vec3 colour = v_fill.rgb;
  float alpha = inside;
  float rim = smoothstep(1.0 - 3.0 * pixel, 1.0 - pixel, d) * large;
  bool hollow = v_state == 1 || v_state == 3 || v_state == 6;
  if (hollow) {
    float width = v_state == 6 ? 0.12 : 0.2;
    float line = smoothstep(1.0 - width - 2.0 * pixel, 1.0 - width, d);
    if (v_state == 3) line = max(line, 1.0 - smoothstep(0.13, 0.13 + 2.0 * pixel, min(abs(v_corner.x - v_corner.y), abs(v_corner.x + v_corner.y))));
    if (v_state == 6) line = max(line, 1.0 - smoothstep(0.12, 0.12 + 2.0 * pixel, abs(v_corner.x)));
    colour = u_ink;
    alpha *= line;
  } else if (v_state == 2) {
    float stripe = step(0.5, fract((v_corner.x + v_corner.y) * 2.2));
    colour = mix(colour, u_paper, stripe * smoothstep(0.38, 0.42, d));
    colour = mix(colour, u_ink, 0.5 * rim);
  } else if (v_state == 4) {
    colour = mix(colour, vec3(1.0), smoothstep(0.62 - pixel, 0.62 + pixel, d));
    colour = mix(colour, vec3(0.05), smoothstep(0.84 - pixel, 0.84 + pixel, d));
  } else if (v_state == 5) {
    float dash = step(0.5, fract(atan(v_corner.y, v_corner.x) * 1.2732395));
    colour = mix(colour, u_ink, dash * smoothstep(0.72 - pixel, 0.72 + pixel, d));
  } else {
    colour = mix(colour, colour * 0.7, rim);
  }
  if (v_ring.a > 0.0) {
    float size = ringSize(v_radius) / v_radius;
    float from = 1.0 + size;
    float to = 1.0 + 3.2 * size;
    float ring = smoothstep(from - pixel, from + pixel, d) * (1.0 - smoothstep(to - pixel, to + pixel, d)) * v_ring.a;
    colour = mix(colour, v_ring.rgb, max(ring, 0.0) / max(ring + alpha, 1e-4));
    alpha = max(alpha, ring);
  }
  if (alpha < 0.004) discard;
  gl_FragDepth = coneDepth(d > 1.0 ? 0.35 * d : d);
  o_colour = vec4(colour, hidden ? 0.4 * alpha : alpha);
}`;

/** States that the plain program draws. */
const GOOD = HEALTH.indexOf("good");
const PLAIN_STATES = [GOOD, REST, NOT_SENT];
const MISSING = HEALTH.indexOf("missing");
const FAULTY = HEALTH.indexOf("faulty");
const LEFT_OUT = HEALTH.indexOf("left out");

/** States that a taxel without a pressure has in its own right. */
const SAID_ALONE = [FAULTY, LEFT_OUT, NOT_SENT];

/**
 * The colours of all taxels: four bytes each, the last one the state.
 * @param {Float32Array} pressure
 * @param {Uint8Array} health
 * @param {number} max pressure at the upper end
 * @param {number[][]} colours
 * @param {number[]} rest colour of a taxel that feels nothing
 * @param {Uint8Array} out
 * @param {(taxel: number) => number[]} unsent colour of a taxel that no source sends
 */
export function fillColours(pressure, health, max, colours, rest, out, unsent = () => rest) {
  for (let i = 0; i < pressure.length; i++) {
    const p = pressure[i];
    const known = p === p;
    const isUnsent = health[i] === NOT_SENT;
    const [r, g, b] = isUnsent ? unsent(i) : p > 0 ? colours[colourIndex(p, max)] : rest;
    out[4 * i] = r;
    out[4 * i + 1] = g;
    out[4 * i + 2] = b;
    // Without a pressure a taxel never looks like one at 0, whatever its state.
    const state = health[i];
    if (known && state === 0) out[4 * i + 3] = p > 0 ? 0 : REST;
    else out[4 * i + 3] = known || SAID_ALONE.includes(state) ? state : MISSING;
  }
}

/**
 * What taxels are coloured by: pressures and states of the frame, or the highest pressures of a part of the recording, which say
 * nothing of states.
 * @param {import("./model.js").Model} model
 */
function shownOf({ peaks, pressure, health }) {
  if (!peaks) return { pressure, health };
  const states = health.map((state, taxel) => (Number.isNaN(peaks.peaks[taxel]) ? state : GOOD));
  return { pressure: peaks.peaks, health: states };
}

/**
 * @param {number} p
 * @param {number} max
 */
export function colourIndex(p, max) {
  return Math.round(Math.min(1, Math.max(0, p / max)) * 255) || 0;
}

/**
 * Each value four times.
 * @template {Float32Array | Uint32Array} T
 * @param {T} values
 * @param {number} size components of a value
 * @returns {T}
 */
function fourTimes(values, size) {
  const out = /** @type {T} */ (new /** @type {any} */ (values.constructor)(4 * values.length));
  for (let i = 0; i < values.length / size; i++)
    for (let c = 0; c < 4; c++)
      for (let k = 0; k < size; k++) out[(4 * i + c) * size + k] = values[i * size + k];
  return out;
}

export class Taxels {
  /**
   * @param {import("./gl.js").GL} gl
   * @param {import("./wire.js").Mesh} mesh
   */
  constructor(gl, mesh) {
    this.gl = gl;
    this.count = mesh.taxelId.length;
    this.hasBody = mesh.corners.length > 0;
    this.behind = unsentBehind(mesh);
    this.plain = makeProgram(gl, VERTEX, PLAIN);
    /** Made when first needed. @type {import("./gl.js").Program | null} */
    this.special = null;
    this.rows = Math.max(1, Math.ceil(this.count / ROW));
    this.fill = new Uint8Array(4 * ROW * this.rows);
    this.before = new Uint8Array(4 * ROW * this.rows);
    this.ring = new Uint8Array(4 * ROW * this.rows);
    this.ringBefore = new Uint8Array(4 * ROW * this.rows);
    this.fills = makeTexture(gl, gl.RGBA8, ROW, this.rows);
    this.rings = makeTexture(gl, gl.RGBA8, ROW, this.rows);
    // Four corners a taxel, each with all that the taxel has: software draws instances one by one, which is far slower.
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    attribute(gl, 0, fourTimes(mesh.taxelPosition, 3), 3);
    attribute(gl, 1, fourTimes(mesh.taxelNormal, 3), 3);
    attribute(gl, 2, fourTimes(mesh.taxelRadius, 1), 1);
    attribute(gl, 3, fourTimes(mesh.taxelLink, 1), 1);
    /** Of two triangles for each taxel that is drawn. */
    this.corners = new Uint32Array(6 * this.count);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.corners.byteLength, gl.DYNAMIC_DRAW);
    gl.bindVertexArray(null);
  }

  /**
   * Takes over the pressures of the newest frame.
   * @param {import("./model.js").Model} model
   * @param {import("./body.js").Theme} theme
   * @param {import("./spots.js").Spots} spots where taxels are in the picture
   * @param {{width: number, height: number, rects: number}} limits
   * @returns where the picture changes
   */
  update(model, theme, spots, limits) {
    if (!model.welcome || model.pressure.length !== this.count) return [];
    [this.fill, this.before] = [this.before, this.fill];
    const { scaleMax, welcome } = model;
    const { pressure, health } = shownOf(model);
    const bare = theme.albedo.map((part) => Math.round(255 * BARE_SHADE * part));
    const unsent = (/** @type {number} */ taxel) => model.colourAtRest(taxel) ?? bare;
    fillColours(pressure, health, scaleMax, welcome.colours, theme.rest, this.fill, unsent);
    this.upload(this.fills, this.fill);
    return changedRects(this.before, this.fill, spots, limits);
  }

  /**
   * @param {WebGLTexture | null} texture
   * @param {Uint8Array} bytes
   */
  upload(texture, bytes) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, this.rows, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  /**
   * Whether a taxel has a mark of its own.
   * @param {number} taxel
   */
  isSpecial(taxel) {
    return this.ring[4 * taxel + 3] !== 0 || !PLAIN_STATES.includes(this.fill[4 * taxel + 3]);
  }

  /**
   * Chooses what is drawn of a part of the picture, and says how many corners the plain ones have, and the others behind them. Where the
   * processor draws, every corner costs time, also of what is not seen.
   * @param {import("./spots.js").Spots} spots
   * @param {import("./dirty.js").Rect} rect
   */
  choose(spots, rect) {
    const { gl, corners } = this;
    let end = 0;
    const add = (/** @type {boolean} */ special, /** @type {boolean} */ unsent) => {
      for (let i = 0; i < this.count; i++) {
        const isUnsent = this.fill[4 * i + 3] === NOT_SENT;
        if (isUnsent !== unsent || !spots.isIn(i, rect) || this.isSpecial(i) !== special) continue;
        const first = 4 * i;
        corners[end] = first;
        corners[end + 1] = corners[end + 4] = first + 1;
        corners[end + 2] = corners[end + 3] = first + 2;
        corners[end + 5] = first + 3;
        end += 6;
      }
    };
    // Without depths, later ones are above.
    for (const unsent of [true, false]) add(false, unsent);
    const plain = end;
    for (const unsent of [true, false]) add(true, unsent);
    if (end) gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, corners, 0, end);
    return { plain, special: end - plain };
  }

  /**
   * Rings around taxels, to show which touch or field they belong to.
   * @param {Map<number, number[]>} rings colour by taxel
   * @param {import("./spots.js").Spots} spots where taxels are in the picture
   * @param {{width: number, height: number, rects: number}} limits
   * @returns where the picture changes
   */
  updateRings(rings, spots, limits) {
    [this.ring, this.ringBefore] = [this.ringBefore, this.ring];
    this.ring.fill(0);
    for (const [taxel, [r, g, b]] of rings) this.ring.set([r, g, b, 255], 4 * taxel);
    this.upload(this.rings, this.ring);
    return changedRects(this.ringBefore, this.ring, spots, limits);
  }

  /**
   * Draws into a part of the bound picture, hidden by what the body's picture of the same size has nearer.
   * @param {{spots: import("./spots.js").Spots, rect: import("./dirty.js").Rect}} where
   * @param {import("./gl.js").Target} body
   * @param {import("./camera.js").Camera} camera
   * @param {import("./gl.js").Poses} poses
   * @param {import("./body.js").Theme} theme
   * @param {boolean} through whether hidden ones show faintly
   */
  draw({ spots, rect }, body, camera, poses, theme, through) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, poses.texture);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, body.depth);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, this.fills);
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.rings);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    if (through) gl.disable(gl.DEPTH_TEST);
    else gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.bindVertexArray(this.array);
    const pixels = camera.pixelsPerMetre(1) * (body.height / camera.height);
    const { plain, special } = this.choose(spots, rect);
    if (plain) this.pass(this.plain, 0, plain, pixels, camera, theme, through);
    if (special) {
      this.special ??= makeProgram(gl, VERTEX, SPECIAL);
      this.pass(this.special, plain, special, pixels, camera, theme, through);
    }
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.activeTexture(gl.TEXTURE0);
  }

  /**
   * @param {import("./gl.js").Program} program
   * @param {number} first of the corners
   * @param {number} count of them
   * @param {number} pixels that a metre covers at a depth of a metre
   * @param {import("./camera.js").Camera} camera
   * @param {import("./body.js").Theme} theme
   * @param {boolean} through
   */
  pass({ program, at }, first, count, pixels, camera, theme, through) {
    const { gl } = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("u_clipFromWorld"), false, camera.clipFromWorld);
    gl.uniform3fv(at("u_eye"), camera.eye);
    gl.uniform1f(at("u_pixels"), pixels);
    gl.uniform2f(at("u_planes"), camera.near, camera.far);
    gl.uniform1f(at("u_behind"), this.behind);
    gl.uniform1i(at("u_through"), through ? 1 : 0);
    gl.uniform3fv(at("u_ink"), theme.ink);
    gl.uniform3fv(at("u_paper"), theme.albedo);
    gl.uniform1i(at("u_poses"), 0);
    gl.uniform1i(at("u_depth"), 1);
    gl.uniform1i(at("u_fills"), 2);
    gl.uniform1i(at("u_rings"), 3);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * first);
  }
}

/**
 * Draws taxels as flat discs of their true size. A disc has one colour, that of its pressure in the server's table, without
 * light, so that a pixel in its middle can be read against the legend. States have marks of their own near the rim.
 */

import { attribute, makeProgram, POSE_GLSL } from "./gl.js";
import { HEALTH } from "./wire.js";

const VERTEX = `
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_radius;
layout(location = 3) in uint a_link;
layout(location = 4) in vec4 a_fill;
layout(location = 5) in vec4 a_ring;
uniform mat4 u_clipFromWorld;
uniform vec3 u_eye;
uniform float u_pixels;
uniform bool u_bothSides;
${POSE_GLSL}
out vec2 v_corner;
flat out vec4 v_fill;
flat out vec4 v_ring;
flat out float v_radius;
flat out int v_state;
void main() {
  vec3 place = toWorld(a_link, vec4(a_position, 1.0));
  vec3 normal = toWorld(a_link, vec4(a_normal, 0.0));
  vec3 toEye = u_eye - place;
  float distance = length(toEye);
  if (!u_bothSides && dot(normal, toEye) < 0.0) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  // A disc smaller than a pixel or two would flicker or vanish.
  float radius = max(a_radius, 1.3 * distance / u_pixels);
  v_radius = radius * u_pixels / distance;
  float grown = 1.0 + (a_ring.a > 0.0 ? 4.5 : 1.0) / v_radius;
  v_corner = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * grown;
  vec3 one = normalize(cross(normal, abs(normal.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0)));
  vec3 two = cross(normal, one);
  vec3 p = place + (v_corner.x * one + v_corner.y * two) * radius;
  gl_Position = u_clipFromWorld * vec4(p, 1.0);
  // A curved surface would cut a flat disc: its depth is taken a little nearer.
  vec4 nearer = u_clipFromWorld * vec4(p + toEye / distance * a_radius * 0.7, 1.0);
  gl_Position.z = nearer.z / nearer.w * gl_Position.w;
  v_fill = a_fill;
  v_ring = a_ring;
  v_state = int(a_fill.a * 255.0 + 0.5);
}`;

const FRAGMENT = `
in vec2 v_corner;
flat in vec4 v_fill;
flat in vec4 v_ring;
flat in float v_radius;
flat in int v_state;
uniform highp sampler2D u_depth;
uniform vec2 u_depthScale;
uniform vec3 u_ink;
uniform vec3 u_paper;
uniform bool u_through;
out vec4 o_colour;
void main() {
  float there = texelFetch(u_depth, ivec2(gl_FragCoord.xy * u_depthScale), 0).r;
  bool hidden = gl_FragCoord.z > there;
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
    colour = mix(u_paper, u_ink, line);
    alpha *= v_state == 6 ? line : max(line, 0.55);
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
    colour = mix(colour, colour * 0.62, rim);
  }
  if (v_ring.a > 0.0) {
    float from = 1.0 + 1.0 / v_radius;
    float to = 1.0 + 3.2 / v_radius;
    float ring = smoothstep(from - pixel, from + pixel, d) * (1.0 - smoothstep(to - pixel, to + pixel, d)) * v_ring.a;
    colour = mix(colour, v_ring.rgb, max(ring, 0.0) / max(ring + alpha, 1e-4));
    alpha = max(alpha, ring);
  }
  if (alpha < 0.004) discard;
  o_colour = vec4(colour, hidden ? 0.4 * alpha : alpha);
}`;

const MISSING = HEALTH.indexOf("missing");
const FAULTY = HEALTH.indexOf("faulty");
const LEFT_OUT = HEALTH.indexOf("left out");

/**
 * The colours of all taxels: four bytes each, the last one the state.
 * @param {Float32Array} pressure
 * @param {Uint8Array} health
 * @param {number} max pressure at the upper end
 * @param {number[][]} colours
 * @param {Uint8Array} out
 */
export function fillColours(pressure, health, max, colours, out) {
  for (let i = 0; i < pressure.length; i++) {
    const p = pressure[i];
    const known = p === p;
    const [r, g, b] = colours[colourIndex(known ? p : 0, max)];
    out[4 * i] = r;
    out[4 * i + 1] = g;
    out[4 * i + 2] = b;
    // Without a pressure a taxel never looks like one at 0, whatever its state.
    const state = health[i];
    out[4 * i + 3] = known || state === FAULTY || state === LEFT_OUT ? state : MISSING;
  }
}

/**
 * @param {number} p
 * @param {number} max
 */
export function colourIndex(p, max) {
  return Math.round(Math.min(1, Math.max(0, p / max)) * 255) || 0;
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
    this.program = makeProgram(gl, VERTEX, FRAGMENT);
    this.fill = new Uint8Array(4 * this.count);
    this.ring = new Uint8Array(4 * this.count);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    attribute(gl, 0, mesh.taxelPosition, 3, { perInstance: true });
    attribute(gl, 1, mesh.taxelNormal, 3, { perInstance: true });
    attribute(gl, 2, mesh.taxelRadius, 1, { perInstance: true });
    attribute(gl, 3, mesh.taxelLink, 1, { perInstance: true });
    this.fillBuffer = attribute(gl, 4, this.fill, 4, { perInstance: true, changes: true });
    this.ringBuffer = attribute(gl, 5, this.ring, 4, { perInstance: true, changes: true });
    gl.bindVertexArray(null);
  }

  /**
   * @param {import("./model.js").Model} model
   */
  update(model) {
    if (!model.welcome || model.pressure.length !== this.count) return;
    fillColours(model.pressure, model.health, model.scaleMax, model.welcome.colours, this.fill);
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.fillBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.fill);
  }

  /**
   * Rings around taxels, to show which field they belong to.
   * @param {Map<number, number[]>} rings colour by taxel
   */
  updateRings(rings) {
    this.ring.fill(0);
    for (const [taxel, [r, g, b]] of rings) this.ring.set([r, g, b, 255], 4 * taxel);
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.ringBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.ring);
  }

  /**
   * Draws onto the screen, hidden by what the body's picture has nearer.
   * @param {import("./gl.js").Target} body
   * @param {import("./camera.js").Camera} camera
   * @param {import("./gl.js").Poses} poses
   * @param {import("./body.js").Theme} theme
   * @param {{through: boolean, width: number, height: number}} how
   */
  draw(body, camera, poses, theme, how) {
    const { gl } = this;
    const { program, at } = this.program;
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("u_clipFromWorld"), false, camera.clipFromWorld);
    gl.uniform3fv(at("u_eye"), camera.eye);
    gl.uniform1f(at("u_pixels"), camera.pixelsPerMetre(1) * (how.height / camera.height));
    gl.uniform1i(at("u_bothSides"), how.through || !this.hasBody ? 1 : 0);
    gl.uniform1i(at("u_through"), how.through ? 1 : 0);
    gl.uniform2f(at("u_depthScale"), body.width / how.width, body.height / how.height);
    gl.uniform3fv(at("u_ink"), theme.ink);
    gl.uniform3fv(at("u_paper"), theme.albedo);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, poses.texture);
    gl.uniform1i(at("u_poses"), 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, body.depth);
    gl.uniform1i(at("u_depth"), 1);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindVertexArray(this.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.count);
    gl.bindVertexArray(null);
  }
}

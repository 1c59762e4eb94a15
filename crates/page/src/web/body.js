/** Draws the body: matt, under light from all around, each link by its pose. */

import { attribute, BACKGROUND_GLSL, makeProgram, POSE_GLSL } from "./gl.js";

const BACKGROUND_VERTEX = `
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 1.0, 1.0);
}`;

const BACKGROUND_FRAGMENT = `
${BACKGROUND_GLSL}
out vec4 o_colour;
void main() {
  o_colour = vec4(background(gl_FragCoord.xy) + dither(gl_FragCoord.xy), 1.0);
}`;

const VERTEX = `
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in uint a_link;
uniform mat4 u_clipFromWorld;
${POSE_GLSL}
out vec3 v_normal;
out vec3 v_place;
void main() {
  v_place = toWorld(a_link, vec4(a_position, 1.0));
  v_normal = toWorld(a_link, vec4(a_normal, 0.0));
  gl_Position = u_clipFromWorld * vec4(v_place, 1.0);
}`;

const FRAGMENT = `
in vec3 v_normal;
in vec3 v_place;
uniform vec3 u_eye;
uniform vec3 u_right;
uniform vec3 u_up;
uniform vec3 u_albedo;
uniform vec3 u_rim;
uniform float u_solid;
${BACKGROUND_GLSL}
out vec4 o_colour;
void main() {
  vec3 toEye = normalize(u_eye - v_place);
  vec3 normal = normalize(v_normal);
  if (dot(normal, toEye) < 0.0) normal = -normal;
  // The sky lights what looks up, the floor a little what looks down, a lamp stands left above the eye.
  float sky = 0.5 + 0.5 * normal.z;
  vec3 lamp = normalize(toEye + 0.7 * u_up - 0.6 * u_right);
  float wrapped = max(0.0, (dot(normal, lamp) + 0.35) / 1.35);
  float facing = clamp(dot(normal, toEye), 0.0, 1.0);
  float light = mix(0.56, 0.68, sky) + 0.36 * wrapped;
  light *= mix(0.62, 1.0, smoothstep(0.0, 0.55, facing));
  vec3 colour = u_albedo * light + u_rim * pow(1.0 - facing, 4.0);
  vec3 behind = background(gl_FragCoord.xy);
  o_colour = vec4(mix(behind, colour, u_solid) + dither(gl_FragCoord.xy), 1.0);
}`;

/**
 * @typedef {{above: number[], below: number[], albedo: number[], rim: number[], ink: number[], rest: number[]}} Theme
 * `rest` is the colour of a taxel that feels nothing, 0 to 255; the others run from 0 to 1.
 */

export class Body {
  /**
   * @param {import("./gl.js").GL} gl
   * @param {import("./wire.js").Mesh} mesh
   */
  constructor(gl, mesh) {
    this.gl = gl;
    this.program = makeProgram(gl, VERTEX, FRAGMENT);
    this.backdrop = makeProgram(gl, BACKGROUND_VERTEX, BACKGROUND_FRAGMENT);
    this.corners = mesh.corners.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    attribute(gl, 0, mesh.position, 3);
    attribute(gl, 1, mesh.normal, 3);
    attribute(gl, 2, mesh.link, 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.corners, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.empty = gl.createVertexArray();
  }

  /**
   * Draws background and body into a target.
   * @param {import("./gl.js").Target} target
   * @param {import("./camera.js").Camera} camera
   * @param {import("./gl.js").Poses} poses
   * @param {Theme} theme
   * @param {{solid: number, body: boolean}} how `solid` below 1 lets the background through
   */
  draw(target, camera, poses, theme, how) {
    const { gl } = this;
    target.bind();
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(this.backdrop.program);
    this.setBackground(this.backdrop, target, theme);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (!how.body || !this.corners) return;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    const { program, at } = this.program;
    gl.useProgram(program);
    this.setBackground(this.program, target, theme);
    gl.uniformMatrix4fv(at("u_clipFromWorld"), false, camera.clipFromWorld);
    gl.uniform3fv(at("u_eye"), camera.eye);
    gl.uniform3fv(at("u_right"), camera.right);
    gl.uniform3fv(at("u_up"), camera.up);
    gl.uniform3fv(at("u_albedo"), theme.albedo);
    gl.uniform3fv(at("u_rim"), theme.rim);
    gl.uniform1f(at("u_solid"), how.solid);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, poses.texture);
    gl.uniform1i(at("u_poses"), 0);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.corners, gl.UNSIGNED_INT, 0);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
  }

  /**
   * @param {import("./gl.js").Program} program
   * @param {import("./gl.js").Target} target
   * @param {Theme} theme
   */
  setBackground(program, target, theme) {
    const { gl } = this;
    gl.uniform3fv(program.at("u_above"), theme.above);
    gl.uniform3fv(program.at("u_below"), theme.below);
    gl.uniform2f(program.at("u_size"), target.width, target.height);
  }
}

/** WebGL2: the context, programs, and pictures that are drawn off the screen. */

/** @typedef {WebGL2RenderingContext} GL */

/**
 * @param {HTMLCanvasElement} canvas
 * @returns {GL | null}
 */
export function openContext(canvas) {
  return canvas.getContext("webgl2", {
    alpha: false,
    antialias: false,
    depth: false,
    stencil: false,
    powerPreference: "high-performance",
  });
}

/**
 * The name of what draws, and whether that is the processor.
 * @param {GL} gl
 */
export function rendererOf(gl) {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return { name, software: /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name) };
}

/**
 * @param {GL} gl
 * @param {string} vertex
 * @param {string} fragment
 */
export function makeProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of /** @type {[number, string][]} */ ([
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ])) {
    const shader = gl.createShader(kind);
    if (!shader || !program) throw new Error("The WebGL context is lost.");
    gl.shaderSource(shader, `#version 300 es\nprecision highp float;\nprecision highp int;\n${source}`);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const shaders = gl.getAttachedShaders(program) ?? [];
    const log = shaders.map((shader) => gl.getShaderInfoLog(shader)).join("\n");
    throw new Error(`A shader program does not link: ${gl.getProgramInfoLog(program)}\n${log}`);
  }
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const places = new Map();
  const at = (/** @type {string} */ name) => {
    let place = places.get(name);
    if (place === undefined) {
      place = gl.getUniformLocation(program, name);
      places.set(name, place);
    }
    return place;
  };
  return { program, at };
}

/** @typedef {ReturnType<typeof makeProgram>} Program */

/**
 * A buffer of an attribute.
 * @param {GL} gl
 * @param {number} place
 * @param {Float32Array | Uint32Array} data
 * @param {number} size components
 */
export function attribute(gl, place, data, size) {
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(place);
  if (data instanceof Uint32Array) gl.vertexAttribIPointer(place, size, gl.UNSIGNED_INT, 0, 0);
  else gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
}

/**
 * A texture without filters.
 * @param {GL} gl
 * @param {number} format
 * @param {number} width
 * @param {number} height
 */
export function makeTexture(gl, format, width, height) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
    gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
    gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  return texture;
}

/** A picture off the screen: colour, and depth that shaders can read. */
export class Target {
  /**
   * @param {GL} gl
   * @param {number} width
   * @param {number} height
   */
  constructor(gl, width, height) {
    this.gl = gl;
    this.width = width;
    this.height = height;
    this.colour = makeTexture(gl, gl.RGBA8, width, height);
    this.depth = makeTexture(gl, gl.DEPTH_COMPONENT24, width, height);
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.colour, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depth, 0);
  }

  /** Makes it what is drawn into. */
  bind() {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.framebuffer);
    this.gl.viewport(0, 0, this.width, this.height);
  }

  /** Copies the colours to the screen, which is as large. */
  toScreen() {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    // Chromium clears the screen before the first drawing, and does not take a copy for one.
    gl.clear(gl.COLOR_BUFFER_BIT);
    this.copy(null, this.width, this.height);
  }

  /**
   * Copies the colours, averaged where the sizes differ.
   * @param {Target | null} target
   * @param {number} width
   * @param {number} height
   */
  copy(target, width, height) {
    const { gl } = this;
    const filter = width === this.width && height === this.height ? gl.NEAREST : gl.LINEAR;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.framebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, target ? target.framebuffer : null);
    gl.blitFramebuffer(0, 0, this.width, this.height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, filter);
  }

  release() {
    this.gl.deleteTexture(this.colour);
    this.gl.deleteTexture(this.depth);
    this.gl.deleteFramebuffer(this.framebuffer);
  }
}

/** Matrices of the links as a texture: three texels a link. */
export class Poses {
  /**
   * @param {GL} gl
   * @param {number} links
   */
  constructor(gl, links) {
    this.gl = gl;
    this.links = links;
    this.texture = makeTexture(gl, gl.RGBA32F, 3, Math.max(1, links));
    this.version = -1;
  }

  /**
   * @param {Float32Array} rows
   * @param {number} version
   */
  update(rows, version) {
    if (version === this.version || !this.links) return;
    this.version = version;
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 3, this.links, gl.RGBA, gl.FLOAT, rows);
  }
}

/** In shaders: what a link's pose does to a point (w = 1) or a direction (w = 0). */
export const POSE_GLSL = `
uniform highp sampler2D u_poses;
vec3 toWorld(uint link, vec4 p) {
  int l = int(link);
  return vec3(dot(texelFetch(u_poses, ivec2(0, l), 0), p),
              dot(texelFetch(u_poses, ivec2(1, l), 0), p),
              dot(texelFetch(u_poses, ivec2(2, l), 0), p));
}`;

/** In shaders: the background behind everything, by the height in the picture. */
export const BACKGROUND_GLSL = `
uniform vec3 u_above;
uniform vec3 u_below;
uniform vec2 u_size;
vec3 background(vec2 at) {
  vec2 p = at / u_size;
  float glow = 1.0 - smoothstep(0.0, 0.75, length((p - vec2(0.5, 0.55)) * vec2(u_size.x / u_size.y, 1.0)));
  return mix(u_below, u_above, clamp(0.15 + 0.45 * p.y + 0.4 * glow, 0.0, 1.0));
}
// Less than one step of 8 bits, so that gradients show no bands.
float dither(vec2 at) {
  return (fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}`;

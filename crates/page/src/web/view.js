/** The picture in space: when it is drawn, at what detail, and what of it is kept between drawings. */

import { Body } from "./body.js";
import { addRect } from "./dirty.js";
import { openContext, Poses, rendererOf, Target } from "./gl.js";
import { Spots } from "./spots.js";
import { Taxels } from "./taxels.js";
import { THEMES } from "./theme.js";

/** The body is drawn finer after so long without motion. */
const REFINE_AFTER_MS = 220;
/** Above this time of a drawing in motion the body loses detail; below the second it gains it again. */
const SLOW_MS = 62;
const FAST_MS = 40;
/** Parts of the picture that are drawn anew at most. */
const RECTS_MAX = 4;

export class View {
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
    this.gl = openContext(canvas);
    this.renderer = this.gl ? rendererOf(this.gl) : { name: "none", software: true };
    this.lost = false;
    this.framesDrawn = 0;
    /** When the first picture with a body was on the screen. @type {number | null} */
    this.firstPictureMs = null;
    /** Called before each drawing; what it gives back is called when the drawing is done. @type {() => () => void} */
    this.onDraw = () => () => {};
    /** Part of the picture's width and height that is drawn while it moves. */
    this.detail = 1;
    /** Part of the picture's width and height that is drawn now. */
    this.part = 1;
    /** Smoothed time of a drawing, ms. */
    this.drawMs = 0;
    /** What is handed the canvas after the next drawing. @type {((canvas: HTMLCanvasElement) => void) | null} */
    this.kept = null;
    this.scheduled = false;
    this.busy = false;
    this.again = false;
    this.taxelsChanged = true;
    this.ringsChanged = true;
    this.drawn = { motion: "", look: "" };
    this.refined = false;
    this.size = "";
    this.movedAt = 0;
    /** @type {{body: Body, taxels: Taxels, poses: Poses} | null} */
    this.parts = null;
    this.spots = new Spots(model, camera);
    /** The body alone with its depth, and the body with taxels. @type {{body: Target | null, picture: Target | null}} */
    this.targets = { body: null, picture: null };
    /** Counts the contexts that were lost. */
    this.contexts = 0;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.lost = true;
      this.contexts++;
      this.parts = null;
      this.targets = { body: null, picture: null };
      model.tell("context");
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.lost = false;
      this.build();
      model.tell("context");
    });
  }

  /** Makes everything that lives in the context from the model. */
  build() {
    const { gl, model } = this;
    if (!gl || this.lost || !model.mesh) return;
    this.parts = {
      body: new Body(gl, model.mesh),
      taxels: new Taxels(gl, model.mesh),
      poses: new Poses(gl, model.mesh.restPose.length / 7),
    };
    this.drawn = { motion: "", look: "" };
    this.taxelsChanged = this.ringsChanged = true;
    this.request();
  }

  /**
   * Draws once more, as fine as it can be, and hands over the canvas while it holds that.
   * @param {(canvas: HTMLCanvasElement) => void} take
   * @param {boolean} [isAnew] whether the body is drawn too, also where it looks as before
   */
  keep(take, isAnew = true) {
    this.kept = take;
    if (isAnew || !this.refined) this.drawn = { motion: "", look: "" };
    this.request();
  }

  request() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      // The drawing before is still under way: one more would only wait behind it.
      if (this.busy) this.again = true;
      else this.draw();
    });
  }

  draw() {
    const { gl, camera, model, choices, parts } = this;
    const finish = this.onDraw();
    if (!gl || !parts || this.lost) {
      finish();
      return;
    }
    const begun = performance.now();
    const ratio = this.renderer.software ? 1 : Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(camera.width * ratio));
    const height = Math.max(1, Math.round(camera.height * ratio));
    const resized = this.size !== `${width} ${height}`;
    this.size = `${width} ${height}`;
    parts.poses.update(model.rows, model.poseVersion);
    const theme = THEMES[choices.dark ? "dark" : "light"];
    const how = { solid: choices.xray ? 0.3 : 1, body: choices.body };
    const motion = [camera.version, model.poseVersion, width, height].join();
    const look = [choices.dark, how.solid, how.body, choices.taxels, model.frame !== null].join();
    const moved = this.drawn.motion !== "" && this.drawn.motion !== motion && !resized;
    let whole = this.drawn.motion !== motion || this.drawn.look !== look;
    if (this.drawn.look !== look) this.taxelsChanged = true;
    if (this.drawn.motion !== motion || this.drawn.look !== look) {
      this.drawn = { motion, look };
      this.refined = false;
      this.movedAt = begun;
      const part = (this.part = moved ? this.detail : 1);
      if (this.kept) {
        this.refined = true;
        this.refine(width, height, theme, how);
      } else {
        const target = this.target("body", Math.ceil(width * part), Math.ceil(height * part));
        parts.body.draw(target, camera, parts.poses, theme, how);
        setTimeout(() => this.request(), REFINE_AFTER_MS + 20);
      }
    } else if (!this.refined && begun - this.movedAt > REFINE_AFTER_MS) {
      this.refined = whole = true;
      this.part = 1;
      this.refine(width, height, theme, how);
    }
    const { body } = this.targets;
    if (!body) return;
    const size = { width: body.width, height: body.height };
    const { spots } = this;
    spots.update(body.width / camera.width, choices.xray || !parts.taxels.hasBody);
    const limits = { ...size, rects: RECTS_MAX };
    /** @type {import("./dirty.js").Rect[]} */
    let rects = [];
    if (this.taxelsChanged) rects = parts.taxels.update(model, theme, spots, limits);
    if (this.ringsChanged)
      for (const rect of parts.taxels.updateRings(choices.rings(model), spots, limits))
        addRect(rects, rect, limits.rects);
    this.taxelsChanged = this.ringsChanged = false;
    if (whole) rects = [{ x0: 0, y0: 0, x1: size.width, y1: size.height }];
    if (!rects.length && !resized && !this.kept) {
      // Nothing looks different: what is on the screen shows this frame.
      finish();
      return;
    }
    const picture = this.target("picture", size.width, size.height);
    // The browser enlarges a coarser picture faster than we could.
    if (this.canvas.width !== size.width || this.canvas.height !== size.height)
      [this.canvas.width, this.canvas.height] = [size.width, size.height];
    gl.enable(gl.SCISSOR_TEST);
    for (const rect of rects) {
      const { x0, y0, x1, y1 } = rect;
      gl.scissor(x0, size.height - y1, x1 - x0, y1 - y0);
      body.copy(picture, size.width, size.height);
      picture.bind();
      gl.depthMask(true);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      // Before the first frame nothing is known of any taxel.
      if (choices.taxels && model.frame)
        parts.taxels.draw({ spots, rect }, body, camera, parts.poses, theme, choices.xray);
    }
    gl.disable(gl.SCISSOR_TEST);
    picture.toScreen();
    // Only now does the canvas hold it.
    this.kept?.(this.canvas);
    this.kept = null;
    this.whenDone(() => {
      this.framesDrawn++;
      this.firstPictureMs ??= performance.now();
      this.adapt(performance.now() - begun, moved);
      finish();
    });
  }

  /**
   * Draws the body four times as fine and averages: smooth edges at rest also where the processor draws.
   * @param {number} width
   * @param {number} height
   * @param {import("./body.js").Theme} theme
   * @param {{solid: number, body: boolean}} how
   */
  refine(width, height, theme, how) {
    const { gl, parts } = this;
    if (!gl || !parts) return;
    const body = this.target("body", width, height);
    parts.body.draw(body, this.camera, parts.poses, theme, how);
    const fine = new Target(gl, 2 * width, 2 * height);
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE) {
      parts.body.draw(fine, this.camera, parts.poses, theme, how);
      fine.copy(body, width, height);
    }
    fine.release();
  }

  /**
   * A target of a size, made anew where the size differs.
   * @param {"body" | "picture"} name
   * @param {number} width
   * @param {number} height
   */
  target(name, width, height) {
    const { gl } = this;
    if (!gl) throw new Error("There is no WebGL context.");
    let target = this.targets[name];
    if (!target || target.width !== width || target.height !== height) {
      target?.release();
      target = new Target(gl, width, height);
      this.targets[name] = target;
    }
    return target;
  }

  /**
   * Waits until the graphics have done all work so far.
   * @param {() => void} then
   */
  whenDone(then) {
    const { gl } = this;
    const fence = gl?.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl?.flush();
    this.busy = true;
    const context = this.contexts;
    const look = () => {
      // What was under way in a lost context ends now, or the server would wait for it for ever.
      const isSame = context === this.contexts;
      if (gl && fence && isSame && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
        setTimeout(look, 1);
        return;
      }
      if (gl && fence && isSame) gl.deleteSync(fence);
      this.busy = false;
      then();
      if (this.again) {
        this.again = false;
        this.request();
      }
    };
    setTimeout(look, 0);
  }

  /**
   * Gives up detail in motion before the page falls behind.
   * @param {number} ms
   * @param {boolean} moved
   */
  adapt(ms, moved) {
    this.drawMs += 0.2 * (ms - this.drawMs);
    if (!moved) return;
    if (ms > SLOW_MS) this.detail = Math.max(0.5, this.detail * 0.8);
    else if (ms < FAST_MS) this.detail = Math.min(1, this.detail * 1.1);
  }
}

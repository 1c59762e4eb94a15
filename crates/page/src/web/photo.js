/** The view as a PNG: the body, the marks, the length and the axes, and the colours of pressure with their numbers. */

import { cssColour, saveFile } from "./dom.js";
import { scaleFor, seconds, short } from "./format.js";

export class Photo {
  /**
   * @param {import("./view.js").View} view
   * @param {import("./model.js").Model} model
   * @param {HTMLCanvasElement[]} above what lies over the body
   */
  constructor(view, model, above) {
    this.view = view;
    this.model = model;
    this.above = above;
  }

  /** Draws the view once more, and hands it over as a file. */
  take() {
    this.view.keep((picture) => {
      const canvas = this.compose(picture);
      canvas.toBlob((blob) => blob && saveFile(blob, fileName(this.model, ".png")), "image/png");
    });
  }

  /**
   * The picture with all that lies over it.
   * @param {HTMLCanvasElement} picture
   * @param {number} [ratio] of its size to that of the stage
   */
  compose(picture, ratio = Math.min(2, window.devicePixelRatio || 1)) {
    const { camera } = this.view;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [Math.round(camera.width * ratio), Math.round(camera.height * ratio)];
    const context = canvas.getContext("2d");
    if (!context) return canvas;
    context.scale(ratio, ratio);
    context.drawImage(picture, 0, 0, camera.width, camera.height);
    for (const layer of this.above) {
      const { offsetLeft: x, offsetTop: y, clientWidth: width, clientHeight: height } = layer;
      if (width && height && layer.width) context.drawImage(layer, x, y, width, height);
    }
    if (!this.model.isAtRest) this.bar(context, camera.height);
    return canvas;
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {number} height
   */
  bar(context, height) {
    const { model } = this;
    const colours = model.welcome?.colours ?? [];
    const by = scaleFor("P", model.scaleMax, model.quantity);
    const [left, top, width] = [14, height - 30, 220];
    for (let x = 0; x < width; x++) {
      const [r, g, b] = colours[Math.round((x / (width - 1)) * (colours.length - 1))] ?? [0, 0, 0];
      context.fillStyle = `rgb(${r} ${g} ${b})`;
      context.fillRect(left + x, top, 1, 9);
    }
    context.font = "600 11px system-ui, sans-serif";
    context.fillStyle = cssColour("text");
    context.textBaseline = "top";
    context.textAlign = "left";
    context.fillText("0", left, top + 13);
    context.textAlign = "right";
    context.fillText(`${short(model.scaleMax * by.factor)} ${by.unit}`, left + width, top + 13);
    context.textAlign = "left";
    context.textBaseline = "bottom";
    const moment = model.welcome?.time && model.frame ? ` · ${seconds(model.frame.t)}` : "";
    const { peaks } = model;
    const part = peaks ? ` · highest from ${seconds(peaks.from)} to ${seconds(peaks.to)}` : "";
    context.fillText(`${model.welcome?.body ?? ""}${peaks ? part : moment}`, left, top - 5);
  }
}

/** What a file of the moment that is shown is called. @param {import("./model.js").Model} model */
const momentOf = (model) => (model.welcome?.time && model.frame ? `-${model.frame.t.toFixed(2)}s` : "");

/**
 * Such as `hand-2.90s.png`.
 * @param {import("./model.js").Model} model
 * @param {string} end
 * @param {string} moment
 */
export function fileName(model, end, moment = momentOf(model)) {
  const body = (model.welcome?.body ?? "body").split("/").pop() ?? "body";
  const stem = body.replace(/\.[a-z]+$/i, "").replace(/[^\w.-]+/g, "_") || "body";
  return `${stem}${moment}${end}`;
}

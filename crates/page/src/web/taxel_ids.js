/** Ids of the taxels that are seen. */

import { cssColour } from "./dom.js";

/** Taxels with smaller discs have no room for an id, pixels. */
const LEAST_RADIUS_PX = 6;
/** Most ids at once: more could not be read, and it is looked for each whether the body hides it. */
const IDS_MAX = 600;
/** Ids come when the view has been still for so long, ms. */
const STILL_MS = 150;

export class TaxelIds {
  /**
   * @param {import("./model.js").Model} model
   * @param {import("./pick.js").Picker} picker
   */
  constructor(model, picker) {
    this.model = model;
    this.picker = picker;
    this.view = "";
    this.since = 0;
    /** @type {{x: number, y: number, text: string}[] | null} */
    this.places = null;
  }

  /**
   * Draws them, or asks for another drawing once the view is still.
   * @param {CanvasRenderingContext2D} context
   * @param {() => void} again
   */
  draw(context, again) {
    const { model, picker } = this;
    const view = `${picker.camera.version} ${model.poseVersion}`;
    if (view !== this.view) {
      this.view = view;
      this.since = performance.now();
      this.places = null;
    }
    if (!this.places && performance.now() - this.since < STILL_MS) {
      setTimeout(again, STILL_MS + 10);
      return;
    }
    this.places ??= this.find();
    context.font = "600 10px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 2.5;
    context.strokeStyle = cssColour("halo");
    context.fillStyle = cssColour("text");
    for (const { x, y, text } of this.places) {
      context.strokeText(text, x, y);
      context.fillText(text, x, y);
    }
    context.textAlign = "left";
  }

  find() {
    const { mesh } = this.model;
    const { camera } = this.picker;
    const perMetre = camera.pixelsPerMetre(camera.distance);
    const places = [];
    for (let taxel = 0; taxel < (mesh?.taxelId.length ?? 0) && places.length < IDS_MAX; taxel++) {
      if ((mesh?.taxelRadius[taxel] ?? 0) * perMetre < LEAST_RADIUS_PX) continue;
      const at = this.picker.pixelOf(taxel);
      if (at) places.push({ x: at.x, y: at.y, text: String(mesh?.taxelId[taxel]) });
    }
    return places;
  }
}

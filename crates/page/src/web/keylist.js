/** Which key does what. */

import { byId } from "./dom.js";

/** What the pointer and fingers do; a bar stands between two ways. @type {import("./keys.js").Gesture[]} */
export const GESTURES = [
  { where: "On the body", how: "drag", does: "orbit" },
  { where: "On the body", how: "right drag|⇧ drag", does: "pan" },
  { where: "On the body", how: "wheel", does: "zoom" },
  { where: "On the body", how: "rest on a taxel", does: "describe it" },
  { where: "On the body", how: "click a taxel", does: "its smallest field, then larger ones" },
  { where: "On the body", how: "click a mark", does: "its touch" },
  { where: "On the body", how: "double click", does: "look at the chosen field" },
  { where: "On the timeline", how: "drag", does: "seek" },
  { where: "On the timeline", how: "⇧ drag", does: "repeat this part" },
  { where: "On the timeline", how: "⇧ click", does: "repeat nothing" },
  { where: "On the timeline", how: "wheel|pinch", does: "zoom" },
  { where: "On the timeline", how: "⇧ wheel", does: "earlier and later" },
  { where: "On the timeline", how: "double click", does: "whole recording" },
  { where: "On plots and lists", how: "wheel", does: "zoom a plot in time" },
  { where: "On plots and lists", how: "click a plot", does: "go to this moment" },
  { where: "On plots and lists", how: "click a row", does: "choose it; once more: look at it" },
  { where: "With fingers", how: "one", does: "orbit" },
  { where: "With fingers", how: "two", does: "pan and zoom" },
  { where: "With fingers", how: "tap", does: "describe a taxel" },
];

/**
 * @param {{camera: import("./camera.js").Camera, choices: import("./choices.js").Choices,
 *   fields: import("./fields.js").Fields, legend: import("./legend.js").Legend,
 *   timeline: import("./timeline.js").Timeline, look: (name: import("./camera.js").Preset) => void,
 *   lookAt: (field: number) => void, lookAtAll: () => void, release: () => void, moved: () => void, explain: () => void,
 *   photo: () => void, help: () => void, pause: () => void, link: () => void,
 *   measure: import("./measure.js").Measure, video: import("./video.js").Video,
 *   peaks: import("./peaks.js").Peaks, plots: import("./plots.js").Plots, table: () => void}} page
 * @returns {import("./keys.js").Key[]}
 */
export function keyList(page) {
  const { camera, choices, fields, legend, timeline, measure, peaks, plots, video } = page;
  const move = (/** @type {() => void} */ change) => () => {
    change();
    page.moved();
  };
  const fold = (/** @type {string} */ id) => () => {
    const panel = byId(id, HTMLDetailsElement);
    panel.open = !panel.open;
  };
  return [
    { group: "View", keys: ["1"], does: "from the front", act: () => page.look("front") },
    { group: "View", keys: ["2"], does: "from the back", act: () => page.look("back") },
    { group: "View", keys: ["3"], does: "from the left", act: () => page.look("left") },
    { group: "View", keys: ["4"], does: "from the right", act: () => page.look("right") },
    { group: "View", keys: ["5"], does: "from the top", act: () => page.look("top") },
    { group: "View", keys: ["6"], does: "from the bottom", act: () => page.look("bottom") },
    { group: "View", keys: ["0"], does: "whole body", act: page.lookAtAll },
    { group: "View", keys: ["ArrowLeft"], does: "orbit left", act: move(() => camera.orbit(-0.12, 0)) },
    { group: "View", keys: ["ArrowRight"], does: "orbit right", act: move(() => camera.orbit(0.12, 0)) },
    { group: "View", keys: ["ArrowUp"], does: "orbit up", act: move(() => camera.orbit(0, 0.1)) },
    { group: "View", keys: ["ArrowDown"], does: "orbit down", act: move(() => camera.orbit(0, -0.1)) },
    { group: "View", keys: ["Shift+ArrowLeft"], does: "pan left", act: move(() => camera.pan(-40, 0)) },
    { group: "View", keys: ["Shift+ArrowRight"], does: "pan right", act: move(() => camera.pan(40, 0)) },
    { group: "View", keys: ["Shift+ArrowUp"], does: "pan up", act: move(() => camera.pan(0, -40)) },
    { group: "View", keys: ["Shift+ArrowDown"], does: "pan down", act: move(() => camera.pan(0, 40)) },
    { group: "View", keys: ["+", "="], does: "nearer", act: move(() => camera.zoom(1.2)) },
    { group: "View", keys: ["-"], does: "farther", act: move(() => camera.zoom(1 / 1.2)) },
    {
      group: "Fields",
      keys: ["f"],
      does: "look at the field",
      act: () => choices.field !== null && page.lookAt(choices.field),
    },
    { group: "Fields", keys: ["j"], does: "next field", act: () => fields.step(1) },
    { group: "Fields", keys: ["h"], does: "previous field", act: () => fields.step(-1) },
    { group: "Fields", keys: ["/"], does: "search", act: () => fields.search.focus() },
    { group: "Fields", keys: ["e"], does: "explain the percept", act: page.explain },
    { group: "Fields", keys: ["Escape"], does: "follow the touch", act: page.release },
    { group: "Picture", keys: ["x"], does: "see through the body", act: () => choices.toggle("xray") },
    { group: "Picture", keys: ["b"], does: "body on and off", act: () => choices.toggle("body") },
    { group: "Picture", keys: ["d"], does: "taxels on and off", act: () => choices.toggle("taxels") },
    { group: "Picture", keys: ["t"], does: "colour rims by field", act: () => choices.toggle("tint") },
    { group: "Picture", keys: ["s"], does: "save the view as a PNG", act: page.photo },
    {
      group: "Picture",
      keys: ["S"],
      does: "save a video of what is repeated or shown",
      act: () => video.toggle(),
    },
    { group: "Picture", keys: ["M"], does: "highest pressures over that time", act: () => peaks.toggle() },
    { group: "Picture", keys: ["y"], does: "distance of two clicks", act: () => measure.toggle() },
    { group: "Picture", keys: ["l"], does: "copy a link to this view", act: page.link },
    { group: "Picture", keys: ["k"], does: "ids of taxels on and off", act: () => choices.toggle("ids") },
    { group: "Picture", keys: ["n"], does: "labels on and off", act: () => choices.toggle("labels") },
    {
      group: "Picture",
      keys: ["m"],
      does: "what has marks",
      act: () => choices.nextMarks(),
    },
    { group: "Picture", keys: ["a"], does: "autoscale or fixed scale", act: () => legend.toggle() },
    { group: "Time", keys: [" "], does: "pause and go on, also live", act: page.pause },
    { group: "Time", keys: [","], does: "one frame back", act: () => timeline.step(-1) },
    { group: "Time", keys: ["."], does: "one frame on", act: () => timeline.step(1) },
    { group: "Time", keys: ["w"], does: "to the touch before", act: () => timeline.toTouch(-1) },
    { group: "Time", keys: ["r"], does: "to the next touch", act: () => timeline.toTouch(1) },
    { group: "Time", keys: ["PageUp"], does: "one second back", act: () => timeline.jump(-1) },
    { group: "Time", keys: ["PageDown"], does: "one second on", act: () => timeline.jump(1) },
    { group: "Time", keys: ["Home"], does: "to the start", act: () => timeline.seek(-Infinity) },
    { group: "Time", keys: ["End"], does: "to the end", act: () => timeline.seek(Infinity) },
    { group: "Time", keys: [">"], does: "faster", act: () => timeline.faster(1) },
    { group: "Time", keys: ["<"], does: "slower", act: () => timeline.faster(-1) },
    { group: "Time", keys: ["z"], does: "less time, larger", act: () => timeline.zoom(1) },
    { group: "Time", keys: ["Z"], does: "more time", act: () => timeline.zoom(-1) },
    { group: "Time", keys: ["["], does: "repeat from here", act: () => timeline.loopEnd("from") },
    { group: "Time", keys: ["]"], does: "repeat up to here", act: () => timeline.loopEnd("to") },
    {
      group: "Time",
      keys: ["\\"],
      does: "repeat what is shown, or nothing",
      act: () => timeline.toggleLoop(),
    },
    { group: "Panels", keys: ["u"], does: "touches", act: fold("touches-panel") },
    { group: "Panels", keys: ["i"], does: "fields", act: fold("fields-panel") },
    { group: "Panels", keys: ["v"], does: "percept", act: fold("percept-panel") },
    { group: "Panels", keys: ["c"], does: "chart", act: fold("chart-panel") },
    { group: "Panels", keys: ["p"], does: "plots", act: fold("plots-panel") },
    { group: "Panels", keys: ["U"], does: "touches in the plots", act: () => plots.toggleTouches() },
    { group: "Panels", keys: ["q"], does: "save the plots as CSV", act: page.table },
    { group: "Panels", keys: ["g"], does: "events", act: fold("events-panel") },
    { group: "Panels", keys: ["o"], does: "boards", act: fold("boards-panel") },
    { group: "Panels", keys: ["?"], does: "this list", act: page.help },
  ];
}

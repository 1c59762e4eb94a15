/** What the page shows as the end of its address, and back. Nothing here touches the document, so it runs under node too. */

/**
 * What can be said of a view; what is absent is as it is, or as it is at first.
 * @typedef {{t?: number, camera?: {yaw: number, pitch: number, distance: number, target: number[]}, panels?: string[],
 *   look?: string[], marks?: string, letter?: string, field?: string, touch?: number, span?: [number, number],
 *   loop?: [number, number], plots?: {field: string, column: string}[]}} ViewState
 */

/** So many digits after the point: 6 µs, 0.006°, 10 µm. */
const number = (/** @type {number} */ x, /** @type {number} */ digits) => String(Number(x.toFixed(digits)));

/** Signs that can stand in the end of an address as they are. */
const plain = (/** @type {string} */ text) =>
  encodeURIComponent(text).replace(/%(2C|2F|3A|20)/g, (_, code) =>
    code === "20" ? "+" : String.fromCharCode(parseInt(code, 16)),
  );

/**
 * @param {ViewState} state
 * @returns {string} without the sign before it
 */
export function toFragment(state) {
  const { camera } = state;
  /** @type {[string, string | undefined][]} */
  const parts = [
    ["t", state.t === undefined ? undefined : number(state.t, 6)],
    [
      "camera",
      camera &&
        [
          ...[camera.yaw, camera.pitch].map((angle) => number(angle, 4)),
          ...[camera.distance, ...camera.target].map((metres) => number(metres, 5)),
        ].join(),
    ],
    ["panels", state.panels?.join()],
    ["look", state.look?.join()],
    ["marks", state.marks],
    ["letter", state.letter],
    ["field", state.field],
    ["touch", state.touch?.toString()],
    ["span", state.span?.map((t) => number(t, 6)).join()],
    ["loop", state.loop?.map((t) => number(t, 6)).join()],
    ...(state.plots ?? []).map(
      ({ field, column }) => /** @type {[string, string]} */ (["plot", `${column},${field}`]),
    ),
  ];
  return parts.flatMap(([name, text]) => (text === undefined ? [] : [`${name}=${plain(text)}`])).join("&");
}

/**
 * Whatever cannot be read is left out: an address may come from anywhere.
 * @param {string} fragment with or without the sign before it
 * @returns {ViewState}
 */
export function fromFragment(fragment) {
  const said = new URLSearchParams(fragment.replace(/^#/, ""));
  /** @type {(name: string, count: number) => number[] | null} */
  const numbers = (name, count) => {
    const list = said.get(name)?.split(",").map(parseNumber) ?? [];
    return list.length === count && list.every(Number.isFinite) ? list : null;
  };
  const words = (/** @type {string} */ name) => said.get(name)?.split(",").filter(Boolean);
  /** @type {ViewState} */
  const state = {};
  const t = numbers("t", 1);
  if (t) state.t = t[0];
  const camera = numbers("camera", 6);
  if (camera && camera[2] > 0) {
    const [yaw, pitch, distance, ...target] = camera;
    state.camera = { yaw, pitch, distance, target };
  }
  const [panels, look] = [words("panels"), words("look")];
  if (panels) state.panels = panels;
  if (look) state.look = look;
  for (const name of /** @type {const} */ (["marks", "letter", "field"])) {
    const text = said.get(name);
    if (text) state[name] = text;
  }
  const touch = numbers("touch", 1);
  if (touch) state.touch = touch[0];
  for (const name of /** @type {const} */ (["span", "loop"])) {
    const ends = numbers(name, 2);
    if (ends && ends[1] > ends[0]) state[name] = [ends[0], ends[1]];
  }
  const plots = said.getAll("plot").flatMap((text) => {
    const comma = text.indexOf(",");
    return comma > 0 ? [{ column: text.slice(0, comma), field: text.slice(comma + 1) }] : [];
  });
  if (plots.length) state.plots = plots;
  return state;
}

/** @param {string} text */
function parseNumber(text) {
  return text.trim() === "" ? NaN : Number(text);
}

/**
 * An end of an address without its token.
 * @param {string} fragment with or without the sign before it
 */
export function withoutToken(fragment) {
  return fragment
    .replace(/^#/, "")
    .split("&")
    .filter((part) => part && !part.startsWith("token="))
    .join("&");
}

/** Colours of the picture in space, by the system's choice of dark or light. Those of the page are in style.css. */

const bytes = (/** @type {number[]} */ ...colour) => colour.map((part) => part / 255);

/** @type {Record<"dark" | "light", import("./body.js").Theme>} */
export const THEMES = {
  dark: {
    above: bytes(44, 47, 53),
    below: bytes(17, 18, 21),
    albedo: bytes(122, 127, 136),
    rim: bytes(36, 40, 48),
    ink: bytes(245, 246, 248),
  },
  light: {
    above: bytes(252, 252, 253),
    below: bytes(217, 221, 226),
    albedo: bytes(186, 190, 197),
    rim: bytes(20, 20, 22),
    ink: bytes(24, 26, 30),
  },
};

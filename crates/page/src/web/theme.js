/** Colours of the picture in space, by the system's choice of dark or light. Those of the page are in style.css. */

const bytes = (/** @type {number[]} */ ...colour) => colour.map((part) => part / 255);

/** @type {Record<"dark" | "light", import("./body.js").Theme>} */
export const THEMES = {
  dark: {
    above: bytes(46, 49, 56),
    below: bytes(18, 19, 22),
    albedo: bytes(168, 172, 180),
    rim: bytes(30, 33, 40),
    ink: bytes(16, 17, 20),
    rest: [134, 139, 148],
  },
  light: {
    above: bytes(253, 253, 254),
    below: bytes(214, 218, 224),
    albedo: bytes(206, 209, 214),
    rim: bytes(12, 12, 14),
    ink: bytes(24, 26, 30),
    rest: [176, 181, 189],
  },
};

// Colours of the page: text that can be read, and lines and marks that people who see colours differently tell apart.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { PALETTE } from "../../crates/page/src/web/dom.js";
import { DASHES } from "../../crates/page/src/web/plot.js";
import { dashesOf, TouchPast } from "../../crates/page/src/web/touch_plot.js";

const css = readFileSync(new URL("../../crates/page/src/web/style.css", import.meta.url), "utf8");

/** Variables of the dark scheme, and of the light one. */
const SCHEMES = (() => {
  const [dark, light] = [...css.matchAll(/:root \{([^}]*)\}/g)].map(([, body]) =>
    Object.fromEntries([...body.matchAll(/--([\w-]+):\s*([^;]+);/g)].map(([, name, value]) => [name, value])),
  );
  return { dark, light: { ...dark, ...light } };
})();

/** Red, green, blue and opacity of a colour of the style sheet. */
function parts(text) {
  const hex = /^#(..)(..)(..)$/.exec(text);
  if (hex) return [...hex.slice(1).map((part) => parseInt(part, 16)), 1];
  const [r, g, b, opacity = 1] = text.match(/[\d.]+/g).map(Number);
  return [r, g, b, opacity];
}

/** A colour laid over another one. */
const over = ([r, g, b, opacity], below) =>
  [r, g, b].map((part, k) => opacity * part + (1 - opacity) * below[k]).concat(1);

const linear = (part) => {
  const x = part / 255;
  return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
};

/** Contrast of two colours, as WCAG 2 has it. */
function contrast(a, b) {
  const [low, high] = [a, b]
    .map(([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b))
    .sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}

/** Texts with what they stand on. */
const TEXTS = [
  ["text", "page"],
  ["text", "panel"],
  ["text", "raised"],
  ["soft", "panel"],
  ["soft", "raised"],
  ["faint", "panel"],
  ["faint", "raised"],
  ["accent", "panel"],
  ["accent-text", "accent"],
  ["warn", "panel"],
  ["warn", "raised"],
  ["bad", "panel"],
  ["faint", "track"],
];

test("every text stands out by 4.5 to 1 in both schemes", () => {
  for (const [name, scheme] of Object.entries(SCHEMES)) {
    const colour = (of) => parts(scheme[of]);
    const seen = TEXTS.map(([of, on]) => [`${of} on ${on}`, contrast(colour(of), colour(on))]);
    // Over the picture, panels let something through: the lightest and the darkest of it.
    for (const behind of [
      [0, 0, 0, 1],
      [255, 255, 255, 1],
    ]) {
      if (name === "dark" && behind[0] === 255) continue;
      const float = over(colour("float"), behind);
      if (name === "light" && behind[0] === 0) continue;
      for (const of of ["text", "soft", "faint"]) seen.push([`${of} on float`, contrast(colour(of), float)]);
    }
    for (const [what, ratio] of seen) assert.ok(ratio >= 4.5, `${name}: ${what} is ${ratio.toFixed(2)} to 1`);
  }
});

/** What people without red (protanopia) or green (deuteranopia) cones see of linear light: Machado, Oliveira, Fernandes 2009. */
const BLINDNESS = {
  none: [1, 0, 0, 0, 1, 0, 0, 0, 1],
  protanopia: [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  deuteranopia: [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
};

/** Oklab, in which distances are about as large as they look. */
function oklab(colour, matrix) {
  const light = colour.slice(0, 3).map(linear);
  const [r, g, b] = [0, 3, 6].map((row) =>
    Math.max(
      0,
      light.reduce((sum, part, k) => sum + matrix[row + k] * part, 0),
    ),
  );
  const [l, m, s] = [
    0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b,
    0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b,
    0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b,
  ].map(Math.cbrt);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

const apart = (a, b, matrix) => {
  const [x, y] = [a, b].map((colour) => oklab(colour, matrix));
  return Math.hypot(...x.map((part, k) => part - y[k]));
};

/** Colours that are used together: as many as fields that are plotted at first. */
const TOGETHER = 5;
/** Least distance of two of them; that of two greys whose lightness differs by a tenth. */
const LEAST = 0.1;

test("colours that are used together differ, whatever cones one has", () => {
  for (const [name, matrix] of Object.entries(BLINDNESS)) {
    const first = PALETTE.slice(0, TOGETHER);
    for (let i = 0; i < first.length; i++)
      for (let k = 0; k < i; k++) {
        const distance = apart(first[i], first[k], matrix);
        assert.ok(distance >= LEAST, `${name}: ${k} and ${i} are ${distance.toFixed(3)} apart`);
      }
  }
  // The measure itself: red and green of one lightness are one colour without green cones.
  assert.ok(apart([200, 80, 60], [120, 125, 40], BLINDNESS.deuteranopia) < LEAST);
  assert.ok(apart([200, 80, 60], [120, 125, 40], BLINDNESS.none) > LEAST);
});

test("sensors of fig. 6, from black to red, are lighter the harder they are pressed, whatever cones one has", () => {
  const figures = readFileSync(new URL("../../src/experiments/figures.rs", import.meta.url), "utf8");
  assert.match(figures, /let colour = \[\(255\.0 \* signal\)\.round\(\) as u8, 0, 0\];/);
  const lightness = (colour, matrix) => oklab(colour, matrix)[0];
  for (const [name, matrix] of Object.entries(BLINDNESS))
    for (const third of [0, 1, 2]) {
      const [low, high] = [third, third + 1].map((part) => lightness([85 * part, 0, 0], matrix));
      assert.ok(high - low >= LEAST, `${name}: from ${low.toFixed(3)} to ${high.toFixed(3)}`);
    }
  // A colour without the light that they see would not do.
  assert.ok(lightness([0, 0, 85], BLINDNESS.none) - lightness([0, 0, 70], BLINDNESS.none) < LEAST);
});

/** What lies over each other on the body, and on the timeline. A diamond and a mark differ by their form, too. */
const MARKS = {
  "on the body": ["measure", ...PALETTE.slice(0, TOGETHER).map((colour) => [...colour, 1])],
  "diamond and distance": ["measure", "meeting"],
  "on the timeline": ["contact", "accent", "warn", "text", "track"],
};

test("a measured distance, the playhead and what is repeated differ from what they lie on", () => {
  for (const [name, scheme] of Object.entries(SCHEMES))
    for (const [cones, matrix] of Object.entries(BLINDNESS))
      for (const [where, marks] of Object.entries(MARKS)) {
        const colours = marks.map((mark) => (typeof mark === "string" ? parts(scheme[mark]) : mark));
        const from = where === "on the body" ? 1 : colours.length;
        for (let i = 0; i < from; i++)
          for (let k = i + 1; k < colours.length; k++) {
            const distance = apart(colours[i], colours[k], matrix);
            const what = `${name}, ${cones}, ${where}: ${marks[i]} and ${marks[k]}`;
            assert.ok(distance >= LEAST, `${what} are ${distance.toFixed(3)} apart`);
          }
      }
});

test("lines of touches of one colour differ by their dashes", () => {
  const touch = (id) => ({ id, total: 1, force: NaN });
  const past = new TouchPast();
  for (let id = 0; id < 6; id++) past.take(id, [touch(id)], () => 2);
  const dashes = dashesOf(past.within(0, 10)).slice(0, DASHES.length);
  assert.equal(new Set(dashes.map(String)).size, DASHES.length);
});

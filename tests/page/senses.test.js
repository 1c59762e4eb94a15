// Temperatures, distances and tangential forces on the page: their colours, legends, arrows and words.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { withUnit } from "../../crates/page/src/web/format.js";
import { ticksBetween } from "../../crates/page/src/web/legend.js";
import { letterName, Senses, unitOf } from "../../crates/page/src/web/senses.js";
import { coloursAt, folder, open, pause, picture, seek, settled, SOMATIC, view } from "./program.js";

const about = {
  shear: [1],
  tangents: [
    [
      [1, 0, 0],
      [0, 1, 0],
    ],
  ],
  temperature: [2, 4],
  proximity: [3, 5],
  temperature_colours: [],
  distance_colours: [],
  scales: {
    temperature: { least: 20, most: 40, from: "grown" },
    proximity: { least: 0, most: 0.08, from: "raw range" },
    shear: { least: 0, most: 0.3, from: "recording" },
  },
};
const [GOOD, MISSING, OUT_OF_RANGE, NOT_SENT] = [0, 1, 5, 7];

test("each sense shows its own taxels, and the others as not sent", () => {
  const senses = new Senses(about, 6);
  senses.take({
    pressure: Float32Array.of(2, 3, 25, 0.02, NaN, NaN),
    health: Uint8Array.of(GOOD, GOOD, GOOD, GOOD, MISSING, OUT_OF_RANGE),
    shear: Float32Array.of(0.3, -0.4),
  });
  const shown = (sense) => {
    const { values, health } = senses.shown(sense);
    return [Array.from(values, (x) => Number(x.toFixed(4))), [...health]];
  };
  assert.deepEqual(shown("pressure"), [
    [2, 3, NaN, NaN, NaN, NaN],
    [GOOD, GOOD, NOT_SENT, NOT_SENT, NOT_SENT, NOT_SENT],
  ]);
  assert.deepEqual(shown("shear")[0], [NaN, 0.5, NaN, NaN, NaN, NaN]);
  assert.deepEqual(shown("temperature"), [
    [NaN, NaN, 0.25, NaN, NaN, NaN],
    [NOT_SENT, NOT_SENT, GOOD, NOT_SENT, MISSING, NOT_SENT],
  ]);
  // Nothing is near the last one: it feels nothing, as one without pressure.
  assert.deepEqual(shown("proximity"), [
    [NaN, NaN, NaN, 0.25, NaN, 0],
    [NOT_SENT, NOT_SENT, NOT_SENT, GOOD, NOT_SENT, GOOD],
  ]);
  assert.deepEqual(
    senses.shearOf(1).map((x) => Number(x.toFixed(4))),
    [0.3, -0.4],
  );
  assert.equal(senses.shearOf(0), null);
});

test("the coldest of a scale has a colour, and what is beyond an end has that of the end", () => {
  const senses = new Senses(about, 6);
  const shown = (celsius) => {
    senses.take({
      pressure: Float32Array.of(0, 0, celsius, 0, 0, 0),
      health: new Uint8Array(6),
      shear: null,
    });
    return senses.shown("temperature").values[2];
  };
  assert.ok(shown(20) > 0 && shown(-5) > 0 && shown(20) < 1e-5);
  assert.deepEqual([shown(40), shown(99)], [1, 1]);
});

test("tangential forces have the scale of pressures where that is known by more", () => {
  const senses = new Senses(about, 6);
  const most = (shear, from) => {
    senses.scales = { ...about.scales, shear };
    return senses.shearEnds({ from })?.most ?? null;
  };
  const ends = (from) => ({ least: 0, most: 0.3, from });
  for (const from of ["recording", "grown"])
    assert.deepEqual(
      [most(ends("grown"), from), most(ends("recording"), from), most(null, from)],
      [0.3, 0.3, null],
    );
  for (const from of ["calibration", "raw range"])
    assert.deepEqual([most(ends("recording"), from), most(ends("raw range"), from)], [null, 0.3]);
});

test("the letter of pressure is called so where it is the only one", () => {
  const fields = (...letters) =>
    letters.map((letter) => ({ letter, sense: letter === "shear" ? "shear" : "pressure" }));
  assert.equal(letterName("sustained", fields("sustained", "shear")), "pressure");
  assert.equal(letterName("shear", fields("sustained", "shear")), "shear");
  assert.equal(letterName("sustained", fields("sustained", "change")), "sustained");
  assert.equal(letterName(null, fields(null)), "pressure");
});

test("changes of pressures are per second", () => {
  const units = (unit, quantity, name = "total") =>
    ["sustained", "change"].map((letter) => unitOf({ name, unit }, letter, quantity));
  assert.deepEqual(units("N", "N"), ["N", "N/s"]);
  assert.deepEqual(units("P", "count"), ["P", "count/s"]);
  assert.deepEqual(units("N", "N", "force"), ["N", "N"]);
  assert.deepEqual(units("m", "Pa", "centroid"), ["m", "m"]);
  assert.equal(unitOf(undefined, "change", "N"), "1");
  assert.equal(withUnit(1500, "count/s", "count"), "1500 counts/s");
});

test("a scale has both of its ends, and round ticks between", () => {
  assert.deepEqual(
    ticksBetween(20, 40).map(({ text }) => text),
    ["20", "25", "30", "35", "40"],
  );
  const odd = ticksBetween(21.37, 36.2);
  assert.deepEqual([odd[0].part, odd[0].text, odd.at(-1).part, odd.at(-1).text], [0, "21.4", 1, "36.2"]);
  assert.ok(odd.slice(1, -1).every(({ text }) => Number(text) % 5 === 0));
});

/** Places of taxels, m: four of three axes, two of temperature, two of proximity. */
const SKIN = [
  [1, 0, 0, "force3"],
  [2, 0.005, 0, "force3"],
  [3, 0, 0.005, "force3"],
  [4, 0.005, 0.005, "force3"],
  [11, 0.012, 0, "temperature"],
  [12, 0.012, 0.005, "temperature"],
  [21, 0.019, 0, "proximity"],
  [22, 0.019, 0.005, "proximity"],
];
const CALIBRATION =
  '[all]\nunit = "N"\np_max = 0.6\n[shear]\nslips_at = 0.6\n[temperature]\nraw_range = [0, 60]\n[proximity]\nunit = "mm"\nrange = 80\n';
let server;

before(async () => {
  const at = (name) => join(folder, name);
  const rows = SKIN.map(
    ([id, x, y, kind]) => `${id},pad,${x},${y},0,0,0,1,1.6e-5,${kind},${kind === "force3" ? "1,0,0" : ",,"}`,
  );
  writeFileSync(at("skin.csv"), `id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n${rows.join("\n")}\n`);
  writeFileSync(at("fields.toml"), '[[fields]]\nname = "pad"\ntaxels = ["0..=99"]\n');
  writeFileSync(at("senses.toml"), CALIBRATION);
  execFileSync(SOMATIC, ["author", "--csv-skin", at("skin.csv"), "-o", at("bare.glb")]);
  execFileSync(SOMATIC, ["author", at("bare.glb"), "--recipe", at("fields.toml"), "-o", at("senses.glb")]);
  const own = SKIN.map(([id]) => id);
  const pulled = [1, 2, 3, 4];
  const header = ["t", ...own, ...pulled.map((id) => `${id}.u`), ...pulled.map((id) => `${id}.v`)];
  // Pressed and pulled along x; the second proximity taxel has nothing near.
  const frame = (t) =>
    [t, 0.6, 0.3, 0.3, 0, 10, 50, 20, 90, 0.3, 0.15, 0.15, 0, 0, 0, 0, 0].map(String).join(",");
  writeFileSync(at("senses.csv"), `${header.join(",")}\n${frame(0)}\n${frame(0.5)}\n`);
  server = await view("--body", at("senses.glb"), "--calibration", at("senses.toml"), at("senses.csv"));
});

/** Colours of taxels by their ids, with the letter of a button of the legend. */
async function coloured(page, letter) {
  await page.locator(".legend-letters button", { hasText: new RegExp(`^${letter}$`) }).click();
  await settled(page);
  const places = await page.evaluate(() =>
    Array.from(window.somatic.model.mesh.taxelId, (_, taxel) => window.somatic.pixelOfTaxel(taxel)),
  );
  // Beside the middle, where arrows begin.
  const colours = await coloursAt(
    page,
    places.map(([x, y]) => [x, y + 9]),
  );
  return new Map(SKIN.map(([id], i) => [id, colours[i]]));
}

const near = (a, b) => a.every((part, k) => Math.abs(part - b[k]) <= 3);

test("a letter colours its taxels as its legend says, and no others", async () => {
  const { page, problems } = await open(server.url);
  await pause(page);
  await page.keyboard.press("0");
  await seek(page, 0.5);
  await page.keyboard.press("n");
  while ((await page.locator("#marks-choice").inputValue()) !== "none") await page.keyboard.press("m");
  const maps = await page.evaluate(() => {
    const { welcome, pressureColours } = window.somatic.model;
    const { temperature_colours, distance_colours } = welcome.senses;
    return { pressure: pressureColours, temperature: temperature_colours, proximity: distance_colours };
  });
  const at = (map, share) => maps[map][Math.round(255 * share)];
  const title = () => page.locator(".legend-title").textContent();
  const ticks = async () =>
    (await page.locator(".legend-ticks").allInnerTexts())[0].split(/\s+/).filter(Boolean);

  const pressures = await coloured(page, "pressure");
  await picture(page, "senses-pressure.png");
  assert.equal(await title(), "Force of a taxel, N");
  assert.ok(near(pressures.get(1), at("pressure", 1)), String(pressures.get(1)));
  assert.ok(near(pressures.get(2), at("pressure", 0.5)));
  assert.equal(await page.locator(".legend-arrow").textContent(), "arrow a taxel wide: 0.200 N");

  const temperatures = await coloured(page, "temperature");
  await picture(page, "senses-temperature.png");
  assert.equal(await title(), "Temperature, °C");
  assert.deepEqual(await ticks(), ["0", "20", "40", "60"]);
  assert.ok(near(temperatures.get(11), at("temperature", 10 / 60)), String(temperatures.get(11)));
  assert.ok(near(temperatures.get(12), at("temperature", 50 / 60)));
  assert.ok(!(await page.locator(".legend-arrow").isVisible()));

  const distances = await coloured(page, "proximity");
  await picture(page, "senses-proximity.png");
  assert.equal(await title(), "Distance, mm");
  assert.deepEqual(await ticks(), ["0", "20", "40", "60", "80"]);
  assert.ok(near(distances.get(21), at("proximity", 0.25)), String(distances.get(21)));
  const isColour = (colour) => Object.values(maps).some((map) => map.some((one) => near(one, colour)));
  // Nothing is near one, and the others read something else.
  for (const [seen, ids] of [
    [distances, [22, 11, 12, 4]],
    [temperatures, [1, 2, 21, 22]],
    [pressures, [11, 12, 21, 22]],
  ])
    for (const id of ids) assert.ok(!isColour(seen.get(id)), `${id} is ${seen.get(id)}`);

  const shears = await coloured(page, "shear");
  await picture(page, "senses-shear.png");
  assert.equal(await title(), "Shear of a taxel, N");
  assert.ok(near(shears.get(1), at("pressure", 0.5)), String(shears.get(1)));
  assert.deepEqual(problems, []);
  await page.close();
});

test("fields and percepts have the quantities of the letter, with their units", async () => {
  const { page } = await open(server.url);
  await pause(page);
  await seek(page, 0.5);
  const said = async (letter) => {
    await coloured(page, letter);
    await page.locator("#tree .field").first().click();
    await settled(page);
    const rows = await page
      .locator("#percept-values .output:visible")
      .evaluateAll((rows) =>
        rows.map((row) => [
          row.querySelector(".output-name").textContent,
          row.querySelector(".output-value").textContent.trim(),
        ]),
      );
    return { tree: await page.locator("#tree .field-value").first().textContent(), rows: new Map(rows) };
  };
  const temperature = await said("temperature");
  assert.equal(temperature.tree, "30 °C");
  assert.equal(temperature.rows.get("warmest"), "50 °C");
  assert.equal(temperature.rows.get("warmest taxel"), "12");
  assert.ok(!temperature.rows.has("peak") && !temperature.rows.has("nearest"));
  const proximity = await said("proximity");
  assert.equal(proximity.tree, "20.0 mm");
  assert.equal(proximity.rows.get("covered"), "1");
  const shear = await said("shear");
  assert.equal(shear.tree, "0.600 N");
  assert.equal(shear.rows.get("friction"), "0.500");
  const pressure = await said("pressure");
  assert.equal(pressure.rows.get("peak"), "0.600 N");
  assert.ok(!pressure.rows.has("friction") && !pressure.rows.has("temperature"));
  // What is shown is in the address.
  await coloured(page, "temperature");
  await page.waitForFunction(() => /letter=temperature/.test(location.href), null, { timeout: 20000 });
  await page.close();
});

test("arrows of tangential forces point where they pull", async () => {
  const { page } = await open(server.url);
  await pause(page);
  await seek(page, 0.5);
  const arrows = await page.evaluate(async () => {
    const { arrowOf } = await import("./arrows.js");
    const { model } = window.somatic;
    return [0, 1, 3, 4].map((taxel) => {
      const arrow = arrowOf(model, taxel);
      return arrow && arrow.to.map((x, k) => (x - arrow.from[k]) / (2 * model.mesh.taxelRadius[taxel]));
    });
  });
  // Half the highest pressure: half of three widths; x of a glTF is y of the world.
  const lengths = arrows.map((arrow) => arrow && Math.hypot(...arrow));
  assert.ok(Math.abs(lengths[0] - 1.5) < 1e-4 && Math.abs(lengths[1] - 0.75) < 1e-4, String(lengths));
  assert.ok(Math.abs(arrows[0][1] - 1.5) < 1e-4, String(arrows[0]));
  assert.deepEqual([lengths[2], lengths[3]], [0, null]);
  await page.close();
});

/** A temperature taxel at the place of a pressed one, and a recording without ends of its scales: first it is pressed and pulled, then
 * something is only near. */
async function mixed() {
  const at = (name) => join(folder, name);
  const rows = ["1,pad,0,0,0,0,0,1,1.6e-5,force3,1,0,0", "2,pad,0.005,0,0,0,0,1,1.6e-5,force3,1,0,0"];
  rows.push("11,pad,0,0,0,0,0,1,1.6e-5,temperature,,,", "21,pad,0.012,0,0,0,0,1,1.6e-5,proximity,,,");
  writeFileSync(at("mixed.csv"), `id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n${rows.join("\n")}\n`);
  writeFileSync(at("mixed-fields.toml"), '[[fields]]\nname = "pad"\ntaxels = ["0..=99"]\n');
  const calibration =
    '[all]\nunit = "N"\n[temperature]\nraw_range = [0, 60]\n[proximity]\nunit = "mm"\nrange = 80\n';
  writeFileSync(at("mixed.toml"), calibration);
  execFileSync(SOMATIC, ["author", "--csv-skin", at("mixed.csv"), "-o", at("mixed-bare.glb")]);
  const recipe = ["--recipe", at("mixed-fields.toml")];
  execFileSync(SOMATIC, ["author", at("mixed-bare.glb"), ...recipe, "-o", at("mixed.glb")]);
  const frames = ["0,1.4,0.7,50,70,0.3,0.15,0,0", "1,0,0,50,20,0,0,0,0"];
  writeFileSync(at("mixed-touch.csv"), `t,1,2,11,21,1.u,2.u,1.v,2.v\n${frames.join("\n")}\n`);
  return view("--body", at("mixed.glb"), "--calibration", at("mixed.toml"), at("mixed-touch.csv"));
}

test("what is shown lies above, is on its own scale, and says nothing of what was shown before", async () => {
  const own = await mixed();
  const { page, problems } = await open(own.url);
  const choose = async (letter) => {
    await page.locator(".legend-letters button", { hasText: new RegExp(`^${letter}$`) }).click();
    await settled(page);
  };
  await pause(page);
  await page.keyboard.press("0");
  await seek(page, 0);
  while ((await page.locator("#marks-choice").inputValue()) !== "none") await page.keyboard.press("m");
  // The thermistor itself is covered as long as pressures are shown.
  const [place, maps] = await page.evaluate(() => {
    const { welcome, pressureColours, mesh } = window.somatic.model;
    const [x, y] = window.somatic.pixelOfTaxel(mesh.taxelId.indexOf(1));
    return [[x, y + 5], { pressure: pressureColours, temperature: welcome.senses.temperature_colours }];
  });
  await choose("temperature");
  const [warm] = await coloursAt(page, [place]);
  await picture(page, "senses-above.png");
  assert.ok(near(warm, maps.temperature[Math.round((255 * 50) / 60)]), String(warm));
  await choose("pressure");
  const [pressed] = await coloursAt(page, [place]);
  assert.ok(near(pressed, maps.pressure[255]), String(pressed));
  // The recording's most pressure is 1.4 N, and 0.3 N pull.
  const [title, source] = [page.locator(".legend-title"), page.locator(".legend-source")];
  const last = async () => Number((await page.locator(".legend-ticks span").allInnerTexts()).at(-1));
  assert.deepEqual([await last(), await source.textContent()], [1.4, "fixed to the recording’s maximum"]);
  await choose("shear");
  assert.equal(await title.textContent(), "Shear of a taxel, N");
  assert.deepEqual([await last(), await source.textContent()], [0.3, "fixed to the recording’s maximum"]);
  // An autoscale is of what is shown.
  await page.locator(".legend-head button").click();
  assert.equal(await last(), 0.3);
  await choose("pressure");
  assert.equal(await last(), 1.4);
  await page.locator(".legend-head button").click();

  await seek(page, 1);
  await choose("proximity");
  const caption = page.locator("#bar-scale");
  assert.equal(await caption.textContent(), "full bar: 20.0 mm");
  await choose("shear");
  assert.equal(await caption.textContent(), "");
  assert.deepEqual(problems, []);
  await page.close();
  await own.stop();
});

test("a body of pressures alone has no such buttons, arrows or bytes", async () => {
  const plain = await view("hand");
  const { page } = await open(plain.url);
  const found = await page.evaluate(() => [
    window.somatic.model.senses,
    window.somatic.model.welcome.senses,
    document.querySelector(".legend-letters").hidden,
    document.querySelector(".legend-arrow").hidden,
  ]);
  assert.deepEqual(found, [null, null, true, true]);
  await page.close();
  await plain.stop();
});

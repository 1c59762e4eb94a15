// Situations that users come into, in a real Chromium: runs without totals, links in a new tab, phones, bodies at rest.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { chromium } from "playwright-core";
import {
  coloursAt,
  folder,
  LAUNCH,
  open,
  overlay,
  pause,
  picture,
  seek,
  serve,
  settled,
  SOMATIC,
  taxelIds,
  view,
  writeRecording,
} from "./program.js";

/** What the page says of its connection; nothing while all is well. */
const banner = (page) =>
  page.evaluate(() => {
    const banner = document.querySelector("#banner");
    return banner.hidden ? "" : banner.textContent;
  });

test("a run without totals is plotted and coloured by what it has", async () => {
  for (const outputs of ["centroid,touches", "peak", "orientation"]) {
    const server = await view("--outputs", outputs);
    const { page, problems } = await open(server.url);
    await pause(page);
    await seek(page, 2.9);
    await page.waitForFunction(() => document.querySelectorAll(".plot .chip").length > 0, null, {
      timeout: 20000,
    });
    assert.equal(await banner(page), "", outputs);
    const state = await page.evaluate(() => window.somatic.model.connection.state);
    assert.equal(state, "open", outputs);
    const chips = await page.locator(".chip").allInnerTexts();
    const [first] = outputs.split(",");
    assert.ok(
      chips.every((chip) => chip.includes(` ${first}`)),
      `${chips}`,
    );
    // The fields that are plotted are touched by now, and each has the colour of its row in the tree.
    const colours = await page.evaluate(() =>
      [...document.querySelectorAll(".chip")].map((chip) => ({
        name: chip.title,
        colour: chip.querySelector("i").style.background.match(/rgb\([^)]*\)/)[0],
      })),
    );
    for (const { name, colour } of colours) {
      const dot = await page.evaluate(
        (name) => document.querySelector(`.field[title="${name}"] .field-dot`).style.background,
        name,
      );
      assert.equal(dot, colour, name);
    }
    assert.deepEqual(problems, []);
    await page.close();
    await server.stop();
  }
});

test("a link in a new tab opens by the token of a tab that is open, and elsewhere by the address", async () => {
  const server = await view();
  const { page } = await open(server.url);
  await pause(page);
  await seek(page, 2.9);
  await page.keyboard.press("l");
  const link = await page.evaluate(() => location.href);
  assert.match(link, /#t=2\.9&camera=/);
  assert.doesNotMatch(link, /token/);
  assert.match(await page.locator("#hint").innerText(), /without the token/);
  const { page: other, problems } = await open(link);
  await other.waitForFunction(() => Math.abs(window.somatic.model.frame?.t - 2.9) < 1e-9);
  assert.equal(await banner(other), "");
  // In another browser no tab can give it.
  const stranger = await chromium.launch(LAUNCH);
  const context = await stranger.newContext();
  await overlay(context);
  const third = await context.newPage();
  await third.goto(link);
  await third.locator("#token-form").waitFor({ state: "visible" });
  assert.match(await banner(third), /has no token/);
  await third.fill("#token-box", "http://127.0.0.1/#token=short");
  await third.click("#token-form button");
  assert.equal(await third.evaluate(() => document.querySelector("#token-box").validity.valid), false);
  await third.fill("#token-box", server.url);
  await third.click("#token-form button");
  await third.waitForFunction(() => Math.abs(window.somatic.model.frame?.t - 2.9) < 1e-9);
  assert.equal(await third.locator("#token-form").isVisible(), false);
  assert.equal(await banner(third), "");
  await stranger.close();
  assert.deepEqual(
    problems.filter((problem) => !/WebSocket/.test(problem)),
    [],
  );
  await other.close();
  await page.close();
  await server.stop();
});

/** Boxes of what can be pressed or read at the stage and below it. */
const PARTS = ["#bar", "#views", "#looks", "#legend", "#scale-bar", "#timeline", "#side", "#help-button"];

test("on a phone nothing overlaps, two fingers zoom and pan, and a tap describes a taxel", async () => {
  const server = await view();
  const phone = await chromium.launch(LAUNCH);
  const context = await phone.newContext({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  await overlay(context);
  const page = await context.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  await page.goto(server.url);
  await page.waitForFunction(() => window.somatic?.firstPictureMs > 0, null, { timeout: 60000 });
  await page.tap("#play");
  await page.waitForFunction(() => !window.somatic.model.status.playing);
  await seek(page, 2.9);
  await settled(page);
  await picture(page, "phone.png");
  const boxes = await page.evaluate(
    (parts) =>
      parts.map((part) => {
        const { left, top, right, bottom } = document.querySelector(part).getBoundingClientRect();
        return { part, left, top, right, bottom };
      }),
    PARTS,
  );
  const controls = await page.evaluate(() =>
    [...document.querySelectorAll("#timeline > *, #bar > *, #views > *, #looks > *")].flatMap((part) => {
      const { left, top, right, bottom } = part.getBoundingClientRect();
      return right > left ? [{ part: part.id || part.textContent, left, top, right, bottom }] : [];
    }),
  );
  for (const [i, a] of controls.entries())
    for (const b of controls.slice(0, i)) {
      const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
      assert.ok(apart, `${a.part} lies over ${b.part}`);
    }
  for (const a of boxes) {
    assert.ok(
      a.left >= 0 && a.right <= 390.5 && a.bottom - a.top > 8,
      `${a.part} is cut off: ${JSON.stringify(a)}`,
    );
    for (const b of boxes) {
      const inside = a.part === b.part || [a.part, b.part].sort().join() === "#bar,#help-button";
      const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
      assert.ok(inside || apart, `${a.part} lies over ${b.part}`);
    }
  }
  const [help] = boxes.filter((box) => box.part === "#help-button");
  assert.ok(help.right - help.left >= 30 && help.top >= 0, "the help can be tapped");
  // The whole timeline can be reached: its canvas is wide enough to point at a moment.
  const canvas = await page.locator("#timeline-canvas").boundingBox();
  assert.ok(canvas.width > 300, `${canvas.width} pixels of timeline`);
  await page.touchscreen.tap(canvas.x + canvas.width / 2, canvas.y + 15);
  await page.waitForFunction(() => Math.abs(window.somatic.model.frame.t - 2.79) < 0.1);
  // A tap.
  const at = await page.evaluate(() => {
    const { model, pixelOfTaxel } = window.somatic;
    const legend = document.querySelector("#legend").getBoundingClientRect();
    const places = Array.from(model.mesh.taxelId, (_, taxel) => pixelOfTaxel(taxel));
    return places.find((place) => place && place[1] > 130 && place[1] < legend.top - 10);
  });
  await page.touchscreen.tap(at[0], at[1]);
  await page.locator("#tip").waitFor({ state: "visible" });
  assert.match(await page.locator("#tip").innerText(), /^Taxel \d+/);
  // Two fingers.
  const client = await context.newCDPSession(page);
  const fingers = (type, points) =>
    client.send("Input.dispatchTouchEvent", {
      type,
      touchPoints: points.map(([x, y], id) => ({ x, y, id })),
    });
  const camera = () =>
    page.evaluate(() => {
      const { distance, target, yaw, pitch } = window.somatic.camera;
      return { distance, target: [...target], yaw, pitch };
    });
  const before = await camera();
  await fingers("touchStart", [
    [150, 250],
    [240, 250],
  ]);
  for (let i = 1; i <= 6; i++)
    await fingers("touchMove", [
      [150 - 10 * i, 250],
      [240 + 10 * i, 250],
    ]);
  const zoomed = await camera();
  assert.ok(zoomed.distance < 0.6 * before.distance, `${before.distance} to ${zoomed.distance} m away`);
  assert.deepEqual([zoomed.yaw, zoomed.pitch], [before.yaw, before.pitch], "two fingers do not turn it");
  for (let i = 1; i <= 6; i++)
    await fingers("touchMove", [
      [90, 250 + 10 * i],
      [300, 250 + 10 * i],
    ]);
  const moved = await camera();
  const shift = Math.hypot(...moved.target.map((x, k) => x - zoomed.target[k]));
  assert.ok(shift > 0.02 * moved.distance, `moved by ${shift} m`);
  await fingers("touchEnd", []);
  assert.deepEqual(problems, []);
  await phone.close();
  await server.stop();
});

test("a body at rest has the colours of its fields, and says its spacing and what is odd", async () => {
  const sheet = join(folder, "rest.glb");
  execFileSync(SOMATIC, ["author", "--grid", "12x8", "--pitch", "5mm", "-o", sheet]);
  for (const body of ["hand", sheet]) {
    const server = await view(body);
    const { page, problems } = await open(server.url);
    await page.waitForFunction(() => window.somatic.model.isAtRest);
    await settled(page);
    await picture(page, `rest-${body === "hand" ? "hand" : "sheet"}.png`);
    assert.equal(await page.locator("#legend").isVisible(), false, "it has no pressures");
    assert.doesNotMatch(await page.locator("body").innerText(), /missing/);
    await page.waitForFunction(() => window.somatic.model.events.length > 0, null, { timeout: 60000 });
    const said = await page.locator("#rest-panel").innerText();
    assert.match(said, /spacing/);
    if (body === sheet) assert.match(said, /median 5\.00 mm, least 5\.00 mm/);
    assert.ok((await page.locator(".finding").count()) > 0 && !/Looking for/.test(said), said);
    assert.equal(await banner(page), "");
    const seen = await page.evaluate(() => {
      const { model, pixelOfTaxel } = window.somatic;
      return Array.from(model.mesh.taxelId, (_, taxel) => ({
        at: pixelOfTaxel(taxel),
        colour: model.colourAtRest(taxel),
      })).filter(({ at, colour }) => at && colour);
    });
    assert.ok(seen.length > 4, `${seen.length} taxels in sight`);
    const colours = await coloursAt(
      page,
      seen.map(({ at }) => at),
    );
    colours.forEach((colour, i) => {
      const off = Math.max(...colour.map((part, k) => Math.abs(part - seen[i].colour[k])));
      assert.ok(off <= 2, `${colour} is not ${seen[i].colour}`);
    });
    assert.deepEqual(problems, []);
    await page.close();
    await server.stop();
  }
});

test("taxels that a source lacks have no rings, and those that it should have sent do", async () => {
  const ids = taxelIds("hand");
  const half = ids.slice(0, ids.length / 2);
  // The first taxel's column is there, but empty.
  const name = writeRecording("half.csv", half, 50, 0.02, () => half.map((_, i) => (i === 0 ? "" : 5)));
  const server = await view(name, "--body", "hand");
  const { page } = await open(server.url);
  await pause(page);
  await seek(page, 0.5);
  const counts = await page.evaluate(() => {
    const counts = {};
    for (const state of window.somatic.model.health) counts[state] = (counts[state] ?? 0) + 1;
    return counts;
  });
  assert.deepEqual(counts, { 0: half.length - 1, 1: 1, 7: ids.length - half.length });
  const legend = await page.locator("#legend").innerText();
  assert.match(legend, /1 missing/);
  assert.match(legend, new RegExp(`${ids.length - half.length} not sent`));
  await page.close();
  await server.stop();
});

test("the next touch is a key away, events of a recording are listed once, and the view is a PNG", async () => {
  const server = await view();
  const { page, problems } = await open(server.url);
  await pause(page);
  await page.waitForFunction(
    () => window.somatic.model.timeline.until >= window.somatic.model.welcome.time.end_s,
    null,
    { timeout: 60000 },
  );
  await seek(page, 0);
  const frames = execFileSync(
    SOMATIC,
    ["run", "--quiet", "--backend", "cpu", "--outputs", "touches", "--sink", "-"],
    { encoding: "utf8", maxBuffer: 1e9 },
  )
    .trim()
    .split("\n")
    .map((line) => JSON.parse(line));
  const begins = frames.filter((f, i) => f.touches.length && (i === 0 || !frames[i - 1].touches.length));
  const now = () => page.evaluate(() => window.somatic.model.frame.t);
  for (const { t } of begins.slice(0, 3)) {
    await page.keyboard.press("r");
    await page.waitForFunction((t) => Math.abs(window.somatic.model.frame.t - t) < 0.025, t);
    assert.ok(await page.evaluate(() => window.somatic.model.touches.length > 0), `at ${await now()} s`);
  }
  await page.keyboard.press("w");
  await page.waitForFunction((t) => Math.abs(window.somatic.model.frame.t - t) < 0.025, begins[1].t);
  // Played twice over the same touch.
  for (let i = 0; i < 2; i++) {
    // Another moment each time: the same link twice changes nothing.
    await seek(page, 0.3 + 0.02 * i);
    await page.keyboard.press(" ");
    await page.waitForFunction(() => window.somatic.model.frame.t > 1, null, { timeout: 30000 });
    await pause(page);
  }
  const events = await page.evaluate(() => window.somatic.model.events);
  const ids = frames.map((frame) => frame.touches.map((touch) => touch.id));
  const expected = frames.flatMap(({ t }, i) => [
    ...(ids[i - 1] ?? []).filter((id) => !ids[i].includes(id)).map((id) => [t, "release", id]),
    ...ids[i].filter((id) => !(ids[i - 1] ?? []).includes(id)).map((id) => [t, "onset", id]),
  ]);
  assert.deepEqual(
    events.map((event) => [event.t_s, event.kind, event.touch]),
    expected,
  );
  assert.ok(expected.length > 6);
  // A click on one goes there, whatever is played.
  await page.evaluate(() => (document.querySelector("#events-panel").open = true));
  await page.locator(".event.onset").last().click();
  await page.waitForFunction((t) => Math.abs(window.somatic.model.frame.t - t) < 1e-9, begins[0].t);
  // Of a press of the button, with the body, the marks and the colours.
  await seek(page, 2.9);
  const waits = page.waitForEvent("download");
  await page.click("#photo");
  const download = await waits;
  assert.equal(download.suggestedFilename(), "hand-2.90s.png");
  const path = join(folder, "photo.png");
  await download.saveAs(path);
  const bytes = readFileSync(path);
  assert.deepEqual([...bytes.subarray(1, 4)].map((b) => String.fromCharCode(b)).join(""), "PNG");
  const size = await page.evaluate(() => {
    const stage = document.querySelector("#stage");
    return [stage.clientWidth, stage.clientHeight];
  });
  assert.deepEqual([bytes.readUInt32BE(16), bytes.readUInt32BE(20)], size);
  // It is no blank: the colour of a pressed taxel is in it.
  const found = await page.evaluate(async (data) => {
    const { model } = window.somatic;
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const box = document.querySelector("#stage").getBoundingClientRect();
    return Array.from(model.pressure, (p, taxel) => ({ p, at: window.somatic.pixelOfTaxel(taxel) }))
      .filter(({ p, at }) => p > 0 && at)
      .map(({ p, at }) => ({
        colour: model.welcome.colours[Math.round(Math.min(1, p / model.scaleMax) * 255)],
        seen: Array.from(
          context.getImageData(Math.round(at[0] - box.left), Math.round(at[1] - box.top), 1, 1).data,
        ),
      }));
  }, bytes.toString("base64"));
  const right = found.filter(({ colour, seen }) => colour.every((part, k) => Math.abs(part - seen[k]) <= 3));
  assert.ok(right.length > 2, JSON.stringify(found));
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("a long path is cut off at its beginning", async () => {
  const name = `${"long_".repeat(12)}recording.csv`;
  const ids = taxelIds("hand");
  writeFileSync(join(folder, name), `t,${ids.join(",")}\n0,${ids.map(() => 1).join(",")}\n`);
  const server = await view(join(folder, name), "--body", "hand");
  const { page } = await open(server.url);
  const said = await page.locator("#source-name").innerText();
  assert.ok(said.length <= 40 && said.startsWith("…") && said.endsWith("recording.csv"), said);
  await page.close();
  await server.stop();
});

test("boards are listed with their states and rates, also when they have gone", async (t) => {
  const boards = spawn(
    SOMATIC,
    ["board", "--boards", "2", "--loop", "--json", "--link", join(folder, "line")],
    {
      stdio: ["ignore", "pipe", "inherit"],
    },
  );
  t.after(() => boards.kill("SIGKILL"));
  const [said] = await once(boards.stdout, "data");
  const { playing } = JSON.parse(String(said).split("\n")[0]);
  const sources = playing.flatMap(({ link }) => ["--source", `serial:${link}`]);
  const sink = ["--sink", "page:127.0.0.1:0"];
  const server = await serve("run", "--quiet", "--backend", "cpu", "--body", "hand", ...sources, ...sink);
  const { page, problems } = await open(server.url);
  const panel = page.locator("#boards-panel");
  await panel.locator("summary").click({ timeout: 30000 });
  await page.waitForFunction(
    () => window.somatic.model.boards.filter(({ rate_hz }) => rate_hz > 1).length === 2,
    null,
    { timeout: 30000 },
  );
  assert.equal(await page.locator("#board-count").innerText(), "2 speaking");
  const rows = await page.locator(".board").allInnerTexts();
  assert.equal(rows.length, 2);
  for (const row of rows) assert.match(row, /speaking[^]*[1-9][\d.]* Hz · [1-9]\d* frames · none lost/);
  await picture(page, "boards.png");
  const ended = once(boards, "exit");
  boards.kill("SIGKILL");
  await ended;
  await page.waitForFunction(
    () => document.querySelector("#board-count").textContent === "0 of 2 speaking",
    null,
    {
      timeout: 30000,
    },
  );
  assert.equal(await page.locator(".board.bad").count(), 2);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

// Two recordings side by side in a real Chromium: one clock, and each its own frames and touches.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, folder, picture, SOMATIC, taxelIds, view, writeRecording } from "./program.js";

const ids = taxelIds("hand");
/** The taxel `id` is pressed, harder and harder. */
const pressed = (id) => (n) => ids.map((other) => (other === id ? n : 0));

/** The pages of both recordings, once they are drawn. */
async function openPair(url) {
  const page = await browser.newPage();
  const problems = [];
  page.on("pageerror", (error) => problems.push(String(error)));
  page.on("console", (line) => line.type() === "error" && problems.push(line.text()));
  await page.goto(url);
  await page.waitForFunction(() => window.length === 2);
  const frames = await Promise.all(
    (await page.locator("iframe").elementHandles()).map((handle) => handle.contentFrame()),
  );
  for (const frame of frames)
    await frame.waitForFunction(() => window.somatic?.firstPictureMs > 0, null, { timeout: 60000 });
  return { page, problems, frames };
}

/** Seconds since the beginning of the recording that a page shows. */
const shown = (frame) =>
  frame.evaluate(() => window.somatic.model.frame.t - window.somatic.model.welcome.time.start_s);

/** Waits until a page shows a time since the beginning of its recording. */
const waitFor = (frame, t) =>
  frame.waitForFunction(
    (t) => {
      const { model } = window.somatic;
      return Math.abs(model.frame.t - model.welcome.time.start_s - t) < 1e-6;
    },
    t,
    { timeout: 60000 },
  );

const waitPlaying = (frames, playing) =>
  Promise.all(
    frames.map((frame) =>
      frame.waitForFunction((playing) => window.somatic.model.status.playing === playing, playing, {
        timeout: 60000,
      }),
    ),
  );

test("two recordings play by one clock, from their beginnings to the end of the longer one", async () => {
  writeRecording("short.csv", ids, 401, 0.01, pressed(4));
  // Another rate, and another clock's time.
  const rows = Array.from({ length: 301 }, (_, n) => [1000 + n / 50, ...pressed(40)(n)].join(","));
  writeFileSync(join(folder, "long.csv"), `t,${ids.join(",")}\n${rows.join("\n")}\n`);
  const server = await view("short.csv", "--body", "hand", "--beside", "long.csv");
  const { page, problems, frames } = await openPair(server.url);
  assert.ok(!page.url().includes("token"), "the token stays in the address");
  const [short, long] = frames;
  assert.deepEqual(await Promise.all(frames.map((frame) => frame.locator("#source-name").innerText())), [
    "short.csv",
    "long.csv",
  ]);
  const maxima = await Promise.all(
    frames.map((frame) => frame.evaluate(() => window.somatic.model.scaleMax)),
  );
  assert.equal(maxima[0], maxima[1], "a colour is the same pressure in both");
  // One set of buttons moves both.
  assert.deepEqual(await Promise.all(frames.map((frame) => frame.locator("#play").isVisible())), [
    true,
    false,
  ]);

  /** Waits until the times that are shown are as a test wants them. */
  const until = async (areFit) => {
    let times = [];
    for (let tries = 0; tries === 0 || !areFit(...times); tries++) {
      assert.ok(tries < 200, `shown are ${times}`);
      if (tries) await page.waitForTimeout(100);
      times = await Promise.all(frames.map(shown));
    }
  };
  const begin = async () => {
    await short.evaluate(() => (location.hash = "#t=0"));
    await Promise.all([waitFor(short, 0), waitFor(long, 0)]);
    await waitPlaying(frames, false);
    await short.locator("#play").click();
    await waitPlaying(frames, true);
  };
  await begin();
  await until((a) => a > 0.5);
  const [a, b] = await Promise.all(frames.map(shown));
  assert.ok(Math.abs(a - b) < 0.4, `${a} s and ${b} s`);

  // A pause in either is one of both, at the same moment.
  await long.locator("#marks").focus();
  await page.keyboard.press(" ");
  await waitPlaying(frames, false);
  await until((a, b) => Math.abs(a - b) < 0.0201);

  // A jump in either is one of both, and each has its own touch there.
  await short.evaluate(() => (location.hash = "#t=2.5"));
  await Promise.all([waitFor(short, 2.5), waitFor(long, 2.5)]);
  const pressedIds = (frame) =>
    frame.evaluate(() => {
      const { mesh, pressure } = window.somatic.model;
      return Array.from(mesh.taxelId).filter((_, taxel) => pressure[taxel] > 0);
    });
  assert.deepEqual(await Promise.all(frames.map(pressedIds)), [[4], [40]]);
  await page.waitForTimeout(600);
  await picture(page, "pair.png");

  // The shorter one waits at its end, and does not look lost.
  await long.evaluate(() => (location.hash = "#t=1002"));
  await waitFor(short, 2);
  await short.locator("#play").click();
  await long.waitForFunction(() => window.somatic.model.frame.t > 1005.5, null, { timeout: 60000 });
  assert.ok(Math.abs((await shown(short)) - 4) < 1e-6);
  assert.equal(await short.evaluate(() => window.somatic.model.connection.state), "open");
  await waitPlaying(frames, false);
  assert.ok(Math.abs((await shown(long)) - 6) < 1e-6);
  // From the end of both it begins again.
  await short.locator("#play").click();
  await waitPlaying(frames, true);
  await page.waitForTimeout(800);
  for (const t of await Promise.all(frames.map(shown))) assert.ok(t < 3.5, `${t} s`);

  // Turning the one body turns the other.
  await long.locator("#marks").focus();
  await page.keyboard.press("2");
  await short.waitForFunction(() => window.somatic.camera.yaw === Math.PI, null, { timeout: 20000 });
  assert.equal(await short.evaluate(() => window.somatic.camera.pitch), 0);
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

test("one recording alone has no second page, and a body at rest is not shown beside one", async () => {
  const server = await view();
  const { origin } = new URL(server.url);
  for (const path of ["/pair.html", "/beside/"]) assert.equal((await fetch(origin + path)).status, 404, path);
  await server.stop();
  for (const parts of [
    ["hand", "--beside", "short.csv"],
    ["short.csv", "--beside", "mat"],
  ]) {
    const { status, stderr } = spawnSync(SOMATIC, ["view", ...parts], { cwd: folder, encoding: "utf8" });
    assert.equal(status, 2, stderr);
  }
});

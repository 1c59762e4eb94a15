// How fast the page is: its first picture, and drawings a second while a recording plays, still and while the body turns; and the
// same of a page that clears as many pixels and does nothing else. By itself it looks at 960 taxels. To measure more:
//
//     TAXELS=960,5000,50000 SOMATIC=… CHROMIUM=… node --test speed.test.js
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { browser, folder, open, picture, SOMATIC, view, writeRecording } from "./program.js";

/** How many taxels the skins have. */
const SIZES = (process.env.TAXELS ?? "960").split(",").map(Number);
/** Of the recordings, by the most taxels: frames a second. */
const RATES_HZ = new Map([
  [1000, 250],
  [10_000, 100],
  [Infinity, 10],
]);
const LENGTH_S = 10;
/** A window in which drawings are counted. */
const WINDOW_MS = 3000;
/** Other programs take the processor for a while: the best of some windows counts. */
const WINDOWS = 3;

/** A dented ball of twice as many triangles as `taxels`, and a skin on it; the bundled robot has 960. */
function bodyOf(taxels) {
  if (taxels === 960) return "humanoid";
  const rows = Math.round(Math.sqrt(taxels / 2));
  const columns = 2 * rows;
  const lines = [];
  for (let row = 0; row < rows; row++)
    for (let column = 0; column < columns; column++) {
      const [up, around] = [(Math.PI * (row + 0.5)) / rows, (2 * Math.PI * column) / columns];
      const radius = 0.5 * (1 + 0.15 * Math.sin(3 * around) * Math.sin(2 * up));
      const flat = radius * Math.sin(up);
      lines.push(`v ${flat * Math.cos(around)} ${radius * Math.cos(up)} ${-flat * Math.sin(around)}`);
    }
  for (let row = 0; row + 1 < rows; row++)
    for (let column = 0; column < columns; column++) {
      const [a, b] = [column, (column + 1) % columns].map((at) => 1 + row * columns + at);
      lines.push(`f ${a} ${a + columns} ${b}`, `f ${b} ${a + columns} ${b + columns}`);
    }
  const [mesh, body] = [`ball_${taxels}.obj`, `ball_${taxels}.glb`];
  writeFileSync(join(folder, mesh), lines.join("\n"));
  const words = ["author", mesh, "--taxels", String(taxels), "--even", "off", "--hidden", "keep", "-o", body];
  execFileSync(SOMATIC, words, { cwd: folder, stdio: "ignore" });
  return join(folder, body);
}

/** Waves of pressure that run over a body: about a third of its taxels are pressed, and change with every frame. */
function recordingOf(body, count) {
  const said = execFileSync(SOMATIC, ["inspect", body, "--json"], { encoding: "utf8", maxBuffer: 1e9 });
  const { taxels } = JSON.parse(said);
  assert.equal(taxels.length, count);
  const rate = [...RATES_HZ].find(([most]) => count <= most)[1];
  const phase = taxels.map(({ position: [x, y, z] }, i) => (count === 960 ? i / 40 : 9 * x + 7 * y + 5 * z));
  const row = (n) => phase.map((at) => Math.max(0, Math.round(400 * Math.sin(at + (4 * n) / rate) - 200)));
  const ids = taxels.map(({ id }) => id);
  return { file: writeRecording(`waves_${count}.csv`, ids, LENGTH_S * rate, 1 / rate, row), rate };
}

/** The most drawings a second in some windows, by what is done before each of the browser's. */
async function drawings(page, move) {
  let most = 0;
  for (let window = 0; window < WINDOWS; window++) {
    const rate = page.evaluate(
      async ([ms, move]) => {
        const { camera } = window.somatic;
        const [drawn, since] = [window.somatic.framesDrawn, performance.now()];
        while (performance.now() - since < ms) {
          if (move) camera.orbit(0.02, 0);
          await new Promise(requestAnimationFrame);
        }
        return (1000 * (window.somatic.framesDrawn - drawn)) / (performance.now() - since);
      },
      [WINDOW_MS, move],
    );
    most = Math.max(most, await rate);
  }
  return most;
}

/** Drawings a second of a page that only clears the screen. */
async function clears({ width, height }) {
  const page = await browser.newPage();
  await page.setContent(`<body style="margin:0"><canvas width="${width}" height="${height}"></canvas>`);
  const rate = await page.evaluate(async (ms) => {
    const gl = document.querySelector("canvas").getContext("webgl2", { antialias: false, alpha: false });
    let drawn = 0;
    const since = performance.now();
    while (performance.now() - since < ms) {
      await new Promise(requestAnimationFrame);
      gl.clearColor(0, (drawn % 10) / 10, 0, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      drawn += 1;
    }
    return (1000 * drawn) / (performance.now() - since);
  }, WINDOW_MS);
  await page.close();
  return rate;
}

for (const count of SIZES)
  test(`${count} taxels are drawn fast enough`, async () => {
    const body = bodyOf(count);
    const { file, rate } = recordingOf(body, count);
    const begun = performance.now();
    const server = await view(file, "--body", body);
    const address = performance.now() - begun;
    const { page, problems } = await open(server.url);
    const first = await page.evaluate(() => window.somatic.firstPictureMs);
    // Played again and again.
    await page.keyboard.press("\\");
    const [still, moving] = [await drawings(page, false), await drawings(page, true)];
    const size = await page.evaluate(() => {
      const { clientWidth: width, clientHeight: height } = document.getElementById("scene");
      return { width, height, renderer: window.somatic.renderer };
    });
    await picture(page, `speed_${count}.png`);
    await page.close();
    await server.stop();
    const empty = await clears(size);
    console.log(
      `${count} taxels at ${rate} Hz: address after ${Math.round(address)} ms, first picture after ` +
        `${Math.round(first)} ms, ${still.toFixed(1)} drawings/s still, ${moving.toFixed(1)} moving; ` +
        `an empty page of ${size.width} × ${size.height}: ${empty.toFixed(1)} (${size.renderer})`,
    );
    assert.deepEqual(problems, []);
    assert.ok(still > 0.5 && moving > 0.5, `${still} and ${moving} drawings/s`);
  });

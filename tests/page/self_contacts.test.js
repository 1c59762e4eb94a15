// Links that joints move, and where they touch each other, in a real Chromium.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { coloursAt, folder, open, picture, seek, SOMATIC, view } from "./program.js";

const example = (name) => fileURLToPath(new URL(`../../examples/robots/${name}`, import.meta.url));

test("a gripper that joints close is marked and listed where it touches itself", async () => {
  execFileSync(SOMATIC, ["author", "--urdf-skin", example("gripper.urdf"), "-o", "gripper.glb"], {
    cwd: folder,
    stdio: "ignore",
  });
  const scene = `body = "gripper.glb"
source = ${JSON.stringify(example("gripper-touch.csv"))}
joints = ${JSON.stringify(example("gripper.urdf"))}
joint_states = ${JSON.stringify(example("gripper-joints.csv"))}
calibration = "pascal.toml"
up = "z"
outputs = ["total", "position", "touches", "self_contacts"]
`;
  writeFileSync(join(folder, "gripper.scene.toml"), scene);
  writeFileSync(join(folder, "pascal.toml"), '[all]\nunit = "Pa"\n');
  const server = await view("gripper.scene.toml");
  const { page, problems } = await open(server.url);
  const seen = () =>
    page.evaluate(() => {
      const { camera, model } = window.somatic;
      const { list } = model.selfContacts;
      const box = document.querySelector("#stage").getBoundingClientRect();
      const at = list.length ? camera.project(list[0].position) : null;
      return {
        list,
        // The upper corner of the diamond.
        corner: at && [box.left + at.x, box.top + at.y - 12],
        panel: document.querySelector("#self-contacts-panel").innerText,
        rows: Array.from(model.rows),
      };
    });

  // The fingers are apart, then on each other, then hold an object of 16 mm.
  await seek(page, 0.2);
  const apart = await seen();
  assert.equal(apart.list.length, 0);
  assert.match(apart.panel, /No two links touch at one place/);

  await seek(page, 0.54);
  await page.waitForFunction(() => document.querySelector("#self-contact-count").textContent === "1");
  const closed = await seen();
  assert.equal(closed.list.length, 1);
  assert.match(closed.panel, /left[^]* m?N[^]*right[^]* m?N[^]*1\.0 mm apart · 180°/);
  // In the world, as every other sink has it.
  await page.waitForFunction(() => /, 67\.50/.test(document.querySelector("#percept-values").innerText));
  const moved = closed.rows.filter((value, i) => Math.abs(value - apart.rows[i]) > 1e-3).length;
  assert.ok(moved >= 2, `both fingers move, and ${moved} numbers of their poses do`);
  const [colour] = await coloursAt(page, [closed.corner]);
  const expected = [0xff, 0x6f, 0xc4];
  assert.ok(
    expected.every((part, k) => Math.abs(part - colour[k]) < 60),
    `the diamond has ${colour}`,
  );
  await picture(page, "self_contacts.png");
  await page.click(".contact-side >> nth=1");
  const touch = closed.list[0].sides[1].touch;
  await page.waitForSelector(".touch.chosen");
  const row = await page.locator(".touch.chosen").innerText();
  assert.ok(row.includes(`#${touch}`) && row.includes("right"), row);

  await seek(page, 1.62);
  assert.equal((await seen()).list.length, 0);
  assert.ok(await page.evaluate(() => window.somatic.model.inContact.size === 2));
  assert.deepEqual(problems, []);
  await page.close();
  await server.stop();
});

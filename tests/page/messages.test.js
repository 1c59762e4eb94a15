// Messages that the server wrote into messages.bin are decoded to the values that it says in messages.json.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import {
  decodeFrame,
  decodeHistory,
  decodeMesh,
  decodePeaks,
  kindOf,
} from "../../crates/page/src/web/wire.js";

const here = (name) => new URL(name, import.meta.url);
const bytes = readFileSync(here("messages.bin"));
const entries = JSON.parse(readFileSync(here("messages.json"), "utf8"));

/** As JSON has it: arrays, objects, and null for NaN. */
function plain(value) {
  if (typeof value === "number") return Number.isNaN(value) ? null : value;
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (value instanceof Map) return plain(Object.fromEntries(value));
  if (value && typeof value === "object")
    return Object.fromEntries(Object.entries(value).map(([key, of]) => [key, plain(of)]));
  return value;
}

const welcome = entries.find((entry) => entry.name === "welcome").values;
const mesh = entries.find((entry) => entry.name === "mesh").values;
const scene = {
  taxels: mesh.taxelId.length,
  pulled: welcome.senses?.shear.length ?? 0,
  links: welcome.links.length,
  components: welcome.columns.map((column) => column.components),
};

for (const { name, binary, offset, length, values } of entries)
  test(`the message "${name}"`, () => {
    const message = bytes.subarray(offset, offset + length);
    if (!binary) return assert.deepEqual(JSON.parse(message.toString("utf8")), values);
    const buffer = Uint8Array.from(message).buffer;
    const decode = [null, decodeMesh, (of) => decodeFrame(of, scene), decodeHistory, decodePeaks][
      kindOf(buffer)
    ];
    assert.deepEqual(plain(decode(buffer)), values);
  });

test("another byte is another message", () => {
  const { offset, length, values } = entries.find((entry) => entry.name === "mesh");
  const other = Uint8Array.from(bytes.subarray(offset, offset + length));
  other[22] ^= 1;
  assert.notDeepEqual(plain(decodeMesh(other.buffer)), values);
});

/** A WebM file of encoded pictures: the few parts of the format that players need to play it and to move about in it. */

/** @typedef {{data: Uint8Array, at: number, isKey: boolean}} Picture its bytes, and when it is shown, ms */

/** A cluster ends before its pictures' times no longer fit, ms. */
const CLUSTER_MS = 30_000;

const ID = {
  ebml: 0x1a45dfa3,
  version: 0x4286,
  readVersion: 0x42f7,
  idLength: 0x42f2,
  sizeLength: 0x42f3,
  docType: 0x4282,
  docTypeVersion: 0x4287,
  docTypeReadVersion: 0x4285,
  segment: 0x18538067,
  info: 0x1549a966,
  timestampScale: 0x2ad7b1,
  duration: 0x4489,
  muxingApp: 0x4d80,
  writingApp: 0x5741,
  tracks: 0x1654ae6b,
  trackEntry: 0xae,
  trackNumber: 0xd7,
  trackUid: 0x73c5,
  trackType: 0x83,
  lacing: 0x9c,
  codec: 0x86,
  video: 0xe0,
  width: 0xb0,
  height: 0xba,
  colour: 0x55b0,
  matrix: 0x55b1,
  range: 0x55b9,
  transfer: 0x55ba,
  primaries: 0x55bb,
  cluster: 0x1f43b675,
  timestamp: 0xe7,
  simpleBlock: 0xa3,
  cues: 0x1c53bb6b,
  cuePoint: 0xbb,
  cueTime: 0xb3,
  cuePositions: 0xb7,
  cueTrack: 0xf7,
  cueCluster: 0xf1,
};

/** Numbers of colour spaces (ITU-T H.273) by their names in browsers. @type {Record<string, number>} */
const COLOURS = { rgb: 0, bt709: 1, bt470bg: 5, smpte170m: 6, "bt2020-ncl": 9, "iec61966-2-1": 13 };

/** A whole number in as few bytes as hold it, the highest first. @param {number} number */
function bytesOf(number) {
  const bytes = [];
  for (let rest = number; rest > 0 || !bytes.length; rest = Math.floor(rest / 256)) bytes.unshift(rest % 256);
  return Uint8Array.from(bytes);
}

/** A size in eight bytes. @param {number} size */
function sizeOf(size) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, (1n << 56n) | BigInt(size));
  return bytes;
}

/** @param {Uint8Array[]} parts */
const lengthOf = (parts) => parts.reduce((sum, part) => sum + part.length, 0);

/**
 * @param {number} id
 * @param {Uint8Array[]} parts
 * @returns {Uint8Array[]}
 */
const element = (id, parts) => [bytesOf(id), sizeOf(lengthOf(parts)), ...parts];

/** @param {number} id @param {number} number */
const whole = (id, number) => element(id, [bytesOf(number)]);

/** @param {number} id @param {string} text */
const text = (id, text) => element(id, [new TextEncoder().encode(text)]);

/** @param {number} id @param {number} number */
function real(id, number) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, number);
  return element(id, [bytes]);
}

/**
 * How the colours were coded, as far as that is known: players would guess.
 * @param {VideoColorSpaceInit | undefined} space
 */
function colour(space) {
  const named = /** @type {const} */ (["matrix", "transfer", "primaries"]);
  const parts = named.flatMap((name) => {
    const number = COLOURS[space?.[name] ?? ""];
    return number === undefined ? [] : whole(ID[name], number);
  });
  if (typeof space?.fullRange === "boolean") parts.push(...whole(ID.range, space.fullRange ? 2 : 1));
  return parts.length ? element(ID.colour, parts) : [];
}

/**
 * Pictures that begin with one that needs no other, in parts of the time.
 * @param {Picture[]} pictures
 */
function inClusters(pictures) {
  /** @type {Picture[][]} */
  const clusters = [];
  for (const picture of pictures) {
    const last = clusters[clusters.length - 1];
    if (!last || picture.isKey || picture.at - last[0].at > CLUSTER_MS) clusters.push([picture]);
    else last.push(picture);
  }
  return clusters;
}

/** @param {Picture[]} pictures */
function cluster(pictures) {
  const begin = Math.round(pictures[0].at);
  const blocks = pictures.flatMap(({ data, at, isKey }) => {
    const after = Math.round(at) - begin;
    const head = Uint8Array.from([0x81, after >> 8, after & 255, isKey ? 0x80 : 0]);
    return element(ID.simpleBlock, [head, data]);
  });
  return element(ID.cluster, [...whole(ID.timestamp, begin), ...blocks]);
}

/**
 * The bytes of the file.
 * @param {Picture[]} pictures in their order
 * @param {{codec: string, width: number, height: number, length: number, space?: VideoColorSpaceInit}} about the codec's name in
 *   WebM, pixels, the length in ms, and how colours were coded
 * @returns {BlobPart[]}
 */
export function webmOf(pictures, { codec, width, height, length, space }) {
  const head = element(ID.ebml, [
    ...whole(ID.version, 1),
    ...whole(ID.readVersion, 1),
    ...whole(ID.idLength, 4),
    ...whole(ID.sizeLength, 8),
    ...text(ID.docType, "webm"),
    ...whole(ID.docTypeVersion, 4),
    ...whole(ID.docTypeReadVersion, 2),
  ]);
  const info = element(ID.info, [
    // Times are in milliseconds.
    ...whole(ID.timestampScale, 1e6),
    ...real(ID.duration, length),
    ...text(ID.muxingApp, "somatic"),
    ...text(ID.writingApp, "somatic"),
  ]);
  const track = element(ID.trackEntry, [
    ...whole(ID.trackNumber, 1),
    ...whole(ID.trackUid, 1),
    ...whole(ID.trackType, 1),
    ...whole(ID.lacing, 0),
    ...text(ID.codec, codec),
    ...element(ID.video, [...whole(ID.width, width), ...whole(ID.height, height), ...colour(space)]),
  ]);
  const before = [...info, ...element(ID.tracks, track)];
  /** @type {Uint8Array[]} */
  const clusters = [];
  /** @type {Uint8Array[]} */
  const cues = [];
  let at = lengthOf(before);
  for (const part of inClusters(pictures)) {
    const bytes = cluster(part);
    const place = [...whole(ID.cueTrack, 1), ...whole(ID.cueCluster, at)];
    const time = whole(ID.cueTime, Math.round(part[0].at));
    cues.push(...element(ID.cuePoint, [...time, ...element(ID.cuePositions, place)]));
    clusters.push(...bytes);
    at += lengthOf(bytes);
  }
  return /** @type {BlobPart[]} */ ([
    ...head,
    ...element(ID.segment, [...before, ...clusters, ...element(ID.cues, cues)]),
  ]);
}

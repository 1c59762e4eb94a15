/** The lines of the plots as a table in CSV: a row for each time, a column for each line, in SI units. */

/** @typedef {{name: string, t: ArrayLike<number>, v: ArrayLike<number>}} Column */

/**
 * A number of single precision with as few digits as give it back.
 * @param {number} x
 */
export function singleText(x) {
  if (!Number.isFinite(x)) return "";
  for (let digits = 6; digits < 9; digits++) {
    const short = Number(x.toPrecision(digits));
    if (Math.fround(short) === x) return String(short);
  }
  return String(Number(x.toPrecision(9)));
}

/** @param {string} text */
const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

/**
 * A table of columns that may have different times; a cell is empty where its column has no value.
 * @param {Column[]} columns
 */
export function csvOf(columns) {
  /** @type {Map<number, string[]>} */
  const rows = new Map();
  columns.forEach(({ t, v }, c) => {
    for (let i = 0; i < t.length; i++) {
      const text = singleText(v[i]);
      if (!text) continue;
      let row = rows.get(t[i]);
      if (!row) rows.set(t[i], (row = new Array(columns.length).fill("")));
      row[c] = text;
    }
  });
  const times = [...rows.keys()].sort((a, b) => a - b);
  const lines = times.map((t) => [Number(t.toFixed(9)), ...(rows.get(t) ?? [])].join());
  const head = ["time (s)", ...columns.map(({ name }) => quoted(name))].join();
  return { text: `${[head, ...lines].join("\n")}\n`, rows: times.length };
}

/**
 * The columns of a line of a recording: one where each row has one value, else the least and the most.
 * @param {string} name
 * @param {string} unit
 * @param {{least: Float32Array, most: Float32Array}} band
 * @param {{t: number, bin: number}[]} rows
 * @returns {Column[]}
 */
export function columnsOfBand(name, unit, band, rows) {
  const t = rows.map((row) => row.t);
  const [least, most] = [band.least, band.most].map((values) => rows.map(({ bin }) => values[bin]));
  const isOne = least.every((low, i) => low === most[i] || low !== low);
  if (isOne) return [{ name: headOf(name, unit), t, v: least }];
  return [
    { name: headOf(`${name} least`, unit), t, v: least },
    { name: headOf(`${name} most`, unit), t, v: most },
  ];
}

/**
 * The head of a column with its unit as people write it. Numbers without a unit have none.
 * @param {string} name
 * @param {string} unit
 */
export function headOf(name, unit) {
  if (unit === "1" || unit === "") return name;
  return `${name} (${unit === "count" ? "counts" : unit})`;
}

/**
 * The rows of a table of a recording: a frame each, as if they were evenly spaced, where each is shown in two parts of the time
 * or more; else a part each, at its middle.
 * @param {{from: number, to: number, bins: number}} parts
 * @param {{start_s: number, end_s: number, frames: number}} time of the recording
 */
export function rowsOf({ from, to, bins }, time) {
  const width = (to - from) / bins;
  const spacing = time.frames > 1 ? (time.end_s - time.start_s) / (time.frames - 1) : 0;
  if (spacing < 2 * width)
    return Array.from({ length: bins }, (_, bin) => ({ t: from + (bin + 0.5) * width, bin }));
  const slack = 1e-6 * spacing;
  const first = Math.ceil((from - slack - time.start_s) / spacing);
  const last = Math.floor((to + slack - time.start_s) / spacing);
  return Array.from({ length: last - first + 1 }, (_, i) => {
    const t = time.start_s + (first + i) * spacing;
    // A frame is shown up to the next one: halfway, rounding cannot make it the one before.
    return { t, bin: Math.min(bins - 1, Math.floor((t + spacing / 2 - from) / width)) };
  });
}

/** What follows from which fields hold which. */

/**
 * By taxel the smallest field of a letter, or else of the first one, that holds it, or -1; and the fields that hold no other, in their order.
 * @param {import("./wire.js").Field[]} fields
 * @param {number} taxels
 * @param {string | null} [letter]
 */
export function smallestFields(fields, taxels, letter = null) {
  const smallest = new Int32Array(taxels).fill(-1);
  const ofLetter = fields.map((_, f) => f).filter((f) => fields[f].letter === (letter ?? fields[0].letter));
  const parents = new Set(ofLetter.map((f) => fields[f].parent));
  const largestFirst = [...ofLetter].sort((a, b) => fields[b].members.length - fields[a].members.length);
  for (const f of largestFirst) for (const taxel of fields[f].members) smallest[taxel] = f;
  return { smallest, leaves: ofLetter.filter((f) => !parents.has(f)) };
}

/** Why a column is absent. */

/** Flags that explain why a column is absent, the likeliest first; other columns look at all flags. */
const MOTION = ["no_chart", "no_previous", "bad_dt", "held", "jumped"];
/** @type {Record<string, string[]>} */
export const REASONS = {
  centroid: ["no_chart"],
  orientation: ["no_chart", "one_taxel", "coincident"],
  principal_axis: ["no_chart", "one_taxel", "coincident", "isotropic"],
  anisotropy: ["no_chart", "one_taxel", "coincident"],
  displacement: MOTION,
  distance: MOTION,
  speed: MOTION,
  radial_distance: MOTION,
  radial_speed: MOTION,
  direction: [...MOTION, "still"],
};

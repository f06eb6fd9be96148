// What the page holds, and small helpers.

const model = JSON.parse(document.getElementById("model").textContent);
const byId = (id) => document.getElementById(id);
const clamp = (v, low, high) => Math.min(high, Math.max(low, v));
const AXES = ["x", "y", "z"];
const units = model.units === "um" ? "µm" : model.units;

const grid = model.grid;
const shown = model.shown;

// Centre of a voxel of the grid along an axis: the same sum in the same order as the program's.
const centreAlong = (axis, index) => grid.origin[axis] + (index + 0.5) * grid.spacing[axis];
// Number in the whole grid of a voxel that is shown.
const inGrid = (axis, index) => shown.first[axis] + index * shown.stride;
// The voxel shown that is nearest to a place along an axis.
const nearest = (axis, at) => {
  const number = (at - grid.origin[axis]) / grid.spacing[axis] - 0.5;
  return clamp(Math.round((number - shown.first[axis]) / shown.stride), 0, shown.dims[axis] - 1);
};
const voxels = shown.dims[0] * shown.dims[1] * shown.dims[2];

// The fewest digits that give the same f32 back.
const single = (v) => {
  if (!Number.isFinite(v)) return String(v);
  if (Object.is(v, -0)) return "-0";
  for (let digits = 1; digits < 10; digits++) {
    const text = v.toPrecision(digits);
    if (Math.fround(Number(text)) === v) return String(Number(text));
  }
  return String(v);
};
// A number for people, to some digits.
const rounded = (v, digits = 4) => (v === 0 ? "0" : String(Number(v.toPrecision(digits)))).replace("-", "−");
const unitLabel = (unit) => (unit || "").replace(/\^-2/g, "⁻²").replace(/\^-1/g, "⁻¹").replace(/\^2/g, "²").replace(/\^3/g, "³").replace("um", "µm").replace("degrees", "°");

// The smallest of 1, 2 and 5 times a power of ten that is not less.
const roundStep = (least) => {
  const power = 10 ** Math.floor(Math.log10(least));
  for (const m of [1, 2, 5, 10]) if (m * power >= least * (1 - 1e-9)) return m * power;
  return 10 * power;
};
// A pause in which the browser draws and listens.
const breathe = () => new Promise((done) => setTimeout(done, 0));

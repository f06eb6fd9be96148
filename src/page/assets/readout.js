// The stored values of a voxel.

const channels = heads.map((head) => new Samples(head, shown.dims));
const channelOf = (name) => channels.find((c) => c.head.name === name);
let pointer = null;

// Whether a value is as it was sampled, or rounded to save room.
const isExact = (head, v) => head.exact_within === null || !(Math.abs(v) > head.exact_within);

function valuesAt([i, j, k]) {
  const values = {};
  for (const c of channels) values[c.head.name] = c.values ? c.at(i, j, k) : null;
  return values;
}

// What is known of a voxel that is shown: its number in the whole grid, its centre, its values.
function describe(at) {
  const index = at.map((n, a) => inGrid(a, n));
  return { index, position: index.map((n, a) => centreAlong(a, n)), values: valuesAt(at) };
}

const rows = new Map();
function buildReadout() {
  const body = byId("readout").tBodies[0];
  for (const { head } of channels) {
    const row = body.insertRow();
    row.dataset.channel = head.name;
    row.title = head.meaning;
    const [name, value, unit] = [row.insertCell(), row.insertCell(), row.insertCell()];
    name.textContent = head.name;
    value.textContent = "–";
    unit.textContent = unitLabel(head.unit);
    rows.set(head.name, { row, value });
  }
  if (!channels.length) {
    const cell = body.insertRow().insertCell();
    cell.colSpan = 3;
    cell.textContent = "no channel is stored";
  }
}

function showVoxel(at) {
  pointer = at && { ...describe(at), shown: at };
  byId("voxel").textContent = pointer ? pointer.index.join(", ") : "–";
  byId("centre").textContent = pointer ? `${pointer.position.map((v) => v.toPrecision(9).replace(/\.?0+$/, "")).join(", ")} ${units}` : "–";
  byId("voxel").dataset.index = pointer ? pointer.index.join(",") : "";
  byId("centre").dataset.position = pointer ? pointer.position.join(",") : "";
  for (const { head } of channels) {
    const { row, value } = rows.get(head.name);
    const v = pointer ? pointer.values[head.name] : null;
    const exact = v === null || isExact(head, v);
    const name = head.name === "material" && v ? model.materials.find((m) => m.id === v) : null;
    const text = v === null ? (!pointer ? "–" : channelOf(head.name).loading ? "…" : "choose to read") : `${exact ? "" : "≈ "}${head.kind === "float" ? single(v) : v}`;
    value.textContent = name && name.name ? `${text} ${name.name}` : text;
    row.dataset.value = v === null ? "" : String(v);
    row.dataset.exact = String(exact);
    row.classList.toggle("chosen", head.name === state.channel);
  }
}
let speaking = 0;
function speak() {
  clearTimeout(speaking);
  speaking = setTimeout(() => {
    if (!pointer) return;
    const v = pointer.values[state.channel];
    byId("spoken").textContent = `voxel ${pointer.index.join(", ")}, ${state.channel} ${v === null ? "" : single(v)}`;
  }, 600);
}

// What is shown, and the same in the URL's fragment.

const surfaceHead = model.surface;
// The box of the surface, in scene units.
const box = (() => {
  const s = surfaceHead;
  const low = s ? s.corner : grid.origin;
  const high = s ? [0, 1, 2].map((a) => s.corner[a] + s.dims[a] * s.spacing[a])
    : [0, 1, 2].map((a) => grid.origin[a] + grid.dims[a] * grid.spacing[a]);
  return { low, high, middle: [0, 1, 2].map((a) => 0.5 * (low[a] + high[a])) };
})();

const heads = model.channels;
const firstChannel = (heads.find((h) => h.name === "sdf") || heads[0] || { name: "" }).name;
const DEFAULTS = () => ({
  azimuth: model.view.azimuth,
  elevation: model.view.elevation,
  zoom: 1,
  pan: [0, 0],
  iso: 0,
  cut: [1, 1, 1],
  // The side that is cut away first is the one in front.
  flip: [false, true, false],
  at: shown.dims.map((n) => n >> 1),
  channel: firstChannel,
  colour: "material",
  lines: true,
  smooth: false,
  cross: true,
});
const state = DEFAULTS();
state.theme = "";

const listeners = [];
const onChange = (listener) => listeners.push(listener);

// Isovalues that the field of the surface has, in scene units.
const isoRange = (() => {
  const sdf = heads.find((h) => h.name === "sdf");
  if (!surfaceHead || !surfaceHead.distance) return null;
  const reach = 2.5 * surfaceHead.unit;
  const low = sdf && sdf.range ? Math.min(sdf.range[0], 0) : -0.25 * (box.high[0] - box.low[0]);
  return [low * 0.98 || -reach, reach];
})();

// Numbers of the fragment are checked like any other input.
function setState(change, from) {
  const number = (v, low, high, old) => (Number.isFinite(v) ? clamp(v, low, high) : old);
  const next = { ...state, ...change };
  state.azimuth = number(next.azimuth, -1e6, 1e6, state.azimuth);
  state.azimuth = ((((state.azimuth + 180) % 360) + 360) % 360) - 180;
  state.elevation = number(next.elevation, -90, 90, state.elevation);
  state.zoom = number(next.zoom, 0.05, 200, state.zoom);
  state.pan = [0, 1].map((a) => number(next.pan[a], -1e12, 1e12, state.pan[a]));
  state.iso = isoRange ? number(next.iso, isoRange[0], isoRange[1], state.iso) : 0;
  state.cut = AXES.map((_, a) => number(next.cut[a], 0, 1, state.cut[a]));
  state.flip = AXES.map((_, a) => Boolean(next.flip[a]));
  state.at = AXES.map((_, a) => Math.round(number(next.at[a], 0, shown.dims[a] - 1, state.at[a])));
  if (heads.some((h) => h.name === next.channel)) state.channel = next.channel;
  state.colour = next.colour === "channel" && heads.length ? "channel" : "material";
  for (const key of ["lines", "smooth", "cross"]) state[key] = Boolean(next[key]);
  state.theme = ["dark", "light"].includes(next.theme) ? next.theme : "";
  for (const listener of listeners) listener(from);
  if (from !== "fragment") keepFragment();
}

const KEYS = [
  ["view", (s) => [s.azimuth, s.elevation].map((v) => rounded(v, 6).replace("−", "-")).join(","), (t) => pair(t, (a, b) => ({ azimuth: a, elevation: b }))],
  ["zoom", (s) => String(Number(s.zoom.toPrecision(5))), (t) => ({ zoom: Number(t) })],
  ["pan", (s) => s.pan.map((v) => Number(v.toPrecision(6))).join(","), (t) => pair(t, (a, b) => ({ pan: [a, b] }))],
  ["iso", (s) => String(Number(s.iso.toPrecision(7))), (t) => ({ iso: Number(t) })],
  ["cut", (s) => s.cut.map((v) => Number(v.toFixed(4))).join(","), (t) => ({ cut: t.split(",").map(Number) })],
  ["flip", (s) => s.flip.map(Number).join(","), (t) => ({ flip: t.split(",").map((v) => v === "1") })],
  ["at", (s) => s.at.join(","), (t) => ({ at: t.split(",").map(Number) })],
  ["channel", (s) => s.channel, (t) => ({ channel: t })],
  ["colour", (s) => s.colour, (t) => ({ colour: t })],
  ["lines", (s) => String(Number(s.lines)), (t) => ({ lines: t === "1" })],
  ["smooth", (s) => String(Number(s.smooth)), (t) => ({ smooth: t === "1" })],
  ["cross", (s) => String(Number(s.cross)), (t) => ({ cross: t === "1" })],
  ["theme", (s) => s.theme, (t) => ({ theme: t })],
];
function pair(text, make) {
  const [a, b] = text.split(",").map(Number);
  return make(a, b);
}

// What differs from the beginning, so that a link is short.
function fragment() {
  const plain = { ...DEFAULTS(), theme: "" };
  const parts = KEYS.filter(([, write]) => write(state) !== write(plain));
  return parts.map(([key, write]) => `${key}=${encodeURIComponent(write(state))}`).join("&");
}
let keeping = 0;
function keepFragment() {
  clearTimeout(keeping);
  keeping = setTimeout(() => {
    const text = fragment();
    try {
      history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
    } catch {
      // Pages in frames may not change their address.
    }
  }, 150);
}
function readFragment() {
  const change = { ...DEFAULTS(), theme: "" };
  for (const part of location.hash.slice(1).split("&")) {
    const at = part.indexOf("=");
    const known = KEYS.find(([key]) => key === part.slice(0, at));
    if (!known) continue;
    try {
      Object.assign(change, known[2](decodeURIComponent(part.slice(at + 1))));
    } catch {
      // What cannot be read is left as it is.
    }
  }
  setState(change, "fragment");
}

const isDark = () => (state.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";

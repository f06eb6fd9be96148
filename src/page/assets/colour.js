// Colours of numbers: the program's diverging map, a sequential one, and the materials.

const fromOklab = (l, a, b) => {
  const u = (l + 0.39633778 * a + 0.21580376 * b) ** 3;
  const v = (l - 0.105561346 * a - 0.06385417 * b) ** 3;
  const w = (l - 0.08948418 * a - 1.2914855 * b) ** 3;
  return [
    4.0767417 * u - 3.3077116 * v + 0.23096994 * w,
    -1.268438 * u + 2.6097574 * v - 0.34131938 * w,
    -0.0041960863 * u - 0.7034186 * v + 1.7076147 * w,
  ].map((c) => {
    const x = clamp(c, 0, 1);
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  });
};
const linearOf = (byte) => {
  const v = byte / 255;
  return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
};

// -1 is blue, 0 neutral, 1 orange.
const diverging = (t) => {
  const u = Math.min(1, Math.abs(t));
  const hue = ((t > 0 ? 48 : 252) * Math.PI) / 180;
  const chroma = 0.115 * u * (1.6 - 0.6 * u);
  return fromOklab(0.965 - 0.465 * u, chroma * Math.cos(hue), chroma * Math.sin(hue));
};
// 0 is dark blue, 1 light yellow; lightness grows evenly.
const sequential = (t) => {
  const u = clamp(t, 0, 1);
  const hue = ((285 - 185 * u) * Math.PI) / 180;
  return fromOklab(0.27 + 0.66 * u, (0.1 + 0.02 * u) * Math.cos(hue), (0.1 + 0.02 * u) * Math.sin(hue));
};

const GREY = [150, 156, 166];
const materialColour = (id) => (model.materials.find((m) => m.id === id) || { colour: GREY }).colour;
const materialName = (m) => m.name || `material ${m.id}`;

// How the numbers of a channel become colours.
function scaleOf(head) {
  if (head.name === "material") return { kind: "material", low: 0, high: 1 };
  let [low, high] = head.range || [0, 1];
  const share = /^(occupancy|fraction|face)/.test(head.name);
  if (share) [low, high] = [0, 1];
  if (low < 0 && high > 0) {
    const most = Math.max(-low, high);
    return { kind: "diverging", low: -most, high: most };
  }
  if (low === high) high = low + (Math.abs(low) || 1);
  return { kind: "sequential", low, high };
}
// 256 colours from the low end to the high one, as bytes.
const TABLES = {};
function tableOf(kind) {
  TABLES[kind] ||= Uint8Array.from({ length: 1024 }, (_, n) => {
    const t = (n >> 2) / 255;
    if ((n & 3) === 3) return 255;
    return (kind === "diverging" ? diverging(2 * t - 1) : sequential(t))[n & 3];
  });
  return TABLES[kind];
}

// The surface: the field of distances, followed by rays on the graphics processor, or on the other one.
//
// Everything here is in units `h` of the field: places from the middle of the box, distances as they are stored.

const FINE = 256, BEND = 8, SHIFT = 2048;

// Value of each stored number, and the same as the bits of a half.
const VALUES = Float32Array.from({ length: 2 * SHIFT + 1 }, (_, n) => {
  const q = n - SHIFT;
  return q / (FINE - Math.abs(q) / BEND) || (q < 0 ? -1e4 : q > 0 ? 1e4 : 0);
});
for (const [n, v] of [[0, -1e4], [2 * SHIFT, 1e4]]) VALUES[n] = v;
const halfOf = (v) => {
  const bits = new Int32Array(Float32Array.of(v).buffer)[0];
  const sign = (bits >>> 16) & 0x8000;
  const exponent = ((bits >>> 23) & 255) - 112;
  if (exponent <= 0) return v === 0 ? 0 : sign | Math.round(Math.abs(v) * 2 ** 24);
  if (exponent > 30) return sign | 0x7bff;
  return sign + (exponent << 10) + (((bits & 0x7fffff) + 0x1000) >> 13);
};

class Field {
  constructor(numbers, dims) {
    this.dims = dims;
    this.numbers = numbers;
    this.spacing = surfaceHead.spacing.map((v) => v / fieldUnit);
    // The middles of the outermost samples, from the middle of the box.
    this.high = dims.map((n, a) => 0.5 * (surfaceHead.dims[a] - surfaceHead.dims[a] / n) * this.spacing[a]);
    this.low = this.high.map((v) => -v);
    this.step = dims.map((n, a) => (n > 1 ? (this.high[a] - this.low[a]) / (n - 1) : 1));
  }

  // The value at a place, between the eight samples around it.
  at(x, y, z) {
    const [nx, ny, nz] = this.dims, d = this.numbers;
    const u = clamp((x - this.low[0]) / this.step[0], 0, nx - 1), i = Math.min(u | 0, Math.max(nx - 2, 0)), a = u - i;
    const v = clamp((y - this.low[1]) / this.step[1], 0, ny - 1), j = Math.min(v | 0, Math.max(ny - 2, 0)), b = v - j;
    const w = clamp((z - this.low[2]) / this.step[2], 0, nz - 1), k = Math.min(w | 0, Math.max(nz - 2, 0)), c = w - k;
    const p = (k * ny + j) * nx + i, dx = nx > 1 ? 1 : 0, dy = ny > 1 ? nx : 0, dz = nz > 1 ? nx * ny : 0;
    const row = (q) => VALUES[d[q]] + (VALUES[d[q + dx]] - VALUES[d[q]]) * a;
    const near = row(p) + (row(p + dy) - row(p)) * b;
    const far = row(p + dz) + (row(p + dy + dz) - row(p + dz)) * b;
    // Outside of the box it is further by the way to it.
    const out = [x, y, z].map((v, axis) => v - clamp(v, this.low[axis], this.high[axis]));
    return near + (far - near) * c + Math.hypot(...out);
  }

  // The same field with no more samples along a side than a texture may have.
  limited(most) {
    if (Math.max(...this.dims) <= most) return this;
    const dims = this.dims.map((n) => Math.min(n, most));
    const numbers = new Uint16Array(dims[0] * dims[1] * dims[2]);
    const coarse = new Field(numbers, dims);
    let at = 0;
    for (let k = 0; k < dims[2]; k++) for (let j = 0; j < dims[1]; j++) for (let i = 0; i < dims[0]; i++) {
      const v = this.at(...[i, j, k].map((n, a) => coarse.low[a] + n * coarse.step[a]));
      numbers[at++] = clamp(Math.round((FINE * v) / (1 + Math.abs(v) / BEND)) + SHIFT, 0, 2 * SHIFT);
    }
    return coarse;
  }
}
// The length that is 1 here, in scene units. Shares have none: there a sample's spacing is it.
const fieldUnit = surfaceHead ? (surfaceHead.distance ? surfaceHead.unit : Math.min(...surfaceHead.spacing)) : 1;

// Where a ray is in the box and in what the cuts leave; the axis of the cut through which it enters, or -1.
function spanOf(o, d, low, high) {
  const keep = cutBox(low, high);
  let from = -Infinity, to = Infinity, through = -1;
  for (let a = 0; a < 3; a++) {
    if (Math.abs(d[a]) < 1e-12) {
      if (o[a] < keep.low[a] || o[a] > keep.high[a]) return null;
      continue;
    }
    let [s, e] = [(keep.low[a] - o[a]) / d[a], (keep.high[a] - o[a]) / d[a]];
    const isCut = d[a] > 0 ? keep.low[a] > low[a] : keep.high[a] < high[a];
    if (s > e) [s, e] = [e, s];
    if (s > from) [from, through] = [s, isCut ? a : -1];
    to = Math.min(to, e);
  }
  return from < to ? { from, to, through } : null;
}
function cutBox(low, high) {
  const at = AXES.map((_, a) => low[a] + (state.flip[a] ? 1 - state.cut[a] : state.cut[a]) * (high[a] - low[a]));
  const isOn = AXES.map((_, a) => state.cut[a] < 1);
  return {
    low: low.map((v, a) => (isOn[a] && state.flip[a] ? at[a] : v)),
    high: high.map((v, a) => (isOn[a] && !state.flip[a] ? at[a] : v)),
  };
}
// Where a cut is, in scene units.
const cutPlace = (a) => {
  const half = field ? field.high[a] * fieldUnit : 0.5 * (box.high[a] - box.low[a]);
  return box.middle[a] - half + 2 * half * (state.flip[a] ? 1 - state.cut[a] : state.cut[a]);
};

let field = null;

// What a ray meets: its place, and the cut's axis where it is a face of a cut.
function meets(o, d) {
  if (!field) return null;
  const span = spanOf(o, d, field.low, field.high);
  if (!span) return null;
  const iso = state.iso / fieldUnit;
  const value = (t) => field.at(o[0] + d[0] * t, o[1] + d[1] * t, o[2] + d[2] * t) - iso;
  const place = (t, cut = -1) => ({ place: [0, 1, 2].map((a) => o[a] + d[a] * t), t, cut });
  let t = span.from + 1e-4, before = t, last = Infinity, older = Infinity;
  for (let n = 0; n < 1500 && t < span.to; n++) {
    const g = value(t);
    if (g <= 0) {
      if (n === 0) return place(t, span.through);
      let [a, b] = [before, t];
      for (let m = 0; m < 8; m++) {
        const middle = 0.5 * (a + b);
        if (value(middle) > 0) a = middle;
        else b = middle;
      }
      return place(b);
    }
    if (seeksWalls && g > last && last <= older && last < 0.9 && older < Infinity) {
      const thin = between(value, before + 0.5 * dip(value(before - 0.5), last, g));
      if (thin !== null) return place(thin);
    }
    [older, last, before] = [last, g, t];
    t += surfaceHead.distance ? (g > 1.6 ? Math.max(0.5, 0.9 * (g - 0.6)) : 0.5) : 0.5;
  }
  return null;
}
// In a stack's field there may be walls thinner than a spacing; in a scene's they have been made thicker.
const seeksWalls = model.source === "stack" && surfaceHead && surfaceHead.distance;
// A wall thinner than a spacing shows as a dip of the field that stays above zero. Away from it the field is smooth:
// where it goes on from either side, as a parabola, to the dip says whether the wall is met. The place, or null.
//
//   value   ·  ·  ·              ·  ·  ·          samples 3.75, 2.5 and 1.25 away from the dip
//   0  ------------\------------/----------       parabolas through them
//                   \ _ _ _ _ _/
function between(value, t) {
  const on = (side) => {
    const [a, b, c] = [1.25, 2.5, 3.75].map((d) => value(t + side * d));
    return { near: a, there: 3 * (a - b) + c };
  };
  const left = on(-1), right = on(1);
  if (left.there > 0 || right.there > 0 || left.near <= 0) return null;
  return t - (1.25 * left.there) / (left.there - left.near);
}
// Where three values at equal steps have their least, in steps from the middle one.
const dip = (a, b, c) => clamp((0.5 * (a - c)) / Math.max(a - 2 * b + c, 1e-6), -1, 1);
// The ray at a place of the view, in units of the field.
function rayAt(c, x, y) {
  const p = pointAt(c, x, y);
  const reach = 2 * Math.hypot(...field.high);
  return { o: p.map((v, a) => (v - box.middle[a]) / fieldUnit - c.forward[a] * reach), d: c.forward };
}
const worldOf = (place) => place.map((v, a) => box.middle[a] + v * fieldUnit);

// The picture is drawn tile by tile, and tiles in which nothing is seen are not.
const VERTEX = `#version 300 es
precision highp float;
#ifdef SCOUT
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(p, 0.0, 1.0);
}
#else
uniform highp sampler2D start;
uniform bool hasStart;
uniform vec2 size;
uniform float tile;
void main() {
  int columns = int(ceil(size.x / tile));
  int number = gl_VertexID / 6, n = gl_VertexID % 6;
  ivec2 cell = ivec2(number % columns, number / columns);
  float far = hasStart ? texelFetch(start, cell, 0).r : 0.0;
  vec2 corner = vec2(n == 1 || n >= 4, n == 2 || n == 3 || n == 5);
  vec2 at = 2.0 * (vec2(cell) + corner) * tile / size - 1.0;
  gl_Position = far > 1e8 ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(at, 0.0, 1.0);
}
#endif
`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler3D;
precision highp usampler3D;
uniform sampler3D field;
uniform sampler3D channel;
uniform usampler3D material;
uniform usampler3D skin;
uniform sampler2D table;
uniform vec3 low, high, keepLow, keepHigh, stepUp;
uniform vec3 dims, sidesLow, sidesHigh, skinLow, skinStep;
uniform vec3 right, up, forward, target, key;
uniform vec2 size;
uniform float scale, iso, reach, lowValue, highValue;
uniform bool isDistance, hasStart;
uniform highp sampler2D start;
uniform float tile;
uniform vec3 colours[16];
out vec4 pixel;

float g(vec3 p) {
  vec3 within = clamp(p, low, high), at = (within - low) / stepUp;
  return texture(field, (at + 0.5) / dims).r + distance(p, within) - iso;
}
// Four samples at corners of a cube around the place.
vec3 gradient(vec3 p, float e) {
  vec2 k = vec2(e, -e);
  return k.xyy * g(p + k.xyy) + k.yyx * g(p + k.yyx) + k.yxy * g(p + k.yxy) + k.xxx * g(p + k.xxx);
}
vec3 directed(vec3 v, vec3 other) {
  float l = length(v);
  return l > 1e-6 ? v / l : other;
}
// As in the other renderer; negative where no wall is met.
vec2 beyond(vec3 o, float t, float side) {
  float a = g(o + forward * (t + side * 1.25)), b = g(o + forward * (t + side * 2.5)), c = g(o + forward * (t + side * 3.75));
  return vec2(a, 3.0 * (a - b) + c);
}
float between(vec3 o, float t) {
  vec2 left = beyond(o, t, -1.0), right = beyond(o, t, 1.0);
  bool isMet = left.y <= 0.0 && right.y <= 0.0 && left.x > 0.0;
  return isMet ? t - 1.25 * left.y / (left.y - left.x) : -1.0;
}
vec3 albedo(vec3 p, vec3 n, bool isCut) {
#ifdef CHANNEL
  float value = texture(channel, (p - sidesLow) / (sidesHigh - sidesLow)).r;
  float t = clamp((value - lowValue) / (highValue - lowValue), 0.0, 1.0);
  return pow(texture(table, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb, vec3(2.2));
#else
  vec3 found = colours[0];
  bool isOpen = true;
#ifdef SKIN
  for (int m = 0; m < 4 && isOpen && !isCut; m++) {
    ivec3 at = ivec3((p - 0.5 * float(m) * n * skinStep - skinLow) / skinStep);
    uint place = texelFetch(skin, clamp(at, ivec3(0), textureSize(skin, 0) - 1), 0).r;
    if (place > 0u) { found = colours[min(place, 16u) - 1u]; isOpen = false; }
  }
#endif
#ifdef MATERIAL
  for (int m = 0; m < 5 && isOpen; m++) {
    ivec3 count = textureSize(material, 0);
    vec3 spacing = (sidesHigh - sidesLow) / vec3(count);
    vec3 q = p - n * (isCut ? 0.0 : 0.5 * float(m)) * spacing;
    uint place = texelFetch(material, clamp(ivec3((q - sidesLow) / spacing), ivec3(0), count - 1), 0).r;
    if (place > 0u) { found = colours[min(place, 16u) - 1u]; isOpen = false; }
  }
#endif
  return found;
#endif
}
vec3 lit(vec3 p, vec3 n, vec3 base) {
  float ambient = 1.0;
#if !defined(FAST) && !defined(SHARE)
  float hidden = 0.34 * clamp(1.0 - g(p + n * 3.0) / 3.0, 0.0, 1.0);
  hidden += 0.28 * clamp(1.0 - g(p + n * 9.0) / 9.0, 0.0, 1.0);
  hidden += 0.22 * clamp(1.0 - g(p + n * 22.0) / 22.0, 0.0, 1.0);
  ambient = 1.0 - hidden;
#endif
  float sun = max(dot(n, key), 0.0) * mix(0.55, 1.0, ambient);
  float sky = 0.5 + 0.5 * n.z;
  float front = max(-dot(n, forward), 0.0);
  vec3 half_ = normalize(key - forward);
  float gloss = 0.10 * pow(max(dot(n, half_), 0.0), 40.0) * ambient;
  return base * (0.78 * sun + (0.30 * sky + 0.14 + 0.22 * front) * ambient) + gloss;
}
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
// Where a ray of the picture begins, and where it is in what the cuts leave; the radius around it counts.
vec3 origin(vec2 at) {
  at -= 0.5 * size;
  return target + right * at.x * scale + up * at.y * scale - forward * reach;
}
vec2 span(vec3 o, float radius, out vec3 enters) {
  vec3 inverse = 1.0 / (forward + vec3(equal(forward, vec3(0.0))) * 1e-9);
  vec3 a = (keepLow - radius - o) * inverse, b = (keepHigh + radius - o) * inverse;
  vec3 leaves = max(a, b);
  enters = min(a, b);
  return vec2(max(max(enters.x, enters.y), enters.z), min(min(leaves.x, leaves.y), leaves.z));
}
#ifdef SCOUT
void main() {
  vec3 o = origin((floor(gl_FragCoord.xy) + 0.5) * tile), enters;
  float radius = 0.71 * (tile + 2.0) * scale;
  vec2 ends = span(o, radius, enters);
  float t = ends.x + 1e-3;
  bool isOpen = ends.x < ends.y;
  for (int n = 0; n < 200 && isOpen && t <= ends.y; n++) {
    float v = g(o + forward * t) - radius;
    isOpen = v >= 1.8;
    t += isOpen ? 0.95 * (v - 0.8) : 0.0;
  }
  pixel = vec4(ends.x < ends.y && t <= ends.y ? t : 1e9);
}
#else
void main() {
  vec3 o = origin(gl_FragCoord.xy), s;
  vec2 ends = span(o, 0.0, s);
  float from = ends.x, to = ends.y, t = from + 1e-3;
  float far = hasStart ? texelFetch(start, ivec2(gl_FragCoord.xy / tile), 0).r : t;
  bool isSeen = from < to && far <= to;
  bool isInside = far <= t;
  t = max(t, far);
  pixel = vec4(0.0);
  float before = t, v = 1e9, last = 1e9, older = 1e9, least = 1e9, leastAt = t;
  bool isHit = false, isThin = false, isCut = false;
  int most = isDistance ? 420 : 1400;
  for (int n = 0; n < most && t <= to && isSeen && !isHit;) {
    bool isDip = false;
    for (; n < most && t <= to; n++) {
      v = g(o + forward * t);
      isHit = v <= 0.0;
      isCut = isHit && isInside && n == 0;
      isDip = isDistance && v > last && last <= older && last < 0.9 && older < 1e8;
      if (isHit || isDip) break;
      older = last; last = v; before = t;
      t += isDistance ? (v > 1.6 ? max(0.5, 0.95 * (v - 0.5)) : 0.5) : 0.5;
    }
    for (; isDip && !isHit; isDip = false) {
      float ahead = g(o + forward * (before - 0.5));
      float bend = max(ahead - 2.0 * last + v, 1e-6), lean = 0.5 * (ahead - v);
      float middle = before + 0.5 * clamp(lean / bend, -1.0, 1.0), bottom = last - 0.5 * lean * lean / bend;
      leastAt = bottom < least ? middle : leastAt;
      least = min(bottom, least);
      float thin = -1.0;
#ifdef WALLS
      thin = between(o, middle);
#endif
      isThin = thin > 0.0;
      isHit = isThin;
      older = last; last = v; before = t;
      t = isThin ? thin : t + 0.5;
    }
  }
  float lo = before, hi = t, atLo = last, atHi = v;
  for (int m = 0; m < 3 && isHit && !isThin && !isCut; m++) {
    float middle = mix(lo, hi, clamp(atLo / (atLo - atHi), 0.1, 0.9));
    float w = g(o + forward * middle);
    if (w > 0.0) { lo = middle; atLo = w; } else { hi = middle; atHi = w; }
    t = mix(lo, hi, atLo / (atLo - atHi));
  }
  float cover = !isSeen ? 0.0 : isHit ? 1.0 : isDistance ? 0.5 - least / scale : 0.0;
  if (cover < 0.02) discard;
  vec3 p = o + forward * (isHit ? t : leastAt);
  vec3 entry = vec3(greaterThanEqual(s, vec3(from - 1e-4)));
  vec3 n = directed(-entry * sign(forward), -forward);
  for (bool isRound = !isCut; isRound; isRound = false) {
#ifdef SHARE
    n = directed(gradient(p, 1.2), -forward);
#else
    vec3 outer = directed(gradient(p - forward * 0.6, 0.6), -forward);
    n = outer;
#ifndef FAST
    n = directed(gradient(p + outer * 1.45, 0.6 + 0.05 * abs(iso)), outer);
#endif
#endif
    // What is seen faces the camera, if barely.
    float away = dot(n, forward);
    if (away > -0.12) n = normalize(n - forward * (away + 0.12));
  }
  vec3 base = albedo(p, n, isCut);
#ifdef CHANNEL
  vec3 face = base;
#else
  vec3 face = mix(base, vec3(1.0), 0.28) * (0.70 + 0.30 * max(-dot(n, forward), 0.0));
#endif
  pixel = vec4(encoded(isCut ? face : lit(p, n, base)), 1.0) * cover;
}
#endif
`;

// Pixels along a side of the tiles that share the start of their rays.
const TILE = 8;

// Draws on the graphics processor.
class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { alpha: true, antialias: false, premultipliedAlpha: true, powerPreference: "high-performance", preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.build();
  }

  // The program with these words defined, made when it is first asked for.
  program(...words) {
    const key = words.join(" ");
    return (this.programs[key] ??= this.compiled(words.map((word) => `#define ${word}\n`).join("")));
  }

  compiled(define) {
    const gl = this.gl, program = gl.createProgram();
    const defined = (text) => text.replace("es\n", `es\n${define}`);
    const shader = (kind, text) => {
      const one = gl.createShader(kind);
      gl.shaderSource(one, text);
      gl.compileShader(one);
      gl.attachShader(program, one);
      return one;
    };
    shader(gl.VERTEX_SHADER, defined(VERTEX));
    const fragment = shader(gl.FRAGMENT_SHADER, defined(FRAGMENT));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(program) || gl.getShaderInfoLog(fragment) || "the shader does not link");
    }
    const places = {};
    const place = (name) => (places[name] ??= gl.getUniformLocation(program, name));
    gl.useProgram(program);
    for (const [name, unit] of [["field", 0], ["material", 1], ["channel", 2], ["table", 3], ["start", 4], ["skin", 5]]) {
      if (place(name)) gl.uniform1i(place(name), unit);
    }
    return { program, place };
  }

  build() {
    const gl = this.gl;
    this.textures = [];
    this.programs = {};
    this.program();
    gl.bindVertexArray(gl.createVertexArray());
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const limit = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
    this.limit = limit;
    this.drawn = field.limited(limit);
    this.isReduced = this.drawn !== field;
    const halves = Uint16Array.from(VALUES, halfOf);
    const numbers = this.drawn.numbers, texels = new Uint16Array(numbers.length);
    for (let n = 0; n < texels.length; n++) texels[n] = halves[numbers[n]];
    this.texture(0, gl.R16F, gl.RED, gl.HALF_FLOAT, this.drawn.dims, texels, gl.LINEAR);
    this.texture(1, gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE, [1, 1, 1], new Uint8Array(1), gl.NEAREST);
    this.texture(2, gl.R32F, gl.RED, gl.FLOAT, [1, 1, 1], new Float32Array(1), gl.NEAREST);
    this.texture(5, gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE, [1, 1, 1], new Uint8Array(1), gl.NEAREST);
    this.hasMaterial = this.hasSkin = false;
    this.channel = null;
    this.range = [0, 1];
    this.tables();
    // A coarse picture of how far rays may go unseen; where it cannot be had each ray goes by itself.
    this.scout = gl.getExtension("EXT_color_buffer_float") && surfaceHead.distance ? { frame: gl.createFramebuffer(), texture: gl.createTexture(), size: [0, 0] } : null;
    const error = gl.getError();
    if (error) throw new Error(`WebGL refuses the textures (${error})`);
  }

  texture(unit, internal, format, type, dims, data, filter) {
    const gl = this.gl;
    if (this.textures[unit]) gl.deleteTexture(this.textures[unit]);
    this.textures[unit] = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_3D, this.textures[unit]);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(gl.TEXTURE_3D, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MAG_FILTER, filter);
    gl.texImage3D(gl.TEXTURE_3D, 0, internal, ...dims, 0, format, type, data);
  }

  tables() {
    const gl = this.gl;
    this.lookup = gl.createTexture();
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.lookup);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  }

  // Every so manieth sample of a channel, so that a texture may hold it.
  thinned(samples, make) {
    const dims = samples.dims.map((n) => Math.min(n, this.limit, 256));
    const out = make(dims[0] * dims[1] * dims[2]);
    const pick = dims.map((n, a) => Int32Array.from({ length: n }, (_, i) => Math.min(samples.dims[a] - 1, Math.floor(((i + 0.5) * samples.dims[a]) / n))));
    let at = 0;
    for (const k of pick[2]) for (const j of pick[1]) {
      const row = (k * samples.dims[1] + j) * samples.dims[0];
      for (const i of pick[0]) out[at++] = samples.values[row + i];
    }
    return [dims, out];
  }

  setMaterial(samples) {
    this.materials(1, samples);
    this.hasMaterial = true;
  }

  // The materials next to the surface, on the grid that it is drawn from.
  setSkin(samples) {
    this.materials(5, samples);
    this.hasSkin = true;
  }

  materials(unit, samples) {
    const gl = this.gl;
    const numbers = new Map(model.materials.map((m, n) => [m.id, n + 1]));
    const [dims, ids] = this.thinned(samples, (n) => new Uint32Array(n));
    const texels = Uint8Array.from(ids, (id) => Math.min(numbers.get(id) || 0, 255));
    this.texture(unit, gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE, dims, texels, gl.NEAREST);
    if (unit === 5) this.skinStep = surfaceHead.dims.map((n, a) => (n / dims[a]) * field.spacing[a]);
  }

  setChannel(samples) {
    if (this.channel === samples) return;
    const gl = this.gl;
    const [dims, texels] = this.thinned(samples, (n) => new Float32Array(n));
    this.texture(2, gl.R32F, gl.RED, gl.FLOAT, dims, texels, gl.NEAREST);
    this.channel = samples;
    const scale = scaleOf(samples.head);
    gl.activeTexture(gl.TEXTURE3);
    const table = scale.kind === "material" ? tableOf("sequential") : tableOf(scale.kind);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
    this.range = [scale.low, scale.high];
  }

  draw(width, height, pixels, isFast) {
    const gl = this.gl, canvas = this.canvas;
    const [w, h] = [Math.max(1, Math.round(width * pixels)), Math.max(1, Math.round(height * pixels))];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const settings = this.settings(w, h);
    if (this.scout) this.explore(w, h, settings);
    const words = [isFast && "FAST", !surfaceHead.distance && "SHARE", seeksWalls && "WALLS"];
    if (state.colour === "channel" && this.channel) words.push("CHANNEL");
    else words.push(this.hasSkin && "SKIN", this.hasMaterial && "MATERIAL");
    const main = this.program(...words.filter(Boolean));
    gl.useProgram(main.program);
    this.set(main, settings);
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * Math.ceil(w / TILE) * Math.ceil(h / TILE));
  }

  // What the shaders are told, by the kind of its call.
  settings(w, h) {
    const c = camera(w, h), keep = cutBox(field.low, field.high);
    const unit = (v) => v.map((x, a) => (x - box.middle[a]) / fieldUnit);
    const ends = grid.origin.map((v, a) => v + grid.dims[a] * grid.spacing[a]);
    const colours = new Float32Array(48);
    model.materials.slice(0, 16).forEach((m, n) => m.colour.forEach((byte, a) => (colours[3 * n + a] = linearOf(byte))));
    return {
      uniform3fv: {
        low: field.low, high: field.high, keepLow: keep.low, keepHigh: keep.high, stepUp: this.drawn.step, dims: this.drawn.dims,
        sidesLow: unit(grid.origin), sidesHigh: unit(ends), skinLow: unit(surfaceHead.corner), skinStep: this.skinStep, right: c.right, up: c.up, forward: c.forward, target: unit(c.target),
        key: basis(state.azimuth - 48, 50).forward.map((v) => -v), colours,
      },
      uniform2fv: { size: [w, h] },
      uniform1f: {
        scale: c.scale / fieldUnit, iso: state.iso / fieldUnit, reach: 2 * Math.hypot(...field.high), tile: TILE,
        lowValue: this.range[0], highValue: this.range[1],
      },
      uniform1i: {
        isDistance: surfaceHead.distance, hasStart: this.scout !== null,
      },
    };
  }

  set(of, settings) {
    for (const [call, values] of Object.entries(settings)) {
      for (const [name, value] of Object.entries(values)) {
        const place = of.place(name);
        if (place) this.gl[call](place, typeof value === "boolean" ? Number(value) : value);
      }
    }
  }

  // Finds for each tile of pixels where its rays may start.
  explore(w, h, settings) {
    const gl = this.gl, scout = this.scout;
    const size = [w, h].map((n) => Math.ceil(n / TILE));
    gl.activeTexture(gl.TEXTURE4);
    if (size[0] !== scout.size[0] || size[1] !== scout.size[1]) {
      gl.bindTexture(gl.TEXTURE_2D, scout.texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, ...size, 0, gl.RED, gl.FLOAT, null);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, scout.frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, scout.texture, 0);
      scout.size = size;
    }
    // What is drawn to must not be read meanwhile.
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, scout.frame);
    gl.viewport(0, 0, ...size);
    const pathfinder = this.program("SCOUT");
    gl.useProgram(pathfinder.program);
    this.set(pathfinder, settings);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, scout.texture);
  }
}

// Draws on the main processor, coarsely: where there is no WebGL 2.
class SoftPainter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    if (!this.context) throw new Error("this browser has no 2-D canvas");
  }

  draw(width, height, coarse) {
    const w = Math.max(1, Math.round(width / coarse)), h = Math.max(1, Math.round(height / coarse));
    [this.canvas.width, this.canvas.height] = [w, h];
    const image = this.context.createImageData(w, h);
    const c = camera(w, h), key = basis(state.azimuth - 48, 50).forward.map((v) => -v);
    const base = model.materials[0].colour.map(linearOf);
    for (let y = 0; y < h; y++) for (let x = 0; x < w; x++) {
      const { o, d } = rayAt(c, x + 0.5, y + 0.5);
      const hit = meets(o, d);
      if (!hit) continue;
      let n = [0, 0, 0];
      if (hit.cut >= 0) n[hit.cut] = -Math.sign(d[hit.cut]);
      else {
        const p = hit.place.map((v, a) => v - 0.8 * d[a]);
        n = [0, 1, 2].map((a) => {
          const [q, r] = [[...p], [...p]];
          q[a] += 1;
          r[a] -= 1;
          return field.at(...q) - field.at(...r);
        });
        const length = Math.hypot(...n) || 1;
        n = n.map((v) => v / length);
      }
      const light = 0.78 * Math.max(dot(n, key), 0) + 0.3 * (0.5 + 0.5 * n[2]) + 0.14 + 0.22 * Math.max(-dot(n, d), 0);
      for (let a = 0; a < 3; a++) {
        const v = clamp(base[a] * light, 0, 1);
        image.data[4 * (y * w + x) + a] = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
      }
      image.data[4 * (y * w + x) + 3] = 255;
    }
    this.context.putImageData(image, 0, 0);
  }
}

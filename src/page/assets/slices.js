// Three linked slices of a channel, with isolines, and the colour bar.

// Axes of a slice's picture, to the right and up, by the axis across it.
const ACROSS = [[1, 2], [0, 2], [0, 1]];
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

class Slice {
  constructor(axis) {
    this.axis = axis;
    [this.right, this.up] = ACROSS[axis];
    this.canvas = byId(`slice-${axis}`);
    this.picture = document.createElement("canvas");
    this.size = [shown.dims[this.right], shown.dims[this.up]];
    this.sides = [this.right, this.up].map((a) => shown.dims[a] * shown.stride * grid.spacing[a]);
    this.key = "";
  }

  // The canvas in CSS pixels, of which there may be parts.
  room() {
    const r = this.canvas.getBoundingClientRect();
    return [r.width, r.height];
  }

  // Where the picture is on the canvas, in CSS pixels.
  frame() {
    const [w, h] = this.room();
    const scale = Math.min(w / this.sides[0], h / this.sides[1]);
    const [pw, ph] = this.sides.map((v) => Math.max(1, v * scale));
    return { x: 0.5 * (w - pw), y: 0.5 * (h - ph), w: pw, h: ph };
  }

  voxelAt(x, y) {
    const f = this.frame();
    const [u, v] = [(x - f.x) / f.w, 1 - (y - f.y) / f.h];
    if (!(u >= 0 && u < 1 && v >= 0 && v < 1)) return null;
    const at = [...state.at];
    at[this.right] = Math.floor(u * this.size[0]);
    at[this.up] = Math.floor(v * this.size[1]);
    return at;
  }

  // The samples, row by row from below.
  samples(channel) {
    const [nx, ny] = this.size, out = new Float64Array(nx * ny), at = [0, 0, 0];
    at[this.axis] = state.at[this.axis];
    const stride = [1, shown.dims[0], shown.dims[0] * shown.dims[1]];
    const start = at[this.axis] * stride[this.axis];
    for (let j = 0; j < ny; j++) {
      let from = start + j * stride[this.up];
      for (let i = 0; i < nx; i++, from += stride[this.right]) out[j * nx + i] = channel.values[from];
    }
    return out;
  }

  paint(channel) {
    const key = `${channel.head.name} ${state.at[this.axis]}`;
    if (key === this.key) return;
    this.key = key;
    const [nx, ny] = this.size;
    this.data = this.samples(channel);
    [this.picture.width, this.picture.height] = [nx, ny];
    const context = this.picture.getContext("2d"), image = context.createImageData(nx, ny);
    const scale = scaleOf(channel.head), table = scale.kind === "material" ? null : tableOf(scale.kind);
    for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
      const v = this.data[j * nx + i], to = 4 * ((ny - 1 - j) * nx + i);
      if (table) {
        const n = 4 * Math.round(255 * clamp((v - scale.low) / (scale.high - scale.low), 0, 1)) || 0;
        image.data.set(table.subarray(n, n + 4), to);
      } else {
        image.data.set(v === 0 ? [0, 0, 0, 0] : [...materialColour(v), 255], to);
      }
    }
    context.putImageData(image, 0, 0);
    this.lines = null;
  }

  draw(channel) {
    const canvas = this.canvas, pixels = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = this.room();
    if (!w || !h) return;
    [canvas.width, canvas.height] = [Math.round(w * pixels), Math.round(h * pixels)];
    const context = canvas.getContext("2d");
    context.scale(canvas.width / w, canvas.height / h);
    if (!channel || !channel.values) {
      context.fillStyle = css("--faint");
      context.font = "12px system-ui, sans-serif";
      context.textAlign = "center";
      context.fillText(heads.length ? "reading the samples …" : "no channel is stored", w / 2, h / 2);
      return;
    }
    this.paint(channel);
    const f = this.frame();
    context.imageSmoothingEnabled = state.smooth;
    context.imageSmoothingQuality = "high";
    context.fillStyle = css("--view");
    context.fillRect(f.x, f.y, f.w, f.h);
    context.drawImage(this.picture, f.x, f.y, f.w, f.h);
    if (state.lines) this.isolines(context, channel, f);
    if (state.cross) this.planes(context, f);
    context.lineWidth = 1;
    context.strokeStyle = css("--edge");
    context.strokeRect(f.x + 0.5, f.y + 0.5, f.w - 1, f.h - 1);
  }

  // Where the other two slices are.
  planes(context, f) {
    const u = f.x + ((state.at[this.right] + 0.5) / this.size[0]) * f.w;
    const v = f.y + (1 - (state.at[this.up] + 0.5) / this.size[1]) * f.h;
    context.lineWidth = 1;
    for (const [axis, x0, y0, x1, y1] of [[this.right, u, f.y, u, f.y + f.h], [this.up, f.x, v, f.x + f.w, v]]) {
      context.strokeStyle = css(`--${AXES[axis]}`);
      context.beginPath();
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
      context.stroke();
    }
  }

  isolines(context, channel, f) {
    this.lines ||= contours(this.data, this.size, levelsOf(channel.head));
    const place = (x, y) => [f.x + ((x + 0.5) / this.size[0]) * f.w, f.y + (1 - (y + 0.5) / this.size[1]) * f.h];
    for (const { level, points } of this.lines) {
      context.beginPath();
      for (let n = 0; n < points.length; n += 4) {
        context.moveTo(...place(points[n], points[n + 1]));
        context.lineTo(...place(points[n + 2], points[n + 3]));
      }
      const isZero = level === 0;
      context.strokeStyle = isZero ? "rgb(24 26 30 / 95%)" : "rgb(24 26 30 / 34%)";
      context.lineWidth = isZero ? 1.6 : 0.8;
      context.stroke();
    }
  }
}

// The levels of a channel's isolines; counts have none.
function levelsOf(head) {
  if (head.kind === "uint" || !head.range) return [];
  const scale = scaleOf(head), step = roundStep((scale.high - scale.low) / 20), levels = [];
  for (let n = Math.ceil(head.range[0] / step); n * step <= head.range[1] && levels.length < 64; n++) levels.push(n * step);
  return levels;
}

// Straight pieces of isolines between the samples, by marching squares; x0, y0, x1, y1 for each.
function contours(data, [nx, ny], levels) {
  const found = levels.map((level) => ({ level, points: [] }));
  for (let j = 0; j + 1 < ny; j++) for (let i = 0; i + 1 < nx; i++) {
    const p = j * nx + i, a = data[p], b = data[p + 1], c = data[p + nx + 1], d = data[p + nx];
    const low = Math.min(a, b, c, d), high = Math.max(a, b, c, d);
    if (!(high > low)) continue;
    for (const { level, points } of found) {
      if (level <= low || level > high) continue;
      const cross = [];
      const edge = (u, v, x0, y0, x1, y1) => {
        if (u < level !== v < level) {
          const t = (level - u) / (v - u);
          cross.push(i + x0 + (x1 - x0) * t, j + y0 + (y1 - y0) * t);
        }
      };
      edge(a, b, 0, 0, 1, 0);
      edge(b, c, 1, 0, 1, 1);
      edge(c, d, 1, 1, 0, 1);
      edge(d, a, 0, 1, 0, 0);
      if (cross.length === 4) points.push(...cross);
      else if (cross.length === 8) {
        const centre = (a + b + c + d) / 4 < level;
        const order = a < level === centre ? [0, 1, 2, 3] : [3, 0, 1, 2];
        for (const n of [0, 2]) points.push(...[order[n], order[n + 1]].flatMap((e) => cross.slice(2 * e, 2 * e + 2)));
      }
    }
  }
  return found;
}

function drawBar(head) {
  const canvas = byId("bar"), name = byId("bar-name");
  name.textContent = head ? (head.unit ? `${head.name} / ${unitLabel(head.unit)}` : head.name) : "";
  const pixels = Math.min(devicePixelRatio || 1, 2), [w, h] = [canvas.clientWidth, canvas.clientHeight];
  if (!w || !h) return;
  [canvas.width, canvas.height] = [Math.round(w * pixels), Math.round(h * pixels)];
  const context = canvas.getContext("2d");
  context.scale(pixels, pixels);
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = css("--soft");
  if (!head) return;
  const scale = scaleOf(head);
  if (scale.kind === "material") {
    let x = 0;
    for (const m of model.materials) {
      context.fillStyle = `rgb(${m.colour.join(" ")})`;
      context.fillRect(x, 8, 14, 14);
      context.fillStyle = css("--soft");
      const text = `${m.id} ${materialName(m)}`;
      context.fillText(text, x + 20, 19);
      x += 36 + context.measureText(text).width;
    }
    canvas.setAttribute("aria-label", `Colours of ${model.materials.length} materials`);
    return;
  }
  const table = tableOf(scale.kind), pad = 22, span = w - 2 * pad;
  for (let x = 0; x < span; x++) {
    const n = 4 * Math.round((255 * x) / Math.max(1, span - 1));
    context.fillStyle = `rgb(${table[n]} ${table[n + 1]} ${table[n + 2]})`;
    context.fillRect(pad + x, 2, 1.5, 13);
  }
  context.fillStyle = css("--soft");
  context.strokeStyle = css("--soft");
  context.textAlign = "center";
  const step = roundStep(((scale.high - scale.low) * 62) / span);
  for (let n = Math.ceil(scale.low / step - 1e-9); n * step <= scale.high + 1e-9 * step; n++) {
    const x = pad + ((n * step - scale.low) / (scale.high - scale.low)) * span;
    context.fillRect(x - 0.5, 15, 1, 4);
    context.fillText(rounded(n * step), x, 31);
  }
  canvas.setAttribute("aria-label", `Colours of ${head.name} from ${rounded(scale.low)} to ${rounded(scale.high)} ${unitLabel(head.unit)}`);
}

// From what is stored to what is seen.

const view = byId("view"), canvas = byId("solid"), soft = byId("soft"), still = byId("still");
const times = {};
let painter = null, softPainter = null, isLost = false, trouble = "";

const say = (text) => {
  byId("status").textContent = text;
};
// What the status says when nothing is going on.
const rest = () => say(trouble);

// Whether the still picture shows what is asked for.
const isAsStill = () => fragmentOfView() === "";
const fragmentOfView = () => fragment().split("&").filter((p) => /^(view|zoom|pan|iso|cut|flip)=/.test(p)).join("&");

function drawSolid(isFast) {
  const [w, h] = [view.clientWidth, view.clientHeight];
  if (!w || !h) return;
  let kind = "none";
  if (painter && !isLost) {
    if (state.colour === "channel") {
      const chosen = channelOf(state.channel);
      if (chosen && chosen.values) painter.setChannel(chosen);
    }
    painter.draw(w, h, isFast ? 1 : Math.min(devicePixelRatio || 1, 2), isFast);
    kind = "webgl";
  } else if (still && isAsStill()) {
    kind = "still";
  } else if (softPainter && field) {
    softPainter.draw(w, h, isFast ? 5 : 2.5);
    kind = "soft";
  } else if (still) {
    kind = "still";
  }
  canvas.hidden = kind !== "webgl";
  soft.hidden = kind !== "soft";
  if (still) still.hidden = kind !== "still";
  view.dataset.drawn = kind;
  drawTriad();
  drawScale(w, h);
}

function drawTriad() {
  const { right, up, forward } = basis(state.azimuth, state.elevation);
  const svg = byId("triad");
  svg.replaceChildren();
  const ends = [0, 1, 2].map((a) => [28 * right[a], -28 * up[a], forward[a], a]).sort((p, q) => q[2] - p[2]);
  for (const [x, y, , a] of ends) {
    const group = document.createElementNS("http://www.w3.org/2000/svg", "g");
    group.setAttribute("class", AXES[a]);
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    for (const [name, v] of [["x1", 0], ["y1", 0], ["x2", x], ["y2", y]]) line.setAttribute(name, v);
    const text = document.createElementNS("http://www.w3.org/2000/svg", "text");
    const length = Math.hypot(x, y) || 1;
    const reach = Math.hypot(x, y) > 6 ? 1 + 9 / length : 1;
    text.setAttribute("x", x * reach - 3.5);
    text.setAttribute("y", y * reach + 4);
    text.textContent = AXES[a];
    group.append(line, text);
    svg.append(group);
  }
}

function drawScale(w, h) {
  const { scale } = camera(w, h), length = roundStep(Math.min(120, 0.22 * w) * scale * 0.5);
  byId("scale").querySelector("span").textContent = `${rounded(length)} ${units}`;
  byId("scale").querySelector("i").style.width = `${length / scale}px`;
}

let asked = 0, settling = 0, hasMoved = false;
function ask() {
  asked ||= requestAnimationFrame(() => {
    asked = 0;
    drawSolid(hasMoved);
    clearTimeout(settling);
    if (hasMoved) settling = setTimeout(() => { hasMoved = false; ask(); }, 160);
    const chosen = channelOf(state.channel);
    for (const slice of slices) slice.draw(chosen);
    drawBar(chosen && chosen.head);
  });
}

// The materials next to the surface, where there are several.
const skin = surfaceHead && surfaceHead.skin.length ? new Samples({ ...surfaceHead, data: "skin", slabs: surfaceHead.skin, kind: "uint" }, surfaceHead.dims) : null;

// Starts or starts again what draws; where it cannot, the page goes on without.
function startPainter() {
  try {
    painter = new Painter(canvas);
    trouble = painter.isReduced ? `drawn from ${painter.drawn.dims.join(" × ")} samples, the most for this browser's textures` : "";
    const material = channelOf("material");
    if (material && material.values) painter.setMaterial(material);
    if (skin && skin.values) painter.setSkin(skin);
  } catch (error) {
    painter = null;
    trouble = `${still ? "a still picture until it is turned" : "drawn coarsely"}: ${error.message}`;
  }
}

function listenToLoss() {
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    isLost = true;
    trouble = "the graphics processor was lost; drawn without it";
    rest();
    ask();
  });
  canvas.addEventListener("webglcontextrestored", () => {
    isLost = false;
    startPainter();
    rest();
    ask();
  });
}

function hover([x, y]) {
  if (!field) return;
  const { o, d } = rayAt(camera(view.clientWidth, view.clientHeight), x, y);
  const hit = meets(o, d);
  showVoxel(hit ? worldOf(hit.place).map((v, a) => nearest(a, v)) : null);
  if (hit) speak();
}

// Channels are read one after the other, the one that is shown first, and fewer where they would take too much memory.
const MOST_VALUES = 150e6;
async function readChannels() {
  let left = MOST_VALUES;
  const order = [...channels].sort((a, b) => (b.head.name === state.channel) - (a.head.name === state.channel) || (a.head.slabs.reduce((s, n) => s + n, 0) - b.head.slabs.reduce((s, n) => s + n, 0)));
  for (const channel of order) {
    if (channel.loading || left < voxels) continue;
    left -= voxels;
    await readChannel(channel);
  }
}
async function readChannel(channel) {
  await channel.load(async (share) => {
    say(`reading ${channel.head.name}, ${Math.round(100 * share)} %`);
    await breathe();
  });
  if (channel.head.name === "material" && painter && !isLost) painter.setMaterial(channel);
  ask();
}

async function start() {
  let isReading = false;
  buildReadout();
  listenToControls();
  listenToSlices();
  listenToPointers(view, hover);
  listenToKeys();
  listenToLoss();
  if (!byId("notices").querySelector("li")) byId("notices").hidden = true;
  if (model.materials.length > 1) {
    for (const m of model.materials) {
      const item = document.createElement("li"), svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
      for (const [name, v] of [["width", "100%"], ["height", "100%"], ["fill", `rgb(${m.colour.join(" ")})`]]) rect.setAttribute(name, v);
      svg.append(rect);
      item.append(svg, materialName(m));
      byId("legend").append(item);
    }
  }
  readFragment();
  onChange((from) => {
    hasMoved = hasMoved || from !== "fragment";
    const chosen = channelOf(state.channel);
    if (chosen && !chosen.loading && isReading) readChannel(chosen).then(rest);
    if (pointer) showVoxel(pointer.shown);
    ask();
  });
  addEventListener("hashchange", readFragment);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setState({}, "fragment"));
  new ResizeObserver(ask).observe(view);
  for (const slice of slices) new ResizeObserver(ask).observe(slice.canvas);
  drawSolid(true);
  await breathe();
  if (surfaceHead) {
    const samples = await new Samples({ ...surfaceHead, kind: "uint" }, surfaceHead.dims).load();
    field = new Field(Uint16Array.from(samples.values), surfaceHead.dims);
    samples.bits = samples.values = null;
    try {
      softPainter = new SoftPainter(soft);
    } catch {
      // The still picture and the slices are left.
    }
    startPainter();
    drawSolid(false);
    if (painter) painter.gl.finish();
  } else {
    trouble = "there is no surface to draw";
  }
  times.first = performance.now();
  setState({}, "fragment");
  if (skin) {
    await skin.load(breathe);
    if (painter && !isLost) painter.setSkin(skin);
    drawSolid(false);
  }
  await readChannels();
  isReading = true;
  setState({}, "fragment");
  rest();
  for (const slice of slices) slice.draw(channelOf(state.channel));
  drawSolid(false);
  times.ready = performance.now();
}

// For tests and for whoever steers the page: `ready` is a promise that is kept when all is read and drawn.
window.voxlathe = {
  ready: null,
  isReady: false,
  times,
  model,
  get state() { return structuredClone(state); },
  get pointer() { return pointer && structuredClone(pointer); },
  get drawn() { return view.dataset.drawn; },
  setState: (change) => setState(change),
  // The numbers of a voxel of the grid, which must be one that is shown.
  voxel(i, j, k) {
    const at = [i, j, k].map((n, a) => (n - shown.first[a]) / shown.stride);
    if (!at.every((n, a) => Number.isInteger(n) && n >= 0 && n < shown.dims[a])) return null;
    return describe(at);
  },
  // The voxel under a place of the view, in CSS pixels from its corner.
  pick(x, y) {
    hover([x, y]);
    return this.pointer;
  },
  // Frames a second of a picture of that size, drawn so often.
  async frames(width, height, count = 10) {
    if (!painter || isLost) return 0;
    const gl = painter.gl, one = new Uint8Array(4);
    const picture = () => {
      painter.draw(width, height, 1, true);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one);
    };
    // What was asked for before is drawn first.
    picture();
    const begin = performance.now();
    for (let n = 0; n < count; n++) picture();
    const found = (1000 * count) / (performance.now() - begin);
    drawSolid(false);
    return found;
  },
};
window.voxlathe.ready = start().then(() => {
  window.voxlathe.isReady = true;
  document.documentElement.dataset.ready = "true";
}, (error) => {
  console.error(error);
  say(`this page cannot be read: ${error.message}`);
  throw error;
});

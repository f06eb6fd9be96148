// Where the solid is seen from: the orthographic camera of `render`, and what moves it.
//
//   right = (-sin a, cos a, 0)     up = (-sin e cos a, -sin e sin a, cos e)     a azimuth, e elevation

const radians = (degrees) => (degrees * Math.PI) / 180;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function basis(azimuth, elevation) {
  const [sa, ca] = [Math.sin(radians(azimuth)), Math.cos(radians(azimuth))];
  const [se, ce] = [Math.sin(radians(elevation)), Math.cos(radians(elevation))];
  return { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], forward: [-ce * ca, -ce * sa, -se] };
}

// What is in the middle of the default picture, seen from the middle of the box.
const offset = (() => {
  const { right, up } = basis(model.view.azimuth, model.view.elevation);
  const from = model.view.middle.map((v, a) => v - box.middle[a]);
  return [dot(from, right), dot(from, up)];
})();

// Scene units for a pixel of a picture of that size without zoom: the room around the solid is that of `render`.
const plainScale = (width, height) => Math.max(model.view.extent[0] / (0.88 * width), model.view.extent[1] / (0.9 * height));

function camera(width, height) {
  const axes = basis(state.azimuth, state.elevation);
  const shift = [offset[0] + state.pan[0], offset[1] + state.pan[1]];
  const target = box.middle.map((v, a) => v + axes.right[a] * shift[0] + axes.up[a] * shift[1]);
  return { ...axes, target, scale: plainScale(width, height) / state.zoom, width, height };
}

// The point of the picture's plane at a place in pixels.
const pointAt = (c, x, y) => c.target.map((v, a) => v + c.right[a] * (x - 0.5 * c.width) * c.scale + c.up[a] * (0.5 * c.height - y) * c.scale);

// The whole box along an axis, or from the beginning.
function look(azimuth, elevation) {
  const { right, up } = basis(azimuth, elevation);
  const sides = box.high.map((v, a) => v - box.low[a]);
  const reach = (axis) => axis.reduce((sum, v, a) => sum + Math.abs(v) * sides[a], 0);
  const view = byId("view").getBoundingClientRect();
  const [w, h] = [view.width || 4, view.height || 3];
  const zoom = plainScale(w, h) / Math.max(reach(right) / (0.9 * w), reach(up) / (0.92 * h));
  setState({ azimuth, elevation, zoom, pan: offset.map((v) => -v) });
}
const AXIS_VIEWS = { x: [0, 0], y: [-90, 0], z: [-90, 90], X: [180, 0], Y: [90, 0], Z: [-90, -90] };

function resetView() {
  setState({ ...DEFAULTS(), channel: state.channel, theme: state.theme });
}

// Pointers: one turns, one with a modifier moves, two zoom and move.
function listenToPointers(view, hover) {
  const held = new Map();
  const place = (event) => {
    const r = view.getBoundingClientRect();
    return [event.clientX - r.left, event.clientY - r.top];
  };
  const scale = () => camera(view.clientWidth, view.clientHeight).scale;
  const move = (dx, dy) => setState({ pan: [state.pan[0] - dx * scale(), state.pan[1] + dy * scale()] });
  const zoomAt = ([x, y], factor) => {
    const from = [(x - 0.5 * view.clientWidth) * scale(), (0.5 * view.clientHeight - y) * scale()];
    const zoom = clamp(state.zoom * factor, 0.05, 200);
    const kept = 1 - state.zoom / zoom;
    setState({ zoom, pan: [state.pan[0] + from[0] * kept, state.pan[1] + from[1] * kept] });
  };
  view.addEventListener("pointerdown", (event) => {
    view.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { at: place(event), moves: event.button !== 0 || event.shiftKey });
    view.classList.add("busy");
  });
  const release = (event) => {
    held.delete(event.pointerId);
    if (!held.size) view.classList.remove("busy");
  };
  view.addEventListener("pointerup", release);
  view.addEventListener("pointercancel", release);
  view.addEventListener("contextmenu", (event) => event.preventDefault());
  view.addEventListener("pointermove", (event) => {
    const now = place(event);
    const own = held.get(event.pointerId);
    if (!own) {
      hover(now);
      return;
    }
    const [dx, dy] = [now[0] - own.at[0], now[1] - own.at[1]];
    if (held.size === 1) {
      if (own.moves) move(dx, dy);
      else setState({ azimuth: state.azimuth - 0.45 * dx, elevation: clamp(state.elevation + 0.45 * dy, -90, 90) });
    } else {
      const other = [...held.entries()].find(([id]) => id !== event.pointerId)[1].at;
      const span = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      zoomAt([(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], span(now) / span(own.at));
      move(dx / 2, dy / 2);
    }
    own.at = now;
  });
  view.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 24 : 1;
    zoomAt(place(event), Math.exp(-0.0016 * lines * event.deltaY));
  }, { passive: false });
}

// Keys that work wherever the page has the focus, but where one types or moves a slider.
function listenToKeys() {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const on = event.target;
    if (on instanceof HTMLSelectElement || (on instanceof HTMLInputElement && on.type === "text")) return;
    if (AXIS_VIEWS[event.key]) look(...AXIS_VIEWS[event.key]);
    else if (event.key === "r" || event.key === "R") resetView();
    else if (event.key === "+" || event.key === "=") setState({ zoom: state.zoom * 1.2 });
    else if (event.key === "-") setState({ zoom: state.zoom / 1.2 });
    else if (event.key.startsWith("Arrow") && (on === document.body || on === byId("view"))) {
      const [dx, dy] = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
      setState({ azimuth: state.azimuth + dx, elevation: clamp(state.elevation + dy, -90, 90) });
    } else return;
    event.preventDefault();
  });
}

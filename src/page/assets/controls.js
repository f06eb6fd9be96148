// Sliders, choices and buttons, both ways.

const slices = [0, 1, 2].map((axis) => new Slice(axis));

function listenToControls() {
  const iso = byId("iso");
  iso.disabled = !isoRange;
  const isoAt = (n) => isoRange[0] + ((isoRange[1] - isoRange[0]) * n) / 1000;
  iso.addEventListener("input", () => {
    let v = isoAt(Number(iso.value));
    // The surface itself is easy to find again.
    if (Math.abs(v) < 0.006 * (isoRange[1] - isoRange[0])) v = 0;
    setState({ iso: v }, "iso");
  });
  for (const a of [0, 1, 2]) {
    byId(`cut-${a}`).addEventListener("input", (event) => setState({ cut: state.cut.map((v, b) => (a === b ? Number(event.target.value) / 1000 : v)) }, "cut"));
    byId(`flip-${a}`).addEventListener("click", () => setState({ flip: state.flip.map((v, b) => (a === b ? !v : v)) }));
    const index = byId(`index-${a}`);
    index.max = shown.dims[a] - 1;
    index.addEventListener("input", () => setState({ at: state.at.map((v, b) => (a === b ? Number(index.value) : v)) }, "index"));
  }
  for (const key of ["lines", "smooth", "cross"]) byId(key).addEventListener("change", (event) => setState({ [key]: event.target.checked }));
  const channel = byId("channel"), colour = byId("colour");
  for (const { name } of heads) channel.add(new Option(name, name));
  channel.disabled = !heads.length;
  colour.add(new Option("by material", "material"));
  if (heads.length) colour.add(new Option("by the slices' channel", "channel"));
  channel.addEventListener("change", () => setState({ channel: channel.value }));
  colour.addEventListener("change", () => setState({ colour: colour.value }));
  byId("reset").addEventListener("click", resetView);
  byId("theme").addEventListener("click", () => setState({ theme: isDark() ? "light" : "dark" }));
  onChange((from) => {
    if (from !== "iso" && isoRange) iso.value = Math.round((1000 * (state.iso - isoRange[0])) / (isoRange[1] - isoRange[0]));
    const isoText = isoRange ? `${rounded(state.iso)} ${units}` : "–";
    byId("iso-value").textContent = isoText;
    iso.setAttribute("aria-valuetext", isoText);
    for (const a of [0, 1, 2]) {
      const cut = byId(`cut-${a}`), text = state.cut[a] < 1 ? `${state.flip[a] ? "≥" : "≤"} ${rounded(cutPlace(a))} ${units}` : "none";
      if (from !== "cut") cut.value = Math.round(1000 * state.cut[a]);
      byId(`cut-${a}-value`).textContent = text;
      cut.setAttribute("aria-valuetext", text);
      byId(`flip-${a}`).setAttribute("aria-pressed", String(state.flip[a]));
      const index = byId(`index-${a}`), number = inGrid(a, state.at[a]);
      if (from !== "index") index.value = state.at[a];
      const place = `${rounded(centreAlong(a, number), 6)} ${units}`;
      byId(`at-${a}`).textContent = `= ${place}, ${"ijk"[a]} = ${number}`;
      index.setAttribute("aria-valuetext", `${"ijk"[a]} ${number}, ${place}`);
      byId(`slice-${a}`).setAttribute("aria-label", `${state.channel} across ${AXES[a]} at ${place}. Arrows move the voxel, page keys the slice.`);
    }
    for (const key of ["lines", "smooth", "cross"]) byId(key).checked = state[key];
    channel.value = state.channel;
    colour.value = state.colour;
    const head = heads.find((h) => h.name === state.channel);
    byId("meaning").textContent = head ? head.meaning : "";
    if (state.theme) document.documentElement.dataset.theme = state.theme;
    else delete document.documentElement.dataset.theme;
    byId("theme").textContent = isDark() ? "Light" : "Dark";
    byId("theme").setAttribute("aria-pressed", String(isDark()));
  });
}

function listenToSlices() {
  for (const slice of slices) {
    const canvas = slice.canvas;
    const at = (event) => {
      const r = canvas.getBoundingClientRect();
      return slice.voxelAt(event.clientX - r.left, event.clientY - r.top);
    };
    const choose = (event) => {
      const voxel = at(event);
      if (voxel) setState({ at: voxel });
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      choose(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) choose(event);
      showVoxel(at(event));
      speak();
    });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [slice.right, -1], ArrowRight: [slice.right, 1], ArrowDown: [slice.up, -1], ArrowUp: [slice.up, 1], PageDown: [slice.axis, -1], PageUp: [slice.axis, 1] }[event.key];
      if (!step) return;
      event.preventDefault();
      setState({ at: state.at.map((v, a) => (a === step[0] ? v + step[1] : v)) });
      showVoxel(state.at);
      speak();
    });
  }
}

// Frames in 3D on a plain canvas: orthographic with a hint of perspective, lines sorted by depth.
(() => {
  const frames = JSON.parse(document.getElementById("scene-data").textContent).frames;
  const canvas = document.getElementById("scene");
  const ink = canvas.getContext("2d");
  const origin = (T) => [T[0][3], T[1][3], T[2][3]];
  const at = (T, p) => [0, 1, 2].map((i) => T[i][0] * p[0] + T[i][1] * p[1] + T[i][2] * p[2] + T[i][3]);

  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const f of frames) origin(f.T).forEach((x, i) => { low[i] = Math.min(low[i], x); high[i] = Math.max(high[i], x); });
  const middle = low.map((x, i) => (x + high[i]) / 2);
  const span = Math.max(0.05, Math.hypot(...high.map((x, i) => x - low[i])));
  const start = { yaw: -0.95, pitch: 0.42, zoom: 1 };
  const view = { ...start };
  const many = frames.length > 14;
  const unit = span * 0.09;

  // Every line: two ends in the root frame, colour, width.
  const lines = [], labels = [];
  const line = (a, b, colour, width = 1.5) => lines.push({ a, b, colour, width });
  const loop = (T, points, colour, width) => points.forEach((p, i) => line(at(T, p), at(T, points[(i + 1) % points.length]), colour, width));
  for (const f of frames) {
    const small = ["station", "pose", "boards"].includes(f.kind) || (many && f.kind === "marker");
    const s = small ? unit * 0.5 : unit;
    const o = origin(f.T);
    [[s, 0, 0], [0, s, 0], [0, 0, s]].forEach((p, i) => line(o, at(f.T, p), ["#D55E00", "#009E73", "#0072B2"][i], small ? 1.2 : 2.4));
    if (f.parent !== null && !small) line(origin(frames[f.parent].T), o, "#9ca3af", 1);
    if (f.kind === "camera" || f.kind === "station") {
      const w = s * 0.9, h = s * 0.68, d = s * 1.3, corners = [[-w, -h, d], [w, -h, d], [w, h, d], [-w, h, d]];
      const colour = f.kind === "camera" ? "#111827" : "#9ca3af";
      loop(f.T, corners, colour, 1.2);
      corners.forEach((c) => line(o, at(f.T, c), colour, 1.2));
    }
    if (["board", "boards", "marker"].includes(f.kind)) {
      const [x0, y0, x1, y1] = f.box || [-unit, -unit, unit, unit];
      loop(f.T, [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], f.kind === "boards" ? "#9ca3af" : "#111827", 1.6);
    }
    if (!small) labels.push({ p: o, text: f.name });
  }
  for (const [kind, word] of [["station", "camera stations"], ["pose", "poses"], ["boards", "views of the board"]]) {
    const all = frames.filter((f) => f.kind === kind);
    if (all.length) labels.push({ p: origin(all[0].T), text: all.length + " " + word, soft: true });
  }

  const content = lines.flatMap((l) => [l.a, l.b]);
  const grid = Math.pow(10, Math.floor(Math.log10(span / 3)));  // a floor to stand on
  const floor = low[2] - 0.02 * span, reach = Math.ceil(span / grid / 2) * grid;
  const snap = (x) => Math.round(x / grid) * grid;
  for (let x = -reach; x <= reach + 1e-9; x += grid) {
    const cx = snap(middle[0]), cy = snap(middle[1]);
    line([cx + x, cy - reach, floor], [cx + x, cy + reach, floor], "#dde3ea", 1);
    line([cx - reach, cy + x, floor], [cx + reach, cy + x, floor], "#dde3ea", 1);
  }
  document.getElementById("scale").textContent = "Floor grid: " + (grid >= 1 ? grid + " m" : Math.round(grid * 1000) + " mm") + ".";

  function draw() {
    const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [cy, sy, cp, sp] = [Math.cos(view.yaw), Math.sin(view.yaw), Math.cos(view.pitch), Math.sin(view.pitch)];
    const turn = (p) => {
      const x = p[0] - middle[0], y = p[1] - middle[1], z = p[2] - middle[2];
      const right = -sy * x + cy * y, away = cy * x + sy * y;
      const up = cp * z - sp * away, near = cp * away + sp * z;
      const k = 1 / (1 - 0.25 * near / span);
      return [k * right, -k * up, near];
    };
    const seen = content.map(turn), side = (i, f) => f(...seen.map((p) => p[i]));
    const [left, right, top, bottom] = [side(0, Math.min), side(0, Math.max), side(1, Math.min), side(1, Math.max)];
    const scale = view.zoom * Math.min((box.width - 90) / (right - left), (box.height - 60) / (bottom - top));
    const project = (p) => {
      const q = turn(p);
      return [box.width / 2 + scale * (q[0] - (left + right) / 2), box.height / 2 + scale * (q[1] - (top + bottom) / 2), q[2]];
    };
    const drawn = lines.map((l) => ({ ...l, a: project(l.a), b: project(l.b) }));
    drawn.sort((l, m) => l.a[2] + l.b[2] - m.a[2] - m.b[2]);
    ink.lineCap = "round";
    for (const l of drawn) {
      ink.strokeStyle = l.colour;
      ink.lineWidth = l.width;
      ink.beginPath();
      ink.moveTo(l.a[0], l.a[1]);
      ink.lineTo(l.b[0], l.b[1]);
      ink.stroke();
    }
    ink.font = "13px system-ui, sans-serif";
    const taken = [];
    for (const label of labels) {
      const [x, y] = project(label.p), width = ink.measureText(label.text).width;
      const from = Math.max(2, Math.min(x + 7, box.width - width - 2));
      let base = y - 6;
      while (taken.some((t) => Math.abs(t.base - base) < 15 && from < t.to && t.from < from + width)) base += 15;
      taken.push({ from, to: from + width, base });
      ink.lineWidth = 3;
      ink.strokeStyle = "rgba(255,255,255,.9)";
      ink.strokeText(label.text, from, base);
      ink.fillStyle = label.soft ? "#4b5563" : "#111827";
      ink.fillText(label.text, from, base);
    }
  }

  const fingers = new Map();
  canvas.addEventListener("pointerdown", (e) => { fingers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const others = [...fingers].filter(([id]) => id !== e.pointerId);
    if (others.length === 0) {
      view.yaw -= (e.clientX - before[0]) * 0.009;
      view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + (e.clientY - before[1]) * 0.009));
    } else {
      const o = others[0][1], gap = (p) => Math.hypot(p[0] - o[0], p[1] - o[1]);
      zoom(gap([e.clientX, e.clientY]) / Math.max(1, gap(before)));
    }
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    draw();
  });
  const zoom = (factor) => { view.zoom = Math.max(0.2, Math.min(20, view.zoom * factor)); };
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(-e.deltaY * 0.0012)); draw(); }, { passive: false });
  canvas.addEventListener("dblclick", () => { Object.assign(view, start); draw(); });
  canvas.addEventListener("keydown", (e) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (turn) { view.yaw += turn[0]; view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + turn[1])); }
    else if (e.key === "+") zoom(1.2);
    else if (e.key === "-") zoom(1 / 1.2);
    else return;
    e.preventDefault();
    draw();
  });
  new ResizeObserver(draw).observe(canvas);
  draw();
})();

// Frames in 3D, lines sorted by depth.
(() => {
  const frames = JSON.parse(document.getElementById("scene-data").textContent).frames;
  const canvas = document.getElementById("scene");
  const origin = (T) => [T[0][3], T[1][3], T[2][3]];
  const at = (T, p) => [0, 1, 2].map((i) => T[i][0] * p[0] + T[i][1] * p[1] + T[i][2] * p[2] + T[i][3]);

  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const f of frames) origin(f.T).forEach((x, i) => { low[i] = Math.min(low[i], x); high[i] = Math.max(high[i], x); });
  const middle = low.map((x, i) => (x + high[i]) / 2);
  const span = Math.max(0.05, Math.hypot(...high.map((x, i) => x - low[i])));
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
      const colour = f.kind === "camera" ? "--mark" : "#9ca3af";
      loop(f.T, corners, colour, 1.2);
      corners.forEach((c) => line(o, at(f.T, c), colour, 1.2));
    }
    if (["board", "boards", "marker"].includes(f.kind)) {
      const [x0, y0, x1, y1] = f.box || [-unit, -unit, unit, unit];
      loop(f.T, [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], f.kind === "boards" ? "#9ca3af" : "--mark", 1.6);
    }
    if (!small) labels.push({ p: o, text: f.name });
    else if (f.kind === "marker") labels.push({ p: o, text: f.name.replace(/^\D+(?=\d+$)/, ""), soft: true });
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
    line([cx + x, cy - reach, floor], [cx + x, cy + reach, floor], "--grid", 1);
    line([cx - reach, cy + x, floor], [cx + reach, cy + x, floor], "--grid", 1);
  }
  document.getElementById("scale").textContent = "Floor grid: " + (grid >= 1 ? grid + " m" : Math.round(grid * 1000) + " mm") + ".";

  makeView(canvas, { middle, span, content }, (ink, project, box) => {
    const drawn = lines.map((l) => ({ ...l, a: project(l.a), b: project(l.b) }));
    drawn.sort((l, m) => l.a[2] + l.b[2] - m.a[2] - m.b[2]);
    ink.lineCap = "round";
    for (const l of drawn) {
      ink.strokeStyle = themeColour(l.colour);
      ink.lineWidth = l.width;
      ink.beginPath();
      ink.moveTo(l.a[0], l.a[1]);
      ink.lineTo(l.b[0], l.b[1]);
      ink.stroke();
    }
    drawLabels(ink, box, labels.map((label) => ({ ...label, at: project(label.p) })));
  });
})();

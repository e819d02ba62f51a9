// A colour of the page's theme by the name of its variable, `--grid`; other colours stay.
const themeColour = (() => {
  const known = new Map();
  document.addEventListener("themechange", () => known.clear());
  return (colour) => {
    if (!colour.startsWith("--")) return colour;
    if (!known.has(colour)) known.set(colour, getComputedStyle(document.documentElement).getPropertyValue(colour).trim());
    return known.get(colour);
  };
})();

// A view in 3D on a plain canvas: orthographic with a hint of perspective, turned and zoomed by pointer and keys.
// Not three.js: that adds 700 kB to each of the pages, which hold everything they need, for lines and a few faces.
// `space`: `middle` and `span`, what it turns about and how large that is; `content`, points that shall fit. It may change.
// `paint(ink, project, box)` draws; `project` gives x and y on the canvas, and nearness. Returns the function that redraws.
function makeView(canvas, space, paint) {
  const ink = canvas.getContext("2d");
  const start = { yaw: -0.95, pitch: 0.42, zoom: 1 };
  const view = { ...start };

  function draw() {
    const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { middle, span, content } = space;
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
    paint(ink, project, box);
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
  document.addEventListener("themechange", draw);
  draw();
  return draw;
}

// Labels {at, text, soft}, moved down until none covers another.
function drawLabels(ink, box, labels) {
  ink.font = "13px system-ui, sans-serif";
  const taken = [];
  for (const label of labels) {
    const [x, y] = label.at, width = ink.measureText(label.text).width;
    const from = Math.max(2, Math.min(x + 7, box.width - width - 2));
    let base = y - 6;
    while (taken.some((t) => Math.abs(t.base - base) < 15 && from < t.to && t.from < from + width)) base += 15;
    taken.push({ from, to: from + width, base });
    ink.lineWidth = 3;
    ink.strokeStyle = themeColour("--halo");
    ink.strokeText(label.text, from, base);
    ink.fillStyle = themeColour(label.soft ? "--soft" : "--ink");
    ink.fillText(label.text, from, base);
  }
}

// The cell in 3D: links as cylinders between the frames of its Denavit-Hartenberg rows, and what they carry. `postures`:
// joint values that shall fit into the view. `colours` may hold a colour for each part; without, parts have their own.
function makeCell(data, postures) {
  const cell = { colours: {} };
  const product = (A, B) => A.map((row) => [0, 1, 2, 3].map((j) => row[0] * B[0][j] + row[1] * B[1][j] + row[2] * B[2][j] + row[3] * B[3][j]));
  const at = (T, p) => [0, 1, 2].map((i) => T[i][0] * p[0] + T[i][1] * p[1] + T[i][2] * p[2] + T[i][3]);
  const origin = (T) => [T[0][3], T[1][3], T[2][3]], column = (T, k) => [T[0][k], T[1][k], T[2][k]];
  const plus = (a, b, s = 1) => a.map((x, i) => x + s * b[i]), dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const times = (a, s) => a.map((x) => x * s), long = (a) => Math.hypot(...a), unit = (a) => times(a, 1 / long(a));

  // Rz(theta) Tz(b) Tx(a) Rx(alpha) Ry(beta)
  function row(j, q) {
    const slide = j.type === "prismatic", theta = j.theta_offset + (slide ? 0 : q), b = j.b + (slide ? q : 0);
    const [c, s, ca, sa, cb, sb] = [Math.cos(theta), Math.sin(theta), Math.cos(j.alpha), Math.sin(j.alpha), Math.cos(j.beta), Math.sin(j.beta)];
    const T = [[c, -s * ca, s * sa, j.a * c], [s, c * ca, -c * sa, j.a * s], [0, sa, ca, b], [0, 0, 0, 1]];
    return product(T, [[cb, 0, sb, 0], [0, 1, 0, 0], [-sb, 0, cb, 0], [0, 0, 0, 1]]);
  }
  function links(q) {
    const out = [data.T_base_0];
    data.joints.forEach((j, i) => out.push(product(out[i], row(j, q[i]))));
    return out;
  }

  let faces, lines;  // of one picture
  let near = false;  // close to the tube: rounder, in slices that hide each other rightly, the tube seen through
  const face = (points, colour, hollow, behind, glass) => faces.push({ points, colour, hollow, behind, glass });
  const line = (a, b, colour, width) => lines.push({ a, b, colour, width });
  const slices = (a, b, each) => { const m = near ? 8 : 1; for (let k = 0; k < m; ++k) each(plus(times(a, 1 - k / m), b, k / m), plus(times(a, 1 - (k + 1) / m), b, (k + 1) / m)); };
  function ring(p, axis, r) {
    const sides = near ? 40 : 20;
    const u = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), v = cross(axis, u);
    return Array.from({ length: sides }, (_, i) => plus(plus(p, u, r * Math.cos(2 * Math.PI * i / sides)), v, r * Math.sin(2 * Math.PI * i / sides)));
  }
  function cylinder(a, b, r, colour) {
    const way = plus(b, a, -1);
    if (long(way) < 1e-6) return;
    const axis = unit(way);
    slices(a, b, (from, to) => {
      const low = ring(from, axis, r), high = ring(to, axis, r);
      low.forEach((p, i) => { const k = (i + 1) % low.length; face([p, low[k], high[k], high[i]], colour); });
    });
    face(ring(b, axis, r), colour);
    face(ring(a, axis, r).reverse(), colour);
  }
  function tube(t) {
    const axis = column(t.T, 2), top = origin(t.T), bottom = plus(top, axis, -t.depth);
    const next = (points, i) => points[(i + 1) % points.length];
    slices(top, bottom, (from, to) => {
      const [oh, ol, ih, il] = [ring(from, axis, t.outer), ring(to, axis, t.outer), ring(from, axis, t.inner), ring(to, axis, t.inner)];
      oh.forEach((_, i) => {
        face([ol[i], next(ol, i), next(oh, i), oh[i]], cell.colours.tube || "#d58a5e", false, false, near);
        face([ih[i], next(ih, i), next(il, i), il[i]], "#8a4a24");
      });
    });
    const [oh, ih] = [ring(top, axis, t.outer), ring(top, axis, t.inner)];
    oh.forEach((_, i) => face([ih[i], oh[i], next(oh, i), next(ih, i)], cell.colours.tube || "#eab08c", false, false, near));
  }
  function board(b) {
    const step = b.marker + b.gap, w = b.cols * step - b.gap, h = b.rows * step - b.gap, lift = -0.002;  // Z points into it
    const quad = (x, y, dx, dy, z, colour) => face([[x, y, z], [x + dx, y, z], [x + dx, y + dy, z], [x, y + dy, z]].map((p) => at(b.T, p)), colour, true, z === 0);
    quad(-b.gap, -b.gap, w + 2 * b.gap, h + 2 * b.gap, 0, "#ffffff");
    for (let r = 0; r < b.rows; ++r) for (let c = 0; c < b.cols; ++c) quad(c * step, r * step, b.marker, b.marker, lift, "#374151");
  }
  function sphere(s) {
    const around = (lat) => ring(plus(s.centre, [0, 0, s.radius * Math.sin(lat)]), [0, 0, 1], s.radius * Math.cos(lat));
    for (let k = 0; k < 6; ++k) {
      const low = around(-Math.PI / 2 + Math.PI * k / 6 + 1e-6), high = around(-Math.PI / 2 + Math.PI * (k + 1) / 6 - 1e-6);
      low.forEach((p, i) => { const n = (i + 1) % low.length; face([p, low[n], high[n], high[i]], "#7fb3d5"); });
    }
  }
  function addSolid(t) {
    if (t.kind === "ball") sphere({ centre: origin(t.T), radius: t.radius });
    if (t.kind === "tube") tube({ T: t.T, inner: t.inner_radius, outer: t.radius, depth: t.depth });
    if (t.kind === "plate") face([[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => at(t.T, [x * t.width / 2, y * t.height / 2, 0])), "--bench", true, true);
  }
  function block(T, r, long, colour) { cylinder(plus(origin(T), column(T, 2), -long * r), plus(origin(T), column(T, 2), 0), r, colour); }
  function frame(T, s) { ["#D55E00", "#009E73", "#0072B2"].forEach((colour, k) => line(origin(T), plus(origin(T), column(T, k), s), colour, 2)); }
  function eye(T, s, colour, flat) {  // what a camera, or in its plane a scanner, looks at
    const corners = (flat ? [[-0.3, 0, 1], [0.3, 0, 1]] : [[-0.4, -0.3, 1], [0.4, -0.3, 1], [0.4, 0.3, 1], [-0.4, 0.3, 1]]).map((p) => at(T, times(p, s)));
    corners.forEach((c, i) => { line(origin(T), c, colour, 1.4); line(c, corners[(i + 1) % corners.length], colour, 1.4); });
  }

  const reach = data.joints.reduce((sum, j) => sum + Math.abs(j.a) + Math.abs(j.b), 0) + 0.1;
  const n = data.joints.length, thick = (i) => reach * (0.046 - 0.028 * i / n);
  const still = () => {
    if (data.tube) tube(data.tube);
    if (near) return;
    data.boards.forEach(board);
    if (data.sphere) sphere(data.sphere);
    (data.solids || []).forEach(addSolid);
    frame([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], 0.1 * reach);
  };
  function arm(q) {
    const T = links(q), F = T[n];
    for (let i = 0; i < n; ++i) {
      const start = origin(T[i]), end = origin(T[i + 1]), z = column(T[i], 2), r = thick(i);
      const knee = plus(start, z, dot(plus(end, start, -1), z));  // first along the axis, then along a
      const colour = cell.colours[`joint${i + 1}`];
      cylinder(plus(start, z, -1.15 * r), plus(start, z, 1.15 * r), 1.2 * r, colour || (data.joints[i].type === "prismatic" ? "#9b8ac4" : "#e0a243"));
      cylinder(start, knee, 0.85 * r, colour || "#9fb0c3");
      cylinder(knee, end, 0.85 * r, colour || "#9fb0c3");
    }
    if (!near) frame(F, 0.07 * reach);
    if (data.T_flange_tool) {
      const E = product(F, data.T_flange_tool), tip = origin(E), back = unit(plus(origin(F), tip, -1));
      const p = data.peg, away = times(column(E, 2), dot(column(E, 2), back) < 0 ? -1 : 1);
      const grip = p ? plus(tip, away, Math.min(p.length, 0.7 * long(plus(origin(F), tip, -1)))) : tip;
      cylinder(origin(F), grip, 0.5 * thick(n), cell.colours.tool || "#6b7280");
      if (p) cylinder(tip, plus(tip, away, p.length), p.radius, cell.colours.contact || "--peg");
      if (!near) frame(E, 0.05 * reach);
    }
    if (near) return;
    if (data.T_flange_sensor && cell.colours.sensor) block(product(F, data.T_flange_sensor), thick(n), 0.5, cell.colours.sensor);
    if (data.T_flange_camera) {
      eye(product(F, data.T_flange_camera), 0.09 * reach, "--mark", false);
      block(product(F, data.T_flange_camera), 0.5 * thick(n), 2, cell.colours.camera || "#374151");
    }
    if (data.T_flange_scanner) {
      eye(product(F, data.T_flange_scanner), 0.14 * reach, "#b91c1c", true);
      block(product(F, data.T_flange_scanner), 0.5 * thick(n), 2, cell.colours.laser || "#7f1d1d");
    }
  }

  function paint(ink, project) {
    const light = unit([0.4, -0.5, 0.9]), drawn = [];
    for (const f of faces) {
      const p = f.points.map(project);
      let turned = 0;
      p.forEach((a, i) => { const b = p[(i + 1) % p.length]; turned += a[0] * b[1] - b[0] * a[1]; });
      if (turned >= 0 && !f.hollow) continue;  // seen from behind
      const normal = unit(cross(plus(f.points[1], f.points[0], -1), plus(f.points[2], f.points[0], -1)));
      const shade = 0.62 + 0.38 * Math.abs(dot(normal, light)) * (dot(normal, light) > 0 || f.hollow ? 1 : 0.3);
      const full = themeColour(f.colour), colour = [1, 3, 5].map((k) => Math.round(parseInt(full.slice(k, k + 2), 16) * shade));
      const depths = p.map((q) => q[2]);
      drawn.push({ p, near: f.behind ? Math.min(...depths) : depths.reduce((s, x) => s + x, 0) / p.length, fill: `rgb(${colour})`, glass: f.glass });
    }
    for (const l of lines) { const p = [project(l.a), project(l.b)]; drawn.push({ p, near: (p[0][2] + p[1][2]) / 2 + (l.near ?? 0.002), stroke: themeColour(l.colour), width: l.width }); }
    drawn.sort((a, b) => a.near - b.near);
    ink.lineJoin = ink.lineCap = "round";
    for (const t of drawn) {
      ink.beginPath();
      t.p.forEach((q, i) => (i ? ink.lineTo(q[0], q[1]) : ink.moveTo(q[0], q[1])));
      if (t.glass) { ink.closePath(); ink.fillStyle = t.fill; ink.globalAlpha = 0.45; ink.fill(); ink.globalAlpha = 1; continue; }
      if (t.fill) { ink.closePath(); ink.fillStyle = ink.strokeStyle = t.fill; ink.lineWidth = 0.6; ink.fill(); }
      else { ink.strokeStyle = t.stroke; ink.lineWidth = t.width; }
      ink.stroke();
    }
  }

  // What shall fit: the arm in the postures, and what stands still.
  const content = [[0, 0, 0], at(data.T_base_0, [thick(0), thick(0), -1.3 * thick(0)])];
  for (const q of postures) {
    const T = links(q);
    T.forEach((t, i) => [-1, 1].forEach((side) => [0, 1, 2].forEach((k) => content.push(plus(origin(t), column(t, k), 1.4 * side * thick(Math.min(i, n - 1)))))));
    for (const [tool, ahead] of [[data.T_flange_tool, 0.05], [data.T_flange_camera, 0.09], [data.T_flange_scanner, 0.14]])
      if (tool) content.push(at(product(T[n], tool), [0, 0, ahead * reach]));
  }
  faces = []; lines = []; still();
  faces.forEach((f) => content.push(...f.points));
  const low = [0, 1, 2].map((i) => Math.min(...content.map((p) => p[i]))), high = [0, 1, 2].map((i) => Math.max(...content.map((p) => p[i])));
  const middle = low.map((x, i) => (x + high[i]) / 2), span = Math.max(0.1, long(high.map((x, i) => x - low[i])));
  const grid = Math.pow(10, Math.floor(Math.log10(span / 3))), floor = Math.min(0, low[2]);
  const edge = (x, up) => (up ? Math.ceil(x / grid) : Math.floor(x / grid)) * grid;
  function ground() {
    for (let x = edge(low[0]); x <= edge(high[0], true) + 1e-9; x += grid) lines.push({ a: [x, edge(low[1]), floor], b: [x, edge(high[1], true), floor], colour: "--grid", width: 1, near: -2 * span });
    for (let y = edge(low[1]); y <= edge(high[1], true) + 1e-9; y += grid) lines.push({ a: [edge(low[0]), y, floor], b: [edge(high[0], true), y, floor], colour: "--grid", width: 1, near: -2 * span });
  }
  // The tube and room for the peg above it.
  function closeUp() {
    const axis = column(data.tube.T, 2), top = origin(data.tube.T), { outer, depth } = data.tube;
    const content = [...ring(plus(top, axis, -0.8 * depth), axis, 1.2 * outer), ...ring(plus(top, axis, 0.8 * depth), axis, 1.2 * outer)];
    return { middle: top, span: 2 * depth, content };
  }
  // The peg, or a rod in its place, alone at x, y, z, tilt and its azimuth in the frame of the tube's face, of a bench at
  // z = 0, or in the air.
  const rod = data.peg || { radius: 0.01, length: 0.06 };
  function drawPeg(ink, project, { stand }, [x, y, z, tilt, azimuth]) {
    faces = []; lines = []; near = true;
    const level = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], side = 5 * rod.radius;
    if (stand === "tube" && data.tube) tube({ ...data.tube, T: level });
    else {
      for (let k = -5; k <= 5; ++k) for (const flip of [false, true]) {
        const ends = [[k * rod.radius, -side, 0], [k * rod.radius, side, 0]].map(([a, b, c]) => (flip ? [b, a, c] : [a, b, c]));
        lines.push({ a: ends[0], b: ends[1], colour: "--grid", width: 1, near: -1 });
      }
      if (stand === "bench") face([[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0]], "--bench", true, true);
    }
    const tip = [x, y, z], axis = [Math.sin(tilt) * Math.cos(azimuth), Math.sin(tilt) * Math.sin(azimuth), Math.cos(tilt)];
    cylinder(tip, plus(tip, axis, rod.length), rod.radius, "--peg");
    cylinder(plus(tip, axis, 0.75 * rod.length), plus(tip, axis, 1.4 * rod.length), 1.5 * rod.radius, "#9fb0c3");
    paint(ink, project);
  }
  function pegView({ stand, peg }) {
    const onTube = stand === "tube" && data.tube, wide = onTube ? 1.2 * data.tube.outer : 5 * rod.radius;
    const low = onTube ? -data.tube.depth : Math.min(0, ...peg.map((p) => p[2])), high = Math.max(...peg.map((p) => p[2])) + 1.4 * rod.length;
    const content = [low, high].flatMap((z) => [[-wide, -wide, z], [wide, -wide, z], [wide, wide, z], [-wide, wide, z]]);
    const where = onTube ? "The tube in its own frame." : `Grid: ${+(1000 * rod.radius).toFixed(2)} mm at height 0.`;
    return { view: { middle: [0, 0, (low + high) / 2], span: Math.hypot(2 * wide, high - low), content }, scale: `${data.peg ? "The peg" : "The tool"} alone: no joint positions are given. ${where}` };
  }
  // Where a label of each part points.
  function places(q) {
    const T = links(q), F = T[n], out = {};
    for (let i = 0; i < n; ++i) out[`joint${i + 1}`] = times(plus(origin(T[i]), origin(T[i + 1])), 0.5);
    for (const [part, tool] of [["sensor", data.T_flange_sensor], ["tool", data.T_flange_tool], ["camera", data.T_flange_camera], ["laser", data.T_flange_scanner]])
      if (tool) out[part] = origin(product(F, tool));
    out.servo = out.contact = out.tool;
    if (data.tube) out.tube = origin(data.tube.T);
    return out;
  }

  return Object.assign(cell, {
    links, places, drawPeg, pegView, view: { middle, span, content }, scale: "Floor grid: " + (grid >= 1 ? grid + " m" : Math.round(grid * 1000) + " mm") + ".",
    close: data.tube && closeUp(),
    draw(ink, project, q, closely = false) {
      faces = []; lines = []; near = closely;
      if (!near) ground();
      still();
      arm(q);
      paint(ink, project);
    },
  });
}

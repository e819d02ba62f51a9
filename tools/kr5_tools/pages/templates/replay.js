// A cell, or a peg alone, that moves through what was recorded or planned; below it the signals, at the same time.
(() => {
  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const get = (id) => document.getElementById(id);
  const canvas = get("scene"), slider = get("time"), button = get("play"), choice = get("run"), pace = get("pace"), told = get("told");

  let run = data.runs[0], time = 0, playing = false, last = 0;
  const end = () => run.t[run.t.length - 1];
  function between(rows, t) {
    let k = run.t.findIndex((x) => x > t);
    if (k < 0) k = run.t.length;
    if (k === 0) return rows[0];
    if (k === run.t.length) return rows[k - 1];
    const part = (t - run.t[k - 1]) / (run.t[k] - run.t[k - 1]);
    return rows[k - 1].map((x, i) => x + part * (rows[k][i] - x));
  }
  const posture = () => between(run.q, time), peg = () => between(run.peg, time);

  const some = (rows) => rows.filter((_, k) => k % Math.max(1, Math.floor(rows.length / 25)) === 0);
  const cell = makeCell(data, data.runs.flatMap((r) => some(r.q || [])));
  const space = { ...cell.view };
  const redraw = makeView(canvas, space, (ink, project) => (run.q ? cell.draw(ink, project, posture()) : cell.drawPeg(ink, project, run, peg())));
  const close = get("close");  // a page may have a second picture, close to the tube
  const redrawClose = close ? makeView(close, cell.close, (ink, project) => cell.draw(ink, project, posture(), true)) : () => {};
  const signals = get("signals") && makeSignals((to) => { play(false); seek(to); });

  const degrees = (x) => (x * 180 / Math.PI).toFixed(1) + "°", millimetres = (x, digits = 1) => (1000 * x).toFixed(digits) + " mm";
  function values() {
    if (run.q) return `q = ${posture().map((x, i) => (data.joints[i].type === "prismatic" ? millimetres(x) : degrees(x))).join(", ")}`;
    const [x, y, z, tilt, azimuth] = peg();
    return run.stand === "tube" ? `peg at ${[x, y, z].map((p) => millimetres(p, 2)).join(", ")}, tilted by ${degrees(tilt)} towards ${degrees(azimuth)}` : `height ${millimetres(z, 3)}`;
  }
  function show() {
    slider.value = time;
    const when = run.hold ? `posture ${Math.round(time / run.hold) + 1} of ${Math.round(end() / run.hold) + 1}` : `${time.toFixed(2)} s of ${end().toFixed(2)} s`;
    const note = run.notes.findLast(([from]) => from <= time + 1e-9);
    told.textContent = `${when}${note ? ` · ${note[1]}` : ""} · ${values()}`;
    redraw();
    redrawClose();
    if (signals) signals.at(time);
  }
  function seek(to) {
    time = Math.max(0, Math.min(end(), to));
    show();
  }
  function load(index) {
    run = data.runs[index];
    time = 0;
    slider.max = end();
    slider.step = slider.max / 2000 || 1;
    const view = run.q ? cell : cell.pegView(run);
    Object.assign(space, view.view);
    get("scale").textContent = view.scale;
    if (signals) signals.load(run);
    show();
  }
  function tick(now) {
    if (!playing) return;
    time += Number(pace.value) * (now - last) / 1000;
    last = now;
    if (time >= end()) { time = end(); play(false); }
    show();
    requestAnimationFrame(tick);
  }
  function play(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (time >= end()) time = 0;
    last = performance.now();
    requestAnimationFrame(tick);
  }
  button.addEventListener("click", () => play(!playing));
  for (const view of [canvas, close]) view?.addEventListener("keydown", (e) => { if (e.key === " ") { e.preventDefault(); play(!playing); } });
  slider.addEventListener("input", () => { play(false); seek(Number(slider.value)); });
  choice.addEventListener("change", () => { play(false); load(Number(choice.value)); });
  load(0);
  window.kr5Replay = { links: cell.links, posture, peg, time: () => time, signals };
})();

// A cell that moves through recorded postures.
(() => {
  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const get = (id) => document.getElementById(id);
  const canvas = get("scene"), slider = get("time"), button = get("play"), choice = get("run"), pace = get("pace"), told = get("told");

  let run = data.runs[0], time = 0, playing = false, last = 0;
  function posture(t) {
    let k = run.t.findIndex((x) => x > t);
    if (k < 0) k = run.t.length;
    if (k === 0) return run.q[0];
    if (k === run.t.length) return run.q[k - 1];
    const part = (t - run.t[k - 1]) / (run.t[k] - run.t[k - 1]);
    return run.q[k - 1].map((x, i) => x + part * (run.q[k][i] - x));
  }

  const cell = makeCell(data, data.runs.flatMap((r) => r.q.filter((_, k) => k % Math.max(1, Math.floor(r.q.length / 25)) === 0)));
  get("scale").textContent = cell.scale;
  const redraw = makeView(canvas, cell.view, (ink, project) => cell.draw(ink, project, posture(time)));
  const close = get("close");  // a page may have a second picture, close to the tube
  const redrawClose = close ? makeView(close, cell.close, (ink, project) => cell.draw(ink, project, posture(time), true)) : () => {};
  function show() {
    const q = posture(time), end = run.t[run.t.length - 1];
    slider.value = time;
    const values = q.map((x, i) => (data.joints[i].type === "prismatic" ? (1000 * x).toFixed(1) + " mm" : (x * 180 / Math.PI).toFixed(1) + "°"));
    const when = run.still ? `posture ${Math.min(run.q.length, Math.round(time / run.still) + 1)} of ${run.q.length}` : `${time.toFixed(2)} s of ${end.toFixed(2)} s`;
    const note = (run.notes || []).findLast(([from]) => from <= time + 1e-9);
    told.textContent = `${when}${note ? ` · ${note[1]}` : ""} · q = ${values.join(", ")}`;
    redraw();
    redrawClose();
  }
  function load(index) {
    run = data.runs[index];
    time = 0;
    slider.max = run.t[run.t.length - 1];
    slider.step = slider.max / 2000 || 1;
    show();
  }
  function tick(now) {
    if (!playing) return;
    time += Number(pace.value) * (now - last) / 1000;
    last = now;
    if (time >= run.t[run.t.length - 1]) { time = run.t[run.t.length - 1]; play(false); }
    show();
    requestAnimationFrame(tick);
  }
  function play(on) {
    playing = on;
    button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (time >= run.t[run.t.length - 1]) time = 0;
    last = performance.now();
    requestAnimationFrame(tick);
  }
  button.addEventListener("click", () => play(!playing));
  for (const view of [canvas, close]) view?.addEventListener("keydown", (e) => { if (e.key === " ") { e.preventDefault(); play(!playing); } });
  slider.addEventListener("input", () => { play(false); time = Number(slider.value); show(); });
  choice.addEventListener("change", () => { play(false); load(Number(choice.value)); });
  load(0);
  window.kr5Replay = { links: cell.links, posture: () => posture(time), time: () => time };
})();

// Signals over the time of a run: recorded and simulated, and below them the residual beside the band of its noise. All
// have one cursor, the time of the replay; dragging it calls `seek`.
function makeSignals(seek) {
  const get = (id) => document.getElementById(id);
  const host = get("signals"), list = get("columns"), summary = get("choice").querySelector("summary");
  const COLOURS = { given: "--plot-green", recorded: "--plot-blue", simulated: "--plot-red", residual: "--plot-ink" };
  const STEPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];  // postures between two ticks
  const SHOWN = 3;  // at first
  const unpacked = new Map();  // by packed values
  let run = null, chosen = new Set(), picked = false, span = [0, 1], whole = [0, 1], plots = [], now = 0;

  function unpack(packed) {
    if (!unpacked.has(packed)) {
      const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
      unpacked.set(packed, Array.from(new Uint16Array(bytes.buffer), (code) => (code === 65535 ? null : packed.low + packed.step * code)));
    }
    return unpacked.get(packed);
  }
  const number = (x) => (x === null || x === undefined ? "–" : Math.abs(x) < 1e-9 ? "0" : Math.abs(x) >= 1e4 || Math.abs(x) < 1e-3 ? x.toExponential(2) : x.toPrecision(4));

  // What the run asks for, else the widest gaps; without any, of each quantity the signal that changes most.
  function suggested() {
    if (run.first.length) return new Set(run.first);
    const wide = run.signals.filter((s) => s.gap !== null).sort((a, b) => b.above - a.above || b.gap - a.gap);
    const groups = new Map(), change = (s) => (s.simulated || s.recorded || { step: 0 }).step;
    for (const s of run.signals) if (!s.given && !(change(groups.get(s.group) || {}) >= change(s))) groups.set(s.group, s);
    const found = (wide.length ? wide : groups.size ? [...groups.values()] : run.signals).slice(0, SHOWN);
    return new Set(found.map((s) => s.name));
  }

  function fillList() {
    list.replaceChildren();
    const groups = new Map();
    for (const s of run.signals) groups.set(s.group, [...(groups.get(s.group) || []), s]);
    for (const [group, members] of groups) {
      const box = document.createElement("fieldset");
      box.append(Object.assign(document.createElement("legend"), { textContent: group }));
      for (const s of members) {
        const label = document.createElement("label");
        const tick = Object.assign(document.createElement("input"), { type: "checkbox", checked: chosen.has(s.name), value: s.name });
        tick.addEventListener("change", () => { picked = true; if (tick.checked) chosen.add(s.name); else chosen.delete(s.name); draw(); });
        label.append(tick, ` ${s.name}`);
        label.title = s.label;
        if (s.gap !== null) label.append(Object.assign(document.createElement("span"), { className: s.above ? "chip bad" : "chip", textContent: s.gap.toFixed(2) }));
        box.append(label);
      }
      list.append(box);
    }
  }

  const axis = (more) => ({
    stroke: () => themeColour("--plot-soft"), font: "12px system-ui, sans-serif",
    grid: { stroke: () => themeColour("--plot-line"), width: 1 }, ticks: { stroke: () => themeColour("--plot-edge"), width: 1, size: 4 }, ...more,
  });
  function curve(name, count) {
    const dots = run.hold !== null || name === "residual";  // postures have no way between them
    return {
      stroke: () => themeColour(COLOURS[name]), fill: undefined, width: 1.4, spanGaps: false,
      points: name === "simulated"  // rings, about the dots that they hide otherwise
        ? { show: dots, size: count > 400 ? 4 : 9, fill: "transparent", width: 1 }
        : { show: dots, size: count > 400 ? 2.5 : 5, fill: () => themeColour(COLOURS[name]), width: 0 },
      ...(dots ? { paths: () => null } : {}),
    };
  }
  function band(u) {  // two times the noise, to both sides
    const high = u.valToPos(2, "y", true), low = u.valToPos(-2, "y", true);
    u.ctx.save();
    u.ctx.globalAlpha = 0.5;
    u.ctx.fillStyle = themeColour("--plot-floor");
    u.ctx.fillRect(u.bbox.left, high, u.bbox.width, low - high);
    u.ctx.restore();
  }
  function begins(u) {  // of the parts of a run
    u.ctx.fillStyle = themeColour("--plot-edge");
    for (const [from] of run.notes) if (from > span[0] && from < span[1]) u.ctx.fillRect(u.valToPos(from, "x", true), u.bbox.top, 1, u.bbox.height);
  }
  function fitted(u, low, high) {  // no plot of rounding errors
    if (low === null) return [-1, 1];
    const least = 1e-6 * Math.max(1, Math.abs(low), Math.abs(high));
    return high - low > least ? uPlot.rangeNum(low, high, 0.1, true) : [low - 500 * least, high + 500 * least];
  }
  function wide(u, low, high) {
    const most = Math.max(4, 1.1 * Math.max(Math.abs(low ?? 0), Math.abs(high ?? 0)));
    return [-most, most];
  }
  // One plot: the curves of a signal that have one unit, over the shown part of the time.
  function plot(box, signal, names, height, withTime) {
    const x = unpack(signal.x), residual = names[0] === "residual";
    const u = new uPlot({
      width: Math.max(200, host.clientWidth), height, cursor: { show: false }, legend: { show: false }, padding: [8, 8, withTime ? 0 : 4, 0],
      scales: { x: { time: false, auto: false, min: span[0], max: span[1] }, y: { range: residual ? wide : fitted } },
      axes: [
        axis({ show: withTime, size: 30, ...(run.hold ? { incrs: STEPS.map((n) => n * run.hold) } : {}), values: (_, ticks) => (run.hold ? ticks.map((t) => +(t / run.hold).toFixed(0) + 1) : ticks.map((t) => +t.toFixed(6))) }),
        axis({ size: 58, space: residual ? 14 : 30 }),
      ],
      series: [{}, ...names.map((name) => curve(name, x.length))],
      hooks: { drawClear: residual ? [band, begins] : [begins] },
    }, [x, ...names.map((name) => unpack(signal[name]))], box);
    const line = document.createElement("div");
    line.className = "moment";
    u.over.append(line);
    drag(u);
    return { u, line };
  }
  function drag(u) {
    const over = u.over, to = (e) => u.posToVal(e.clientX - over.getBoundingClientRect().left, "x");
    let held = false;
    over.addEventListener("pointerdown", (e) => { held = true; over.setPointerCapture(e.pointerId); seek(to(e)); });
    over.addEventListener("pointermove", (e) => { if (held) seek(to(e)); });
    for (const name of ["pointerup", "pointercancel"]) over.addEventListener(name, () => { held = false; });
    over.addEventListener("wheel", (e) => { if (e.ctrlKey || e.metaKey) { e.preventDefault(); zoom(Math.exp(e.deltaY * 0.002), to(e)); } }, { passive: false });
  }

  function draw() {
    for (const { u } of plots) u.destroy();
    host.replaceChildren();
    plots = [];
    const weight = (s) => (s.above ? s.gap : 0);  // gaps above the limit of noise first, the others in their order
    for (const signal of run.signals.filter((s) => chosen.has(s.name)).sort((a, b) => weight(b) - weight(a))) {
      const article = document.createElement("article"), head = document.createElement("h3"), values = document.createElement("p");
      const shown = ["given", "recorded", "simulated"].filter((name) => signal[name]);
      head.textContent = `${signal.name}: ${signal.label}${signal.unit !== "-" && shown.length ? ` [${signal.unit}]` : ""}`;
      if (signal.gap !== null) head.append(" ", Object.assign(document.createElement("span"), { className: signal.above ? "chip bad" : "chip", textContent: `gap ${signal.gap.toFixed(2)}` }));
      values.className = "muted reading";
      article.append(head, values);
      host.append(article);
      const made = [];
      if (shown.length) made.push(plot(article, signal, shown, 150, !signal.residual));
      if (signal.residual) made.push(plot(article, signal, ["residual"], shown.length ? 96 : 130, true));
      for (const { u } of made) { u.root.setAttribute("role", "img"); u.root.setAttribute("aria-label", `${signal.label} over time`); }
      plots.push(...made.map((each, k) => ({ ...each, signal, values: k === 0 ? values : null })));
    }
    const all = run.signals.length;
    summary.textContent = `Columns: ${plots.filter((p) => p.values).length} of ${all} shown`;
    at(now);
  }

  function zoom(factor, about = now) {
    const least = (whole[1] - whole[0]) / 500;
    const width = Math.min(whole[1] - whole[0], Math.max(least, (span[1] - span[0]) * factor));
    const part = Math.max(0, Math.min(1, (about - span[0]) / (span[1] - span[0])));
    showFrom(about - part * width, width);
  }
  function showFrom(from, width) {
    const start = Math.max(whole[0], Math.min(whole[1] - width, from));
    span = [start, start + width];
    for (const { u } of plots) u.setScale("x", { min: span[0], max: span[1] });
    at(now);
  }

  function at(time) {
    now = time;
    if (run && (time < span[0] || time > span[1])) return showFrom(time - 0.1 * (span[1] - span[0]), span[1] - span[0]);
    for (const { u, line, signal, values } of plots) {
      line.style.transform = `translateX(${u.valToPos(time, "x")}px)`;
      if (!values) continue;
      const k = u.valToIdx(time), read = (name) => (signal[name] ? unpack(signal[name])[k] : undefined);
      const parts = ["given", "recorded", "simulated"].filter((name) => signal[name]).map((name) => `${name} ${number(read(name))}`);
      if (signal.residual) parts.push(`residual ${number(read("residual"))} times the noise`);
      values.textContent = parts.join(" · ");
    }
  }

  function legend() {
    const names = ["given", "recorded", "simulated", "residual"].filter((name) => run.signals.some((s) => s[name]));
    const text = { given: "given to the simulation", recorded: "recorded", simulated: "simulated", residual: "residual: recorded minus simulated, in units of the noise; the band is two times the noise" };
    get("legend").replaceChildren(...names.flatMap((name) => {
      const swatch = Object.assign(document.createElement("span"), { className: "swatch" });
      swatch.style.background = `var(${COLOURS[name]})`;
      return [swatch, `${text[name]}${name === names[names.length - 1] ? "." : ", "} `];
    }));
  }
  function load(next) {
    run = next;
    const end = run.t[run.t.length - 1], edge = run.hold ? run.hold / 2 : 0;
    whole = [-edge, Math.max(end + edge, 1e-6)];
    span = [...whole];
    now = 0;
    const names = new Set(run.signals.map((s) => s.name));
    const kept = [...chosen].filter((name) => picked && names.has(name));  // what the reader picked stays
    chosen = kept.length ? new Set(kept) : suggested();
    get("remark").textContent = run.remark;
    legend();
    fillList();
    draw();
  }

  get("zoom-in").addEventListener("click", () => zoom(0.5));
  get("zoom-out").addEventListener("click", () => zoom(2));
  get("zoom-all").addEventListener("click", () => { span = [...whole]; showFrom(whole[0], whole[1] - whole[0]); });
  document.addEventListener("themechange", () => { for (const { u } of plots) u.redraw(false); });
  new ResizeObserver(() => { for (const { u } of plots) u.setSize({ width: Math.max(200, host.clientWidth), height: u.height }); at(now); }).observe(host);
  return { load, at, shown: () => plots.filter((p) => p.values).map((p) => p.signal.name), span: () => [...span], values: (name) => plots.filter((p) => p.signal.name === name).map((p) => p.u.data) };
}

// A job as it runs: what the program tells ten times a second, until it says how the job ended.
(() => {
  const data = JSON.parse(document.getElementById("live-data").textContent), pellet = data.peg;
  const get = (id) => document.getElementById(id);
  const stream = new EventSource("stream");
  let now = null, redraw = null;

  function begin() {
    const cell = makeCell(data, [now.q]);
    get("scale").textContent = cell.scale;
    redraw = makeView(get("scene"), cell.view, (ink, project) => cell.draw(ink, project, now.q));
  }
  function show(told) {
    now = told;
    data.peg = now.gripped ? pellet : null;
    get("phase").textContent = now.pellet ? `Pellet ${now.pellet}: ${now.phase}.` : `${now.phase[0].toUpperCase()}${now.phase.slice(1)}.`;
    get("inserted").textContent = `${now.inserted} of ${data.pellets}`;
    get("time").textContent = `${now.time.toFixed(1)} s`;
    get("force").textContent = `${now.force.toFixed(1)} N`;
    if (redraw) redraw();
    else begin();
  }
  function end({ look, text }) {
    stream.close();
    const box = get("ending");
    box.classList.add(look);
    box.querySelector(".icon").textContent = look === "good" ? "✓" : "✗";
    box.querySelector("strong").textContent = text;
    box.hidden = false;
  }
  stream.addEventListener("message", (e) => show(JSON.parse(e.data)));
  stream.addEventListener("end", (e) => end(JSON.parse(e.data)));
  stream.addEventListener("error", () => end({ look: "unusable", text: "The program has ended." }));
  window.kr5Live = { posture: () => now && now.q };
})();

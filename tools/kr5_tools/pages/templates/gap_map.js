// The cell in the colours of its gaps, at the nominal cell or with the causes.
(() => {
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const cell = makeCell(data, [data.q]);
  document.getElementById("scale").textContent = cell.scale;
  let which = "before";
  const redraw = makeView(document.getElementById("scene"), cell.view, (ink, project, box) => {
    cell.colours = Object.fromEntries(data.parts.map((part) => [part.id, part[which].colour]));
    for (const id of ["sensor", "tool", "camera", "laser", "tube", "contact", ...data.joints.map((_, i) => `joint${i + 1}`)]) cell.colours[id] ??= "--plot-unknown";
    cell.draw(ink, project, data.q);
    const places = cell.places(data.q);
    drawLabels(ink, box, data.parts.filter((part) => places[part.id] && (part[which].label || (part.cause && which === "before"))).map((part) => ({
      at: project(places[part.id]), text: part.words + (part[which].label ? ` ${part[which].gap.toFixed(1)}` : "") + (part.cause && which === "before" ? ": cause" : ""),
    })));
  });
  for (const choice of document.getElementsByName("which")) choice.addEventListener("change", () => { which = choice.value; redraw(); });
})();

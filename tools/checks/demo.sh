# Sourced by tools/run. The job this is for: from images and robot poses to where the camera sits, in one page.

demo() {
  local out=$build/demo
  mkdir -p "$out"
  say "calibrating the camera on the arm from share/data/demo"
  "$venv/bin/kr5" calibrate hand-eye share/data/demo -o "$out/result.json"
  "$venv/bin/kr5" report "$out/result.json" -o "$out/report.html" --png "$out/plots"
  say "the report page: $out/report.html"
}

# Sourced by tools/run. Runs every test and check, counts, goes on after a failure, and ends with one line.

passed=0
failed=0

count() { passed=$((passed + $1)) failed=$((failed + $2)); }

# One check that either passes or fails.
check() {
  local what=$1; shift
  say "$what"
  if "$@"; then count 1 0; else echo "FAILED: $what" >&2; count 0 1; fi
}

# Adds up a JUnit file, which ctest and pytest write; a run that wrote none is one failure. In CI so is a skip.
count_junit() {
  local file=$1 sums
  sums=$("$python" - "$file" <<'TEXT'
import os
import sys
import xml.etree.ElementTree as xml
total = bad = skipped = 0
for suite in xml.parse(sys.argv[1]).getroot().iter("testsuite"):
    total += int(suite.get("tests", 0))
    bad += int(suite.get("failures", 0)) + int(suite.get("errors", 0))
    skipped += int(suite.get("skipped", 0)) + int(suite.get("disabled", 0))
print(total - bad - skipped, bad + (skipped if os.environ.get("CI") else 0))
TEXT
  ) || sums="0 1"
  count $sums
}

reference=${KR5_REFERENCE_DIR:+-DKR5_REFERENCE_DIR=$KR5_REFERENCE_DIR}

# Configures, builds and tests one preset.
test_preset() {
  local preset=$1
  local log=$build/log/$preset.txt junit=$build/log/$preset.xml
  rm -f "$junit"
  say "building with the preset $preset (log: build/log/$preset.txt)"
  if ! { quietly "$log" cmake --preset "$preset" ${reference:+"$reference"} &&
    quietly "$log" cmake --build --preset "$preset"; }; then
    count 0 1
    return
  fi
  say "testing with the preset $preset"
  ctest --preset "$preset" -j "$(nproc)" --output-junit "$junit" || true
  count_junit "$junit"
}

test_python() {
  local junit=$build/log/python.xml
  rm -f "$junit"
  say "testing the Python package and the command"
  "$venv/bin/python" -m pytest -q -n "$(nproc)" --dist loadfile --junitxml "$junit" || true
  count_junit "$junit"
}

# clang-tidy wants every file by itself, and GCC's warnings are no errors of its own.
tidy() {
  quietly "$build/log/tidy.txt" cmake --preset dev -B "$build/tidy" -DKR5_WARNINGS_AS_ERRORS=OFF || return
  "$python" tools/checks/style.py tidy --build "$build/tidy"
}

run_all_tests() {
  test_preset release
  test_preset asan
  if need_tool; then test_python; else count 0 1; fi
  check "format of the C++ files" "$python" tools/checks/style.py format
  check "clang-tidy on changed files" tidy
  check "the demo of the README" demo
  echo "$passed passed, $failed failed"
  [ "$failed" -eq 0 ]
}

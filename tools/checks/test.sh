# Sourced by tools/run. Runs every test and check, counts, goes on after a failure, and ends with one line.

passed=0
failed=0
failures=""  # what failed, a line each: said again at the end, where the output of a long run is looked at

count() { passed=$((passed + $1)) failed=$((failed + $2)); }

# One failure, by name.
note_failure() { failures+="$1"$'\n'; }

# One check that either passes or fails.
check() {
  local what=$1; shift
  say "$what"
  if "$@"; then count 1 0; else echo "FAILED: $what" >&2; count 0 1; note_failure "$what"; fi
}

# Adds up a JUnit file, which ctest and pytest write; a run that wrote none is one failure. In CI so is a skip.
count_junit() {
  local what=$1 file=$2 found
  if found=$("$python" tools/checks/junit.py "$file"); then
    count $(head -n 1 <<<"$found")
    failures+=$(tail -n +2 <<<"$found" | sed "s|^|$what: |"; echo .)
    failures=${failures%.}
  else
    count 0 1
    note_failure "$what: no result"
  fi
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
    note_failure "build with the preset $preset"
    return
  fi
  say "testing with the preset $preset"
  # What passed as it is does not run again; in CI, and where all trials are asked for, everything does. By the names
  # "<module>/...": a second -LE beside that of the preset asan would exclude only tests that have both labels.
  local same=""
  [ -n "${CI:-}${KR5_FULL:-}" ] || same=$("$python" tools/checks/unchanged.py list "$build/$preset") || true
  [ -z "$same" ] || say "unchanged since all their tests passed, and not run again: $same"
  ctest --preset "$preset" -j "$(nproc)" ${same:+-E "^(${same// /|})/"} --output-junit "$junit" || true
  count_junit "$preset" "$junit"
  [ ! -f "$junit" ] || "$python" tools/checks/unchanged.py note "$build/$preset" "$junit" || true
}

test_python() {
  local junit=$build/log/python.xml
  rm -f "$junit"
  wait "$environment" || true  # need_tool tries again, and says what failed
  need_wheel && need_requirements test docs || { count 0 1; note_failure "build of the Python package"; return; }
  say "testing the Python package and the command"
  "$venv/bin/python" -m pytest -q -n "$(nproc)" --dist loadscope --durations 10 --junitxml "$junit" || true
  count_junit python "$junit"
}

# The library; its tests pass the compiler's warnings. GCC's warnings are no errors of clang-tidy.
tidy() {
  quietly "$build/log/tidy.txt" cmake --preset dev -B "$build/tidy" -DKR5_WARNINGS_AS_ERRORS=OFF -DKR5_UNITY=ON \
    -DKR5_BUILD_TESTS=OFF || return
  "$python" tools/checks/style.py tidy --build "$build/tidy"
}

# Python: one formatter, lint, who imports whom, and types, strictly those of kr5_tools and of what is Python in kr5,
# against the stubs of its extensions; the package as it was installed last.
check_python() {
  local places=(tools tests bindings/kr5 share/notebooks)
  check "format of the Python files" "$venv/bin/ruff" format --check "${places[@]}"
  check "lint of the Python files" "$venv/bin/ruff" check "${places[@]}"
  check "who imports whom" env PYTHONPATH=tools "$venv/bin/lint-imports"
  check "types of the Python files" "$venv/bin/mypy"
  check "types of the Python package" "$venv/bin/mypy" -p kr5.files -p kr5.logs -p kr5.models -p kr5.tables
  check "share of parameters typed Any" "$venv/bin/python" tools/checks/any_share.py
}

# What `install` puts below a prefix: the command runs, and a project apart diagnoses a log with the library there.
check_installed() {
  local prefix=$build/installed consumer=$build/consumer data=$here/share/data/arm_log
  rm -rf "$prefix" "$consumer"
  install_to "$prefix" || return
  "$prefix/bin/kr5" --version || return
  quietly "$build/log/consumer.txt" cmake -G Ninja -S tests/consumer -B "$consumer" -DCOMPONENT=arm_log \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$prefix" || return
  quietly "$build/log/consumer.txt" cmake --build "$consumer" || return
  "$consumer/consumer" "$data/joint_states.csv" "$data/arm.urdf"
}

# Runs a part and notes how long it took.
times=""
timed() {
  local what=$1 start=$SECONDS; shift
  "$@"
  times+=$(printf '%5d s  %s' "$((SECONDS - start))" "$what")$'\n'
}

run_all_tests() {
  mkdir -p "$build"
  { need_venv && need_requirements test docs; } >/dev/null 2>&1 &  # loads from the network while the C++ tests are compiled
  environment=$!
  timed "C++ tests, optimised" test_preset release
  timed "C++ tests under sanitizers" test_preset asan
  timed "C++ tests of threads under the thread sanitizer" test_preset tsan
  timed "Python package and its tests" test_python
  timed "installation below a prefix" check "command and C++ package of an installation" check_installed
  timed "Python checks" check_python
  timed "format" check "format of the C++ files" "$python" tools/checks/style.py format
  timed "clang-tidy" check "clang-tidy on changed files" tidy
  timed "demo" check "the demo of the README" demo
  say "where the time went"
  printf '%s' "$times" >&2
  [ -z "$failures" ] || { say "what failed"; printf '%s' "$failures" >&2; }
  echo "$passed passed, $failed failed"
  [ "$failed" -eq 0 ]
}

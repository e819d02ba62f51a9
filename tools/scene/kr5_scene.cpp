// SPDX-License-Identifier: BSD-3-Clause
// kr5_scene FILE: runs a scene and says what came of each expectation; 0 when all came true, 1 when not, 2 for bad
// input.
#include <cstdio>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/sim/scene.hpp>

namespace {

std::string bounds(const kr5::sim::Expectation& e) {
  std::string out;
  if (e.min) out += " at least " + std::to_string(*e.min);
  if (e.max) out += " at most " + std::to_string(*e.max);
  return out;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: kr5_scene FILE\n", stderr);
    return 2;
  }
  try {
    const kr5::sim::SceneResult result = kr5::sim::run_scene(words[1]);
    for (const kr5::sim::SceneCheck& check : result.checks)
      std::printf("%s %s of %s is %g, expected%s\n", check.passed ? "ok    " : "FAILED",
                  std::string(kr5::name_of(check.expected.statistic)).c_str(), check.expected.column.c_str(),
                  check.value, bounds(check.expected).c_str());
    return result.passed ? 0 : 1;
  } catch (const kr5::Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return 2;
  }
}

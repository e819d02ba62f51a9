// SPDX-License-Identifier: BSD-3-Clause
// Motion that excites the dynamics of an arm, and what it tells of them.  11_excitation SHARE
#include <cstdio>
#include <string>

#include <kr5/cell/cell.hpp>
#include <kr5/identification/excitation.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto cell = cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml");
  const auto limits = identification::motion_limits(cell);
  const auto found =
      identification::design_excitation(cell, limits, {.duration = 20.0, .lowest = 0.1, .starts = 5, .exchanges = 200});

  std::printf("base parameters %d\n", found.base_parameters);
  std::printf("condition number below 100: %s\n", found.condition < 100 ? "yes" : "no");
  std::printf("better than the best of the starts: %s\n",
              found.condition < found.condition_after.front() ? "yes" : "no");
  const auto motion = found.motion.sampled(0.012);
  std::printf("%d samples, speeds at the ends %.3f and %.3f rad/s\n", static_cast<int>(motion.samples()),
              motion.qd.row(0).norm(), motion.qd.bottomRows(1).norm());
}

// SPDX-License-Identifier: BSD-3-Clause
#include "identification/log/runs.hpp"

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::identification {

using Eigen::Index;
using physics::RowRange;

std::vector<RowRange> runs_of(const std::vector<int>& run_starts, Index rows) {
  if (run_starts.empty()) return {{0, rows}};
  std::vector<RowRange> out;
  for (std::size_t k = 0; k < run_starts.size(); ++k)
    out.push_back({run_starts[k], k + 1 < run_starts.size() ? run_starts[k + 1] : rows});
  return out;
}

void require_run_starts(const std::vector<int>& run_starts, Index rows) {
  require(run_starts.empty() || run_starts.front() == 0, "run_starts: rows in ascending order, 0 first");
  for (std::size_t k = 1; k < run_starts.size(); ++k)
    require(run_starts[k] > run_starts[k - 1] && run_starts[k] < rows, "run_starts: rows in ascending order, 0 first");
}

void require_rising_times(const Eigen::VectorXd& t, const std::vector<int>& run_starts) {
  for (const RowRange& run : runs_of(run_starts, t.size()))
    for (Index i = run.first + 1; i < run.last; ++i)
      require(t[i] > t[i - 1], "t: row " + std::to_string(i) + " is not later than the one before [s]");
}

}  // namespace kr5::identification

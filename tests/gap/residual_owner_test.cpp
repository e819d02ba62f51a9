#include "gap/reporting/residual_owner.hpp"

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace residual_owner_test {

using namespace kr5;
using Catch::Contains;

namespace {

cell::Recording two_experiments() {
  cell::Recording out;
  for (const Eigen::Index rows : {4, 6}) {
    cell::Experiment e;
    e.name = "motion-" + std::to_string(rows);
    e.data.values = Eigen::MatrixXd::Zero(rows, 2);
    out.experiments.push_back(e);
  }
  return out;
}

gap::ResidualColumn residuals(const std::string& experiment, Eigen::Index rows, Eigen::Index cells) {
  return {experiment, "i1", 1.0, Eigen::MatrixXd::Zero(rows, cells)};
}

}  // namespace

TEST_CASE("residuals belong to the experiment of their name, with as many rows") {
  const cell::Recording recording = two_experiments();
  CHECK(gap::experiment_of(recording, residuals("motion-4", 4, 1)) == 0);
  CHECK(gap::experiment_of(recording, residuals("motion-6", 6, 1)) == 1);
  const std::string reason = "do not belong to this recording";
  CHECK_THROWS_WITH(gap::experiment_of(recording, residuals("motion-6", 4, 1)),
                    Contains("motion-6") && Contains(reason));
  CHECK_THROWS_WITH(gap::experiment_of(recording, residuals("motion-5", 4, 1)),
                    Contains("motion-5") && Contains(reason));
}

TEST_CASE("a cell that residuals are not of is refused by the name of the argument") {
  const gap::ResidualColumn column = residuals("motion-4", 4, 2);
  CHECK_NOTHROW(gap::require_cell(column, "cell", 0));
  CHECK_NOTHROW(gap::require_cell(column, "cell", 1));
  CHECK_THROWS_WITH(gap::require_cell(column, "without", 2),
                    Catch::StartsWith("without: ") && Contains("residuals of 2 cells, not of cell 2"));
  CHECK_THROWS_WITH(gap::require_cell(column, "without", -1), Contains("not of cell -1"));
}

}  // namespace residual_owner_test

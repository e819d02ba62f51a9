#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/reporting/residual_owner.hpp"

namespace residual_owner_test {

using namespace kr5;
using Catch::Contains;

namespace {

/// Two experiments of five and of three rows.
cell::Recording recording() {
  cell::Recording out;
  for (const auto& [name, rows] : {std::pair{"motion-1", 5}, std::pair{"motion-2", 3}}) {
    cell::Experiment e;
    e.name = name;
    e.data.columns = {"i1"};
    e.data.values = Eigen::MatrixXd::Zero(rows, 1);
    out.experiments.push_back(e);
  }
  return out;
}

gap::ResidualColumn residuals(const std::string& experiment, int rows, int cells) {
  return {experiment, "i1", 1.0, Eigen::MatrixXd::Zero(rows, cells)};
}

}  // namespace

TEST_CASE("residuals are those of the experiment of their name with as many rows") {
  const cell::Recording r = recording();
  CHECK(gap::experiment_of(r, residuals("motion-1", 5, 1)) == 0);
  CHECK(gap::experiment_of(r, residuals("motion-2", 3, 1)) == 1);
  CHECK_THROWS_WITH(gap::experiment_of(r, residuals("motion-2", 5, 1)), Contains("motion-2"));
  CHECK_THROWS_AS(gap::experiment_of(r, residuals("motion-3", 3, 1)), InvalidArgument);
}

TEST_CASE("a cell of which there are no residuals is refused by the name of the argument") {
  const gap::ResidualColumn two = residuals("motion-1", 5, 2);
  CHECK_NOTHROW(gap::require_cell(two, "which", 1));
  CHECK_THROWS_WITH(gap::require_cell(two, "without", 2),
                    Contains("without: found residuals of 2 cells, not of cell 2"));
  CHECK_THROWS_WITH(gap::require_cell(two, "which", -1), Contains("not of cell -1"));
}

}  // namespace residual_owner_test

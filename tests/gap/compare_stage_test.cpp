#include "gap/stages/compare_stage.hpp"

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/linear_world.hpp"

namespace compare_stage_test {

using namespace kr5;
using namespace linear_world;

TEST_CASE("the first stage gives the residuals of the nominal cell, what they lack and what they cannot show") {
  const Zeros simulator;
  cell::Recording r;
  r.cell = unit_noise();
  r.cell.noise.current = 0.5;
  r.experiments = {motion("motion-1", cell::Split::Fit, 50)};
  add_column(r.experiments[0], "i1", Eigen::VectorXd::LinSpaced(50, 0, 1));
  add_column(r.experiments[0], "fx", Eigen::VectorXd::Zero(50));
  r.cell.noise.force = 0.0;
  gap::DiagnoseOptions options;
  std::vector<std::string> told;
  options.progress = [&](const std::string& stage, double) { told.push_back(stage); };
  const gap::CompareOutput out = gap::compare_stage(r, simulator, options);
  CHECK(out.base == Eigen::VectorXd(r.experiments[0].data.column("i1") / 0.5));
  CHECK(out.data.recording == &r);
  REQUIRE(out.data.left_out.size() == 1);
  CHECK(out.data.left_out[0].columns == std::vector<std::string>{"fx"});
  CHECK(out.data.left_out[0].reason == gap::LeftOutReason::NoiseNotStated);
  REQUIRE(out.missing_splits.size() == 1);
  CHECK(out.missing_splits[0].split == cell::Split::Check);
  REQUIRE(out.scope.size() == 1);
  CHECK(out.scope[0].reason == gap::ScopeReason::OneKind);
  CHECK(told == std::vector<std::string>{"simulating the nominal cell"});
  r.cell.noise.current = 0.0;
  CHECK_THROWS_AS(gap::compare_stage(r, simulator, options), InvalidArgument);
}

}  // namespace compare_stage_test

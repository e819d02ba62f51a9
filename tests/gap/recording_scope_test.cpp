#include "gap/recording_scope.hpp"

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

namespace recording_scope_test {

using namespace kr5;
using namespace linear_world;

TEST_CASE("what a recording cannot show is told: few rows, nothing that moves, one kind") {
  cell::Recording r;
  r.cell = unit_noise();
  cell::Experiment still = motion("motion-2", cell::Split::Check, 50);
  still.data.values.col(still.data.find("qc1")).setZero();
  cell::Experiment step = experiment("step-1", cell::Kind::Step, cell::Split::Fit);
  add_column(step, "t", Eigen::VectorXd::Zero(1));
  r.experiments = {motion("motion-1", cell::Split::Fit, 50), still, step};
  const std::vector<gap::ScopeLimit> brief = gap::scope_limits(r);
  REQUIRE(brief.size() == 2);
  CHECK(brief[0].reason == gap::ScopeReason::AtRest);
  CHECK(brief[0].experiment == "motion-2");
  CHECK(brief[1].reason == gap::ScopeReason::FewRows);
  CHECK(brief[1].experiment == "step-1");
  CHECK(brief[1].rows == 1);
  CHECK_FALSE(gap::only_loads(r));
  r.experiments = {motion("motion-1", cell::Split::Fit, 50), motion("motion-2", cell::Split::Check, 9)};
  const std::vector<gap::ScopeLimit> one_kind = gap::scope_limits(r);
  REQUIRE(one_kind.size() == 2);
  CHECK(one_kind[0].reason == gap::ScopeReason::FewRows);
  CHECK(one_kind[0].rows == 9);
  CHECK(one_kind[1].reason == gap::ScopeReason::OneKind);
  CHECK(one_kind[1].kind == cell::Kind::Motion);
  CHECK(gap::only_loads(r));
}

}  // namespace recording_scope_test

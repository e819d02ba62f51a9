#include "gap/stages/screen_stage.hpp"

#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

#include "gap/staged.hpp"

/// @file
/// What is screened, and the noise of poses that is known afterwards.

namespace screen_stage_test {

using namespace kr5;
using namespace staged;

namespace {

cell::Experiment poses(double noise, double with_q1) { return moved_poses(Random(161), 60, noise, with_q1); }

gap::Hypothesis moving_x() {
  gap::OwnEffect own{{"moves", "x"}, {{"size", "m", 1.0, -1e9, 1e9, {}}}, {}, {}};
  own.change = [](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (e.kind == cell::Kind::Poses) table.values.col(table.find("x")) += x(0) * e.data.column("q1");
  };
  return gap::own_hypothesis(own);
}

}  // namespace

TEST_CASE("effects of the caller are screened beside the catalogue, and what shows nowhere is told") {
  const Stages s(Recorded{.of_wave = 5.0}.recording());
  const gap::ScreenOutput& out = s.screened;
  REQUIRE(out.screen.candidates().size() == 2);  // the simulator shows nothing of the catalogue
  CHECK(out.screen.candidates()[0]->hypothesis.effect == "wave");
  CHECK(out.screen.effects() == 2);
  CHECK(std::ranges::count(out.screen.unseen(), gap::EffectName{"coulomb_friction", "joint1"}) == 1);
  REQUIRE(out.groups.size() == 2);
  CHECK(out.groups[0].name() == "motion.i1");
  CHECK(out.nuisance.empty());
  CHECK(out.base == s.noise.base);
  CHECK(out.pose_noise.empty());
}

TEST_CASE("loads alone make lengths less likely than masses") {
  /// Shows every effect of joint 1 in i1.
  class Effects : public Zeros {
   public:
    io::Table simulate(const cell::Cell& cell, const cell::Experiment& e) const override {
      io::Table out = Zeros::simulate(cell, e);
      for (const cell::ActiveEffect& effect : cell::active_effects(cell.effects))
        if (effect.target == "joint1" && out.find("i1") >= 0)
          out.values.col(out.find("i1")).array() += effect.id == "link_mass" ? 2.0 : 1.0;
      return out;
    }
  };
  const Effects simulator;
  for (const bool with_poses : {false, true}) {
    cell::Recording r = Recorded{}.recording();
    if (with_poses) r.experiments.push_back(poses(1.0, 0.0));
    const gap::CompareOutput compared = gap::compare_stage(r, simulator, {});
    const gap::ScreenOutput out = gap::screen_stage(gap::noise_stage(compared, {}), {});
    double length = 0.0, mass = 0.0;
    for (const auto& c : out.screen.candidates()) {
      if (c->hypothesis.effect == "link_twist") length = c->hypothesis.log_prior;
      if (c->hypothesis.effect == "link_mass") mass = c->hypothesis.log_prior;
    }
    CHECK(length - mass == Approx(with_poses ? 0.0 : -std::log(100.0)));
  }
}

TEST_CASE("the noise of poses is what no effect explains, and corrects blocks and residuals") {
  cell::Recording r = Recorded{}.recording();
  r.experiments.push_back(poses(2.0, 40.0));
  r.experiments.back().data.values(7, r.experiments.back().data.find("y")) += 60.0;
  gap::DiagnoseOptions with = options();
  with.own_hypotheses.push_back(moving_x());
  const Stages s(r, with);
  const gap::ScreenOutput& out = s.screened;
  CHECK(out.stray_poses == 1);
  REQUIRE(out.pose_noise.size() == 1);
  CHECK(out.pose_noise[0].ratio == Approx(2.0).epsilon(0.2));
  for (const gap::Block& block : out.data.blocks) {
    const double ratio = block.kind == cell::Kind::Poses ? out.pose_noise[0].ratio : 1.0;
    CHECK(block.sigma == Approx(ratio));
    CHECK((block.rows_of(out.base) * ratio - block.rows_of(s.noise.base)).norm() < 1e-9);
  }
  CHECK(out.data.use.sum() == static_cast<double>(out.data.size) - 1);
}

}  // namespace screen_stage_test

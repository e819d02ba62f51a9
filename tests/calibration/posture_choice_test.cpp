#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/calibration/posture_choice.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/problem.hpp>

namespace posture_choice_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Detail::Approx;
using Catch::Matchers::Contains;

namespace {

kinematics::DhChain arm() {
  return cell::nominal_chain(cell::load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml"));
}

std::vector<Eigen::VectorXd> random_postures(Random& random, int count) {
  std::vector<Eigen::VectorXd> out;
  for (int i = 0; i < count; ++i) out.push_back(random.normal_vector(6));
  return out;
}

}  // namespace

TEST_CASE("chosen postures tell more than random ones, by each criterion") {
  Random random(1);
  const auto candidates = random_postures(random, 300);
  for (const PostureCriterion criterion :
       {PostureCriterion::Determinant, PostureCriterion::Prediction, PostureCriterion::Variance}) {
    PostureChoiceOptions o;
    o.count = 30, o.criterion = criterion, o.point = Eigen::Vector3d(0.1, 0, 0.1);
    const PostureChoice chosen = choose_postures(arm(), candidates, o);
    CHECK(chosen.chosen.size() == 30);
    CHECK(std::is_sorted(chosen.chosen.begin(), chosen.chosen.end()));
    CHECK(std::adjacent_find(chosen.chosen.begin(), chosen.chosen.end()) == chosen.chosen.end());
    for (int trial = 0; trial < 5; ++trial) {
      // As many random ones: choosing all of thirty gives their value.
      const PostureChoice other = choose_postures(arm(), random_postures(random, 30), o);
      CAPTURE(static_cast<int>(criterion), chosen.value, other.value);
      if (criterion == PostureCriterion::Determinant) CHECK(chosen.value > other.value);
      if (criterion == PostureCriterion::Variance) CHECK(chosen.value < other.value);
    }
    const bool grows = criterion == PostureCriterion::Determinant;
    for (std::size_t k = 1; k < chosen.value_after.size(); ++k)
      CHECK((grows ? chosen.value_after[k] > chosen.value_after[k - 1]
                   : chosen.value_after[k] < chosen.value_after[k - 1] * (1 + 1e-9)));
  }
}

TEST_CASE("of few candidates the best pair is that of all pairs") {
  Random random(2);
  const auto candidates = random_postures(random, 12);
  PostureChoiceOptions o;
  o.count = 2;
  o.criterion = PostureCriterion::Determinant;
  const double found = choose_postures(arm(), candidates, o).value;
  double best = -1e300;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    for (std::size_t k = i + 1; k < candidates.size(); ++k)
      best = std::max(best, choose_postures(arm(), std::vector{candidates[i], candidates[k]}, o).value);
  CHECK(found <= best + 1e-12);
  CHECK(found > best - 0.02);
}

TEST_CASE("the stated uncertainty of the predicted place is that of a cell fit with the same priors") {
  Random random(4);
  const auto postures = random_postures(random, 9);
  PostureChoiceOptions o;
  o.count = 9, o.measures_pose = true, o.point = Eigen::Vector3d(0.1, -0.2, 0.3);
  o.sigma_position = 2e-4, o.sigma_rotation = 3e-3;
  fit::Problem fit;
  const fit::FitBlock base = fit.add_pose("base", Pose::Identity()), links = fit.add_arm("arm", arm()),
                      tool = fit.add_pose("tool", Pose::Identity());
  Eigen::VectorXd tolerance(30);
  for (int k = 0; k < 30; ++k) tolerance[k] = k % 5 == 0 || k % 5 == 2 ? o.tolerance_length : o.tolerance_angle;
  fit.set_prior(links, tolerance);
  fit.set_prior(base, Vector6::Constant(10.0)), fit.set_prior(tool, Vector6::Constant(10.0));
  std::vector<fit::FitMeasurement> places;
  for (const Eigen::VectorXd& q : postures) {
    const fit::PoseChain chain = fit::PoseChain().then(base).then_arm(links, q).then(tool);
    fit.add(fit::PoseMeasurement(chain, arm().flange(q), o.sigma_position, o.sigma_rotation));
    places.push_back(fit.add(fit::PositionMeasurement(chain, o.point, fit::FitPoint(), 1.0)));
    fit.set_weight(places.back(), 0.0);
  }
  const fit::Solution result = fit.solve();
  double variance = 0;
  for (const fit::FitMeasurement place : places) {
    const Eigen::MatrixXd J = fit.derivatives(place)->by_coordinate;
    variance += (J * result.covariance * J.transpose()).trace() / 9;
  }
  CHECK(choose_postures(arm(), postures, o).value == Approx(std::sqrt(variance)).epsilon(1e-4));
}

TEST_CASE("a choice of more postures than there are is refused") {
  Random random(3);
  const auto few = random_postures(random, 5);
  CHECK_THROWS_WITH(choose_postures(arm(), few), Contains("there are only 5 candidates"));
}

}  // namespace posture_choice_test

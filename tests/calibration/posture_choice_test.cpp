#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/calibration/posture_choice.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::calibration;
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

TEST_CASE("a choice of more postures than there are is refused") {
  Random random(3);
  const auto few = random_postures(random, 5);
  CHECK_THROWS_WITH(choose_postures(arm(), few), Contains("there are only 5 candidates"));
}

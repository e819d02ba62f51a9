#include "gap/reporting/variables.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"
#include "gap/reporting/structure.hpp"

/// @file
/// What a residual may depend on.

namespace variables_test {

using namespace kr5;
using namespace linear_world;

namespace {

const gap::VariableValues* of(const std::vector<gap::VariableValues>& all, const std::string& symbol) {
  const auto found =
      std::ranges::find_if(all, [&](const gap::VariableValues& v) { return gap::symbol(v.variable) == symbol; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

TEST_CASE("rates are central differences of the commands, and friction's variables know the direction") {
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 300);
  Random random(61);
  add_column(e, "i1", random.normal_vector(300));
  add_column(e, "i2", random.normal_vector(300));
  const World world({e});
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  const std::vector<gap::VariableValues> of_1 = gap::variables(world.data, groups[0], world.base);
  const Eigen::ArrayXd t = e.data.column("t");
  REQUIRE(of(of_1, "q1"));
  CHECK(of(of_1, "q1")->values == e.data.column("qc1"));
  const Eigen::VectorXd qd = of(of_1, "qd1")->values, qdd = of(of_1, "qdd1")->values;
  // Central differences of sin(pi t) are its derivative times sinc(pi step).
  const double sinc = std::sin(M_PI * step) / (M_PI * step);
  for (Eigen::Index i = 1; i + 1 < 300; ++i) CHECK(qd(i) == Approx(M_PI * sinc * std::cos(M_PI * t(i))).margin(1e-9));
  for (Eigen::Index i = 2; i + 2 < 300; ++i)
    CHECK(qdd(i) == Approx(-M_PI * M_PI * sinc * sinc * std::sin(M_PI * t(i))).margin(1e-9));
  CHECK(qd(0) == 0.0);
  CHECK(gap::velocity(e, 0) == qd);
  CHECK(gap::velocity(motion("empty", cell::Split::Fit, 3), 6).size() == 0);
  const gap::VariableValues* speed = of(of_1, "|qd1|");
  REQUIRE(speed);
  CHECK(speed->variable.joint == 1);
  for (Eigen::Index i = 1; i + 1 < 300; ++i) {
    CHECK(speed->values(i) == std::abs(qd(i)));
    CHECK(speed->sign(i) == (qd(i) > 1e-4 ? 1.0 : qd(i) < -1e-4 ? -1.0 : 0.0));
  }
  // Joints that stand still are no variables, and the speed of another joint tells nothing of direction.
  CHECK_FALSE(of(of_1, "q2"));
  const std::vector<gap::VariableValues> of_2 = gap::variables(world.data, groups[1], world.base);
  CHECK(of(of_2, "q1")->sign.size() == 0);
  CHECK_FALSE(of(of_2, "|qd1|"));
}

TEST_CASE("what the simulator predicts is recorded less residual, over all experiments of a column") {
  std::vector<cell::Experiment> all = {motion("motion-1", cell::Split::Fit, 40),
                                       motion("motion-2", cell::Split::Check, 30)};
  Random random(62);
  cell::Cell cell = unit_noise();
  cell.noise.current = 0.5;
  for (cell::Experiment& e : all) add_column(e, "i1", random.normal_vector(e.data.values.rows(), 2.0));
  const World world(all, cell);
  const gap::Group group = gap::make_groups(world.data).front();
  Eigen::VectorXd counted = random.normal_vector(world.data.size);
  const std::vector<gap::VariableValues> found = gap::variables(world.data, group, counted);
  const gap::VariableValues* predicted = of(found, "predicted i1");
  REQUIRE(predicted);
  REQUIRE(predicted->values.size() == 70);
  Eigen::VectorXd recorded(70);
  recorded << all[0].data.column("i1"), all[1].data.column("i1");
  CHECK((predicted->values - (recorded - 0.5 * counted)).cwiseAbs().maxCoeff() <= 0.5e-3 * 0.5 + 1e-12);  // rounded
  // A prediction that does not change is no variable.
  CHECK_FALSE(of(gap::variables(world.data, group, recorded / 0.5), "predicted i1"));
}

TEST_CASE("rates do not reach over the end of a run") {
  cell::Experiment e = experiment("step-1", cell::Kind::Step, cell::Split::Fit);
  const Eigen::Index rows = 40;
  Eigen::VectorXd run(rows), t(rows), zc(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    run(i) = i < 20 ? 0 : 1;
    t(i) = step * static_cast<double>(i);
    zc(i) = run(i) + 0.3 * (t(i) - (i < 20 ? 0.0 : t(20)));
  }
  add_column(e, "run", run);
  add_column(e, "t", t);
  add_column(e, "zc", zc);
  add_column(e, "z", Eigen::VectorXd::Zero(rows));
  const World world({e});
  const std::vector<gap::VariableValues> found =
      gap::variables(world.data, gap::make_groups(world.data).front(), world.base);
  REQUIRE(of(found, "zcd"));
  for (Eigen::Index i = 0; i < rows; ++i)
    CHECK(of(found, "zcd")->values(i) == Approx(i == 0 || i == 19 || i == 20 || i == 39 ? 0.0 : 0.3).margin(1e-9));
  CHECK(of(found, "zc"));
  CHECK_FALSE(of(found, "run"));  // a label
}

}  // namespace variables_test

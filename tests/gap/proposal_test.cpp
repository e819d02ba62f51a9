#include "gap/planning/proposal.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Experiments that a cell could do next.

namespace proposal_test {

using namespace kr5;
using namespace linear_world;

namespace {

cell::Recording recorded() {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion("motion-1", cell::Split::Check, 100), motion("motion-2", cell::Split::Fit, 100, 50.0)};
  for (cell::Experiment& e : r.experiments) {
    e.data.values.col(e.data.find("qc3")).setConstant(-2.75);  // within the limits of joint 3
    add_column(e, "i1", Eigen::VectorXd::Ones(100));
  }
  cell::Experiment empty = experiment("step-1", cell::Kind::Step, cell::Split::Fit);
  add_column(empty, "t", Eigen::VectorXd::Zero(1));
  r.experiments.push_back(empty);
  return r;
}

}  // namespace

TEST_CASE("the first experiment of a kind with rows is the one to repeat, and its clock goes on") {
  const cell::Recording r = recorded();
  REQUIRE(gap::recorded_experiment(r, cell::Kind::Motion));
  CHECK(gap::recorded_experiment(r, cell::Kind::Motion)->name == "motion-1");
  CHECK(gap::recorded_experiment(r, cell::Kind::Step) == nullptr);  // one row tells nothing
  CHECK(gap::recorded_experiment(r, cell::Kind::Views) == nullptr);
  CHECK(gap::end_time_of(r, cell::Kind::Motion) == Approx(50.0 + 99 * step));
  CHECK(gap::end_time_of(r, cell::Kind::Views) == 0.0);
}

TEST_CASE("a repeated experiment has the given columns after the clock, lead-in included, and takes its time") {
  cell::Recording r = recorded();
  cell::Experiment whole = r.experiments[0];
  const cell::Experiment cut = cell::split_lead_in(whole, 20 * step);
  for (const cell::Experiment& e : {whole, cut}) {
    const gap::Proposal p = gap::repeat_experiment(gap::Family{r, {}}, e, "once more");
    CHECK(p.what == "once more");
    CHECK(p.seconds == Approx(gap::set_up + 99 * step));
    const io::Table& table = p.experiment.data;
    CHECK(table.find("i1") < 0);
    CHECK(table.find("qc6") >= 0);
    const Eigen::Index led = p.experiment.lead_in.values.rows();
    CHECK(led == e.lead_in.values.rows());
    CHECK(led + table.values.rows() == 100);
    const io::Table& first = led > 0 ? p.experiment.lead_in : table;
    CHECK(first.column("t")(0) == Approx(gap::end_time_of(r, cell::Kind::Motion) + gap::set_up));
    CHECK(table.column("qc1") == e.data.column("qc1"));
  }
}

TEST_CASE("joints are read from the targets of effects, each once") {
  CHECK(gap::joints_of({{{"coulomb_friction", "joint3"}, {"wrist_coupling", "motor5"}},
                        {{"ft_bias", "fx"}, {"link_mass", "joint3"}, {"link_mass", "joint1"}}}) ==
        std::vector<int>{2, 4, 0});
  CHECK(gap::joints_of({{{"hand_eye", "camera"}}}).empty());
  CHECK(gap::two_digits(0.012345) == "0.012");
  CHECK(gap::two_digits(123.0) == "1.2e+02");
}

TEST_CASE("proposals are of the kind asked for, and none where the cell or the recording lacks what they need") {
  const cell::Recording r = recorded();
  const gap::Family family{r, {0}};
  for (const auto& [kind, name] : enum_names(cell::Kind{})) {
    const std::vector<gap::Proposal> found = gap::proposals(family, kind);
    CAPTURE(name);
    for (const gap::Proposal& p : found) CHECK(p.experiment.kind == kind);
    const bool needs_recording = kind == cell::Kind::Views || kind == cell::Kind::Scan || kind == cell::Kind::Profile;
    CHECK(found.empty() == needs_recording);
  }
}

}  // namespace proposal_test

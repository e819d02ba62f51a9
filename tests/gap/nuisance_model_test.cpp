#include "gap/fitting/nuisance_model.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Small errors of many parameters, marginalised, against the covariance that they stand for.

namespace nuisance_model_test {

using namespace kr5;
using namespace linear_world;

namespace {

constexpr Eigen::Index fit_rows = 90, check_rows = 40;

std::vector<cell::Experiment> two_motions(std::uint64_t seed) {
  Random random(seed);
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, fit_rows),
                                       motion("motion-2", cell::Split::Check, check_rows)};
  for (cell::Experiment& e : out) add_column(e, "i1", random.normal_vector(e.data.values.rows(), 3.0));
  return out;
}

/// Three parameters with random signatures in both experiments; their fit part as a matrix.
struct RandomNuisance {
  explicit RandomNuisance(std::uint64_t seed) : N(fit_rows, 3), M(check_rows, 3) {
    Random random(seed);
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::VectorXf fit = random.normal_vector(fit_rows, 40.0).cast<float>();
      const Eigen::VectorXf check = random.normal_vector(check_rows, 40.0).cast<float>();
      model.signatures.push_back({{{0, fit}, {1, check}}});
      N.col(i) = fit.cast<double>();
      M.col(i) = check.cast<double>();
    }
    model.gram = N.transpose() * N;
  }
  gap::NuisanceModel model;
  Eigen::MatrixXd N, M;
};

/// Currents that follow the friction of the cell: i1 its dry level, i2 its viscous slope.
class FrictionShown : public Zeros {
 public:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& e) const override {
    io::Table out = Zeros::simulate(cell, e);
    if (e.kind != cell::Kind::Motion) return out;
    out.values.col(out.find("i1")).setConstant(cell.drives->friction.coulomb(0));
    out.values.col(out.find("i2")).setConstant(cell.drives->friction.viscous(1));
    if (cell.drives->friction.coulomb(2) != nominal) throw InvalidArgument("no such friction");
    return out;
  }
  double nominal = 0.0;
};

}  // namespace

TEST_CASE("marginal chi-square and evidence are those of the covariance of small errors") {
  const RandomNuisance r(1);
  const World world(two_motions(2));
  const Eigen::VectorXd fit = world.data.blocks[0].rows_of(world.base),
                        check = world.data.blocks[1].rows_of(world.base);
  for (const double size : {0.001, 0.02, 1.0}) {
    const gap::NuisancePrior prior(r.model, size);
    CHECK(prior.size() == size);
    const Eigen::MatrixXd S = Eigen::MatrixXd::Identity(fit_rows, fit_rows) + size * size * r.N * r.N.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    CHECK(prior.log_det() == Approx(eigen.eigenvalues().array().log().sum()).epsilon(1e-6));
    const Eigen::VectorXd b = gap::project(world.data, r.model, world.base);
    CHECK((b - r.N.transpose() * fit).norm() < 1e-8 * b.norm());  // the check experiments tell nothing
    CHECK(fit.squaredNorm() - prior.inner(b, b)(0, 0) == Approx(fit.dot(S.llt().solve(fit))).epsilon(1e-6));
    const Eigen::VectorXd eta = size * size * r.N.transpose() * S.llt().solve(fit);  // the mean, given the data
    CHECK((prior.estimate(b) - eta).norm() < 1e-6 * eta.norm());
    const Eigen::VectorXd left = gap::without_nuisance(world.data, r.model, prior, world.base);
    CHECK((left.head(fit_rows) - (fit - r.N * eta)).norm() < 1e-4);
    CHECK((left.tail(check_rows) - (check - r.M * eta)).norm() < 1e-4);
    CHECK(gap::nuisance_cost(world.data, r.model, prior, world.base) ==
          Approx(eta.squaredNorm() / (size * size)).epsilon(1e-5));
  }
}

TEST_CASE("without small errors nothing is taken out") {
  const RandomNuisance r(3);
  const World world(two_motions(4));
  for (const gap::NuisancePrior& prior :
       {gap::NuisancePrior(), gap::NuisancePrior(r.model, 0.0), gap::NuisancePrior(gap::NuisanceModel{}, 0.01)}) {
    CHECK(prior.size() == 0.0);
    CHECK(prior.log_det() == 0.0);
    CHECK(gap::without_nuisance(world.data, r.model, prior, world.base) == world.base);
    CHECK(gap::nuisance_cost(world.data, r.model, prior, world.base) == 0.0);
    CHECK(prior.inner(Eigen::MatrixXd::Ones(3, 2), Eigen::MatrixXd::Ones(3, 1)).isZero());
  }
}

TEST_CASE("projections of signatures are their products") {
  const RandomNuisance r(5);
  const Eigen::MatrixXd both = gap::project(r.model, {r.model.signatures[0], r.model.signatures[2]});
  const Eigen::MatrixXd expected = r.N.transpose() * r.N + r.M.transpose() * r.M;
  REQUIRE(both.rows() == 3);
  REQUIRE(both.cols() == 2);
  CHECK((both.col(0) - expected.col(0)).norm() < 1e-4 * expected.norm());
  CHECK((both.col(1) - expected.col(2)).norm() < 1e-4 * expected.norm());
}

TEST_CASE("signatures are relative changes, of friction twice as large, and what cannot be simulated is left out") {
  std::vector<cell::Experiment> all = two_motions(6);
  for (cell::Experiment& e : all) add_column(e, "i2", Eigen::VectorXd::Zero(e.data.values.rows()));
  cell::Experiment poses = experiment("poses-1", cell::Kind::Poses, cell::Split::Fit);
  for (const char* column : {"pose", "t", "q1", "q2", "q3", "q4", "q5", "q6", "x", "y", "z"})
    add_column(poses, column, Eigen::VectorXd::Zero(5));
  all.push_back(poses);
  World world(all);
  FrictionShown simulator;
  const cell::Drives& drives = *world.recording.cell.drives;
  simulator.nominal = drives.friction.coulomb(2);
  world.data.simulator = &simulator;
  const Eigen::VectorXd base = gap::compare_nominal(world.data);
  const gap::NuisanceModel found = gap::make_nuisance_model(world.data, base, 2);
  REQUIRE(found.signatures.size() == 2);  // of dry friction of joint 1 and viscous friction of joint 2 alone
  const double expected[] = {2 * drives.friction.coulomb(0), 2 * drives.friction.viscous(1)};
  for (std::size_t i = 0; i < 2; ++i) {
    REQUIRE(found.signatures[i].parts.size() == 2);  // of the fit and the check motion, not of the poses
    for (const auto& [b, values] : found.signatures[i].parts) {
      CHECK(world.data.blocks[static_cast<std::size_t>(b)].column == (i == 0 ? "i1" : "i2"));
      CHECK((values.array() / static_cast<float>(expected[i]) - 1.0f).abs().maxCoeff() < 1e-4f);
    }
    const auto k = static_cast<Eigen::Index>(i);
    CHECK(found.gram(k, k) == Approx(fit_rows * expected[i] * expected[i]).epsilon(1e-4));
  }
  CHECK(found.gram(0, 1) == 0.0);
}

}  // namespace nuisance_model_test

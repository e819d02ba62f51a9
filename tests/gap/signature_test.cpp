#include "gap/screening/signature.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Sparse changes of the prediction, against dense vectors.

namespace signature_test {

using namespace kr5;
using namespace linear_world;

namespace {

/// Two motions with two currents each: four blocks of lengths that no piece of 64 rows fits.
std::vector<cell::Experiment> two_motions() {
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 150),
                                       motion("motion-2", cell::Split::Check, 97)};
  for (cell::Experiment& e : out)
    for (const char* column : {"i1", "i2"}) add_column(e, column, Eigen::VectorXd::Zero(e.data.values.rows()));
  return out;
}

gap::Signature random_signature(const gap::ComparisonData& data, const std::vector<int>& blocks, Random& random) {
  gap::Signature out;
  for (const int b : blocks) out.parts.emplace_back(b, random.normal_vector(data.blocks[b].rows).cast<float>());
  return out;
}

Eigen::VectorXd dense(const gap::ComparisonData& data, const gap::Signature& s) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(data.size);
  for (const auto& [b, values] : s.parts)
    out.segment(data.blocks[b].first, data.blocks[b].rows) = values.cast<double>();
  return out;
}

}  // namespace

TEST_CASE("a stacked vector is added to a signature in the blocks of some experiments") {
  const World world(two_motions());
  const gap::ComparisonData& data = world.data;
  Random random(2);
  gap::Signature sum = random_signature(data, {1, 2}, random);
  const Eigen::VectorXd stacked = random.normal_vector(data.size), before = dense(data, sum);
  gap::add(data, 0.5, stacked, {0}, sum);  // blocks 0 and 1
  Eigen::VectorXd expected = before;
  for (const int b : data.blocks_of[0]) data.blocks[b].rows_of(expected) += 0.5 * data.blocks[b].rows_of(stacked);
  CHECK((dense(data, sum) - expected).norm() < 1e-5);
  CHECK(std::ranges::is_sorted(sum.parts, {}, [](const auto& part) { return part.first; }));
}

TEST_CASE("sparse products and sums are those of dense vectors") {
  const World world(two_motions());
  const gap::ComparisonData& data = world.data;
  REQUIRE(data.blocks.size() == 4);
  Random random(1);
  const std::vector<gap::Signature> all = {random_signature(data, {0, 1}, random),
                                           random_signature(data, {1, 3}, random),
                                           random_signature(data, {2}, random),
                                           {}};
  const Eigen::MatrixXd gram = gap::gram(all, all);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < all.size(); ++j) {
      const double expected = dense(data, all[i]).dot(dense(data, all[j]));
      CHECK(gap::dot(all[i], all[j]) == Approx(expected).margin(1e-4));
      CHECK(gram(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) == Approx(expected).margin(1e-4));
    }
  CHECK(gap::dot(all[0], all[2]) == 0.0);  // no block in common
  const Eigen::VectorXd r = random.normal_vector(data.size);
  CHECK(gap::dot(data, all[1], r) == Approx(dense(data, all[1]).dot(r)));
  Eigen::VectorXd sum = r;
  gap::add(data, -2.5, all[1], sum);
  CHECK((sum - (r - 2.5 * dense(data, all[1]))).norm() < 1e-9);
}

TEST_CASE("a difference leaves out spikes, what cannot be compared, and blocks that do not change") {
  World world(two_motions());
  gap::ComparisonData& data = world.data;
  Random random(2);
  const Eigen::VectorXd before = random.normal_vector(data.size);
  Eigen::VectorXd after = before;
  const gap::Block &changed = data.blocks[0], &rounded = data.blocks[1], &elsewhere = data.blocks[2];
  changed.rows_of(after).array() -= 2.0;
  rounded.rows_of(after).array() -= 1e-8;
  elsewhere.rows_of(after).array() -= 5.0;
  data.use(changed.first + 3) = 0.0;
  after(changed.first + 7) = std::numeric_limits<double>::quiet_NaN();
  const gap::Signature found = gap::difference(data, {0}, before, after, 10.0);
  REQUIRE(found.parts.size() == 1);
  CHECK(found.parts[0].first == 0);
  for (Eigen::Index i = 0; i < changed.rows; ++i)
    CHECK(found.parts[0].second(i) == Approx(i == 3 || i == 7 ? 0.0 : 20.0).epsilon(1e-5));
  const gap::Signature both = gap::difference(data, {1, 0}, before, after);
  REQUIRE(both.parts.size() == 2);
  CHECK(both.parts[0].first == 0);  // in rising order, whatever that of the experiments
  CHECK(both.parts[1].first == 2);
}

TEST_CASE("an effect is applied to the cell and to the columns, and residuals follow it where asked") {
  const World world(two_motions());
  gap::Hypothesis h = adding("offset", "i1", [](double) { return 1.0; });
  h.apply = [](cell::Cell& c, const Eigen::VectorXd& x) { c.name = std::to_string(x(0)); };
  gap::Setup setup = world.recording.cell;
  gap::apply(setup, h, Eigen::VectorXd::Constant(1, 3.0));
  CHECK(setup.cell.name == std::to_string(3.0));
  REQUIRE(setup.changes.size() == 1);
  const Eigen::VectorXd r = gap::residuals(world.data, setup, {1}, world.base);
  for (const gap::Block& block : world.data.blocks) {
    const double expected = block.experiment == 1 && block.column == "i1" ? -3.0 : 0.0;
    CHECK((block.rows_of(r).array() - expected).abs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("an effect touches all experiments of the kinds whose prediction it changes") {
  std::vector<cell::Experiment> all = two_motions();
  cell::Experiment step = experiment("step-1", cell::Kind::Step, cell::Split::Fit);
  for (const char* column : {"run", "t", "zc", "z"}) add_column(step, column, Eigen::VectorXd::Zero(30));
  all.push_back(step);
  const World world(all);
  const gap::AffectedExperiments affected(world.data);
  const gap::Hypothesis current = adding("offset", "i1", [](double) { return 1.0; });
  CHECK(affected.experiments(current) == std::vector<int>{0, 1});
  gap::Hypothesis of_step = current;
  of_step.change = [](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (e.kind == cell::Kind::Step) table.values.col(table.find("z")).array() += x(0);
  };
  CHECK(affected.experiments(of_step) == std::vector<int>{2});
  gap::Hypothesis nowhere = current;
  nowhere.change = [](io::Table& table, const cell::Experiment&, const Eigen::VectorXd&) { table.values *= 1.0; };
  CHECK(affected.experiments(nowhere).empty());
  CHECK(gap::experiments_of_split(world.data, {0, 1, 2}, cell::Split::Fit) == std::vector<int>{0, 2});
  CHECK(gap::experiments_of_split(world.data, {0, 1, 2}, cell::Split::Check) == std::vector<int>{1});
}

}  // namespace signature_test

#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/hypotheses.hpp>

#include "gap/comparison_data.hpp"
#include "gap/fitting/fit.hpp"

/// @file
/// Recordings of which every answer of the diagnosis can be computed by hand: the simulator shows nothing, so that a
/// residual is what was recorded over its noise, and effects add a shape in proportion to their coordinate.

namespace linear_world {

using namespace kr5;

inline constexpr double step = 0.012;  ///< Of the rows of a motion [s].

/// Shows zeros in all columns, an orientation that is turned by nothing, and a sphere nowhere.
class Zeros : public cell::Simulator {
 public:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
    io::Table out;
    for (const cell::Column& c : cell::columns(experiment.kind, cell.robot.joints()))
      if (c.role == cell::Role::Predicted) out.columns.push_back(c.name);
    out.values = Eigen::MatrixXd::Zero(experiment.data.values.rows(), static_cast<Eigen::Index>(out.columns.size()));
    if (out.find("qw") >= 0) out.values.col(out.find("qw")).setOnes();
    return out;
  }
};

/// The shipped cell with a noise of 1 in every column.
inline cell::Cell unit_noise() {
  cell::Cell c = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  c.effects = {};
  c.noise = {1, 1, 1, 1, 1, 1, 1, 1, 1, {}, {}};
  return c;
}

inline void add_column(cell::Experiment& e, const std::string& name, const Eigen::VectorXd& values) {
  e.data.columns.push_back(name);
  e.data.values.conservativeResize(values.size(), e.data.values.cols() + 1);
  e.data.values.rightCols(1) = values;
}

inline cell::Experiment experiment(const std::string& name, cell::Kind kind, cell::Split split) {
  cell::Experiment e;
  e.name = name, e.kind = kind, e.file = name + ".csv", e.split = split;
  return e;
}

/// A motion in which joint 1 swings by 1 rad at 0.5 Hz, with nothing recorded yet; it begins at `start` [s].
inline cell::Experiment motion(const std::string& name, cell::Split split, int rows, double start = 0.0) {
  cell::Experiment e = experiment(name, cell::Kind::Motion, split);
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(rows, start, start + step * (rows - 1));
  add_column(e, "t", t);
  add_column(e, "qc1", (M_PI * t.array()).sin());
  for (int j = 2; j <= 6; ++j) add_column(e, "qc" + std::to_string(j), Eigen::VectorXd::Constant(rows, 0.1 * j));
  return e;
}

/// Poses at random joint angles, with noise of a size in x y z, of which x moves with q1.
inline cell::Experiment moved_poses(Random random, Eigen::Index count, double noise, double with_q1) {
  cell::Experiment e = experiment("poses-1", cell::Kind::Poses, cell::Split::Fit);
  add_column(e, "pose", Eigen::VectorXd::LinSpaced(count, 0, count - 1));
  add_column(e, "t", Eigen::VectorXd::LinSpaced(count, 0, 30 * (count - 1)));
  for (int j = 1; j <= 6; ++j) add_column(e, "q" + std::to_string(j), random.normal_vector(count));
  for (const char* column : {"x", "y", "z"}) add_column(e, column, random.normal_vector(count, noise));
  e.data.values.col(e.data.find("x")) += with_q1 * e.data.column("q1");
  return e;
}

/// A recording beside the simulator that shows nothing.
struct World {
  explicit World(std::vector<cell::Experiment> experiments, const cell::Cell& cell = unit_noise()) {
    recording.cell = cell;
    recording.experiments = std::move(experiments);
    data = gap::compare_columns(recording, simulator);
    base = gap::compare_nominal(data);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  cell::Recording recording;
  Zeros simulator;
  gap::ComparisonData data;
  Eigen::VectorXd base;
};

using Shape = std::function<double(double t)>;

/// A shape at the times of an experiment.
inline Eigen::VectorXd at_times(const cell::Experiment& e, const Shape& shape) {
  return e.data.column("t").unaryExpr(shape);
}

/// An effect that adds x times a shape to a column of motions.
inline gap::Hypothesis adding(const std::string& effect, const std::string& column, const Shape& shape,
                              double lower = -1e9, double upper = 1e9) {
  gap::OwnEffect own{{effect, column}, {{"size", "A", 1.0, lower, upper, {}}}, {}, {}};
  own.change = [column, shape](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (const int at = table.find(column); e.kind == cell::Kind::Motion && at >= 0)
      table.values.col(at) += x(0) * at_times(e, shape);
  };
  return gap::own_hypothesis(own);
}

/// A candidate without signatures that acts in some experiments.
inline gap::Candidate acting_in(gap::Hypothesis hypothesis, std::vector<int> experiments) {
  return {std::move(hypothesis), std::move(experiments), {}};
}

inline gap::Part part(const gap::Candidate& candidate, double x) {
  return {&candidate, Eigen::VectorXd::Constant(1, x)};
}

}  // namespace linear_world

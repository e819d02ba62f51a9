// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/QR>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "gap/report.hpp"

namespace kr5::gap {
namespace {

/// An experiment that could be done, and how to do it.
struct Proposal {
  cell::Experiment experiment;
  std::string words;
};

/// A column times a factor.
std::optional<Proposal> scaled(const cell::Experiment& e, const std::string& column, double factor,
                               const std::string& words) {
  Proposal out{e, words + " (as " + e.name + ")"};
  const int at = e.data.find(column);
  if (at < 0) return std::nullopt;
  out.experiment.data.values.col(at) *= factor;
  return out;
}

/// The same path `factor` times as fast, sampled at the same cycle.
Proposal faster(const cell::Experiment& e, double factor, const std::string& words) {
  Proposal out{e, words + " (as " + e.name + ")"};
  const Eigen::MatrixXd& from = e.data.values;
  const auto rows = static_cast<Eigen::Index>(static_cast<double>(from.rows() - 1) / factor) + 1;
  Eigen::MatrixXd& to = out.experiment.data.values;
  to.resize(rows, from.cols());
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double at = static_cast<double>(i) * factor;
    const auto k = std::min(static_cast<Eigen::Index>(at), from.rows() - 2);
    const double part = at - static_cast<double>(k);
    to.row(i) = (1 - part) * from.row(k) + part * from.row(k + 1);
  }
  if (const int t = e.data.find("t"); t >= 0)
    to.col(t) = Eigen::VectorXd::LinSpaced(rows, from(0, t),
                                           from(0, t) + static_cast<double>(rows - 1) * (from(1, t) - from(0, t)));
  return out;
}

/// The postures of still kinds, spread over a wider range of every joint about their middle.
Proposal spread(const cell::Cell& cell, const cell::Experiment& e, const std::string& words) {
  Proposal out{e, words + " (as " + e.name + ")"};
  Random random(1);
  const auto& limits = cell.robot.limits;
  for (int j = 0; j < cell.robot.joints(); ++j) {
    const int at = e.data.find("q" + std::to_string(j + 1));
    if (at < 0) continue;
    auto q = out.experiment.data.values.col(at);
    const double middle = q.mean(), width = std::max(q.maxCoeff() - q.minCoeff(), 0.2);
    for (double& value : q) {
      value = middle + width * random.uniform(-1.0, 1.0);
      if (limits) value = std::clamp(value, limits->lower(j), limits->upper(j));
    }
  }
  return out;
}

std::vector<Proposal> proposals(const cell::Recording& recording) {
  std::vector<Proposal> out;
  const auto add = [&](std::optional<Proposal> p) {
    if (p) out.push_back(std::move(*p));
  };
  std::vector<cell::Kind> seen;
  for (const cell::Experiment& e : recording.experiments) {
    if (e.data.values.rows() < 2 || std::find(seen.begin(), seen.end(), e.kind) != seen.end()) continue;
    seen.push_back(e.kind);
    switch (e.kind) {
      case cell::Kind::Motion:
        add(faster(e, 2.0, "run the motion at twice the speed"));
        add(faster(e, 0.2, "run the motion at a fifth of the speed"));
        break;
      case cell::Kind::Poses:
        add(spread(recording.cell, e, "measure poses over twice the range of every joint"));
        break;
      case cell::Kind::Views:
        break;  // elsewhere the board might be out of sight
      case cell::Kind::Scan:
        add(scaled(e, "speed", 5.0, "scan at five times the speed"));
        break;
      case cell::Kind::Step:
        add(scaled(e, "zc", 3.0, "make steps three times as high"));
        break;
      case cell::Kind::Press:
        add(scaled(e, "zc", 2.0, "press twice as deep"));
        break;
      case cell::Kind::Profile:
        add(scaled(e, "fc", 3.0, "roll the peg under three times the force"));
        add(scaled(e, "tilt", 1.5, "roll the peg at one and a half times the tilt"));
        break;
    }
  }
  return out;
}

/// Sum of squares, in noise, by which the predictions of two models would differ in an experiment when the second is
/// fitted to the first.
double separation(const Data& data, const Proposal& proposal, const Model& truth, const Model& rival) {
  const cell::Simulator& simulator = *data.simulator;
  const io::Table shown = predict(simulator, setup_of(data, truth.parts), proposal.experiment);
  cell::Recording one;
  one.cell = data.recording->cell;
  one.experiments = {proposal.experiment};
  io::Table& table = one.experiments.front().data;
  for (std::size_t c = 0; c < shown.columns.size(); ++c)
    if (const int at = table.find(shown.columns[c]); at >= 0) table.values.col(at) = shown.values.col(c);
  const Data there = make_data(one, simulator);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(there.size);
  const Eigen::VectorXd r = counted(there, residuals(there, setup_of(data, rival.parts), {0}, zero));
  Eigen::MatrixXd J(there.size, rival.coordinates());
  Eigen::Index column = 0;
  for (std::size_t k = 0; k < rival.parts.size(); ++k)
    for (Eigen::Index i = 0; i < rival.parts[k].x.size(); ++i) {
      std::vector<Part> moved = rival.parts;
      const double step = moved[k].candidate->hypothesis.coordinates[static_cast<std::size_t>(i)].step;
      moved[k].x(i) += step;
      J.col(column++) = (r - counted(there, residuals(there, setup_of(data, moved), {0}, zero))) / step;
    }
  const Eigen::VectorXd left = r - J * J.completeOrthogonalDecomposition().solve(r);
  return left.squaredNorm();
}

const Model* model_with(const std::vector<Model>& models, const EffectName& name) {
  for (const Model& m : models)
    for (const Part& part : m.parts)
      if (name_of(part) == name) return &m;
  return nullptr;
}

}  // namespace

NextExperiment next_experiment(const Data& data, const Model& best, const std::vector<Model>& models,
                               const std::vector<Cause>& causes) {
  constexpr double five_sigma = 25.0;
  NextExperiment out;
  double most = five_sigma;
  const std::vector<Proposal> all = proposals(*data.recording);
  for (const Cause& cause : causes)
    for (const EffectName& tied : cause.tied_with) {
      const Model* rival = model_with(models, tied);
      for (const std::string& name : {cause.effect + " " + cause.target, tied.effect + " " + tied.target})
        if (std::find(out.separates.begin(), out.separates.end(), name) == out.separates.end())
          out.separates.push_back(name);
      for (const Proposal& proposal : all) try {
          const double value = rival ? separation(data, proposal, best, *rival) : 0.0;
          if (value <= most) continue;
          most = value;
          out.what = proposal.words;
        } catch (const InvalidArgument&) {
          continue;  // the simulator cannot show such an experiment
        }
    }
  if (!out.separates.empty() && out.what.empty())
    out.what =
        "no faster, slower, wider, deeper or harder repetition separates them: measure one of the tied parts by itself";
  return out;
}

}  // namespace kr5::gap

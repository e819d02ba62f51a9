// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/experiment_scorer.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>

namespace kr5::gap {
namespace {

using Separations = decltype(Score::separation);

double rms(const Eigen::VectorXd& v) {
  return v.size() > 0 ? std::sqrt(v.squaredNorm() / static_cast<double>(v.size())) : 0.0;
}

/// Columns that would be recorded: those recorded of this kind before; all, when there was none.
std::vector<std::string> columns_of(const cell::Recording& recording, const cell::Experiment& e) {
  std::vector<std::string> out;
  const cell::Experiment* before = recorded_experiment(recording, e.kind);
  for (const cell::Column& c : cell::columns(e.kind, recording.cell.robot.joints()))
    if (c.role == cell::Role::Predicted && (!before || before->data.find(c.name) >= 0)) out.push_back(c.name);
  return out;
}

/// Takes out the rows of a view that the image does not hold. Whether enough are left.
bool keep_visible(const cell::Cell& cell, Proposal& proposal, const io::Table& shown) {
  const int u = shown.find("u"), v = shown.find("v");
  if (proposal.experiment.kind != cell::Kind::Views || u < 0 || v < 0 || !cell.camera) return true;
  constexpr double edge = 5.0;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < shown.values.rows(); ++i)
    if (shown.values(i, u) > edge && shown.values(i, u) < cell.camera->width - 1 - edge && shown.values(i, v) > edge &&
        shown.values(i, v) < cell.camera->height - 1 - edge)
      kept.push_back(i);
  const Eigen::Index rows = shown.values.rows();
  proposal.experiment.data.values = Eigen::MatrixXd(proposal.experiment.data.values(kept, Eigen::all));
  return 4 * static_cast<Eigen::Index>(kept.size()) > rows;
}

/// Whether a motion stays within what the drives can do.
bool strong_enough(const cell::Cell& cell, const io::Table& shown, const Eigen::VectorXd& most) {
  if (!cell.drives || shown.find("i1") < 0) return true;
  const int n = cell.robot.joints();
  const Eigen::MatrixXd i = shown.values.middleCols(shown.find("i1"), n);
  const auto& limits = cell.robot.limits;
  if (limits && limits->effort.size() == n) {
    const Eigen::MatrixXd torque = i * cell.drives->torque_constant.asDiagonal() * cell.drives->structure;
    return (torque.cwiseAbs().colwise().maxCoeff().transpose().array() <= limits->effort.array()).all();
  }
  return most.size() != n || (i.cwiseAbs().colwise().maxCoeff().transpose().array() <= 2 * most.array()).all();
}

/// A proposal, simulated with every alternative. For each alternative a recording that holds what it would show.
class SimulatedProposal {
 public:
  SimulatedProposal(const ExperimentScorer& scorer, const Proposal& proposal, const ToolSimulator& simulator,
                    const io::Table& nominal)
      : scorer_(scorer), experiment_(proposal.experiment), simulator_(simulator) {
    const std::vector<std::string> columns = columns_of(*scorer.data.recording, experiment_);
    cell::Recording one;
    one.cell = scorer.data.recording->cell;
    shown_.assign(scorer.fitted.size(), one);
    for (std::size_t m = 0; m < scorer.fitted.size(); ++m) {
      shown_[m].experiments = {experiment_};
      show(shown_[m].experiments.front(), predicted(scorer.fitted[m].parts()), columns);
    }
    for (const cell::Recording& r : shown_) data_.push_back(compare_columns(r, simulator_));
    for (std::size_t m = 0; m < data_.size(); ++m) changes_.push_back(-against(m, nominal));
  }

  bool compares() const { return !data_.front().blocks.empty(); }
  bool strong(const Eigen::VectorXd& most) const {
    const auto& first = shown_.front();
    return experiment_.kind != cell::Kind::Motion || strong_enough(first.cell, first.experiments.front().data, most);
  }

  Separations separation(bool with_nuisance) const {
    const std::size_t n = data_.size();
    std::vector<Eigen::MatrixXd> J;
    for (std::size_t m = 0; m < n; ++m) J.push_back(jacobian(m));
    const Eigen::MatrixXd N = with_nuisance ? nuisance_directions() : Eigen::MatrixXd(data_.front().size, 0);
    Separations least;
    least.fill(1e300);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        if (i == j) continue;
        const Separations one = distance(i, j, J[j], N);
        for (std::size_t k = 0; k < one.size(); ++k) least[k] = std::min(least[k], one[k]);
      }
    return least;
  }

  std::vector<ForecastColumn> forecast() const {
    std::vector<ForecastColumn> out;
    for (const Block& block : data_.front().blocks) {
      ForecastColumn c{block.column, {}, 0.0};
      for (const Eigen::VectorXd& change : changes_) c.change.push_back(rms(block.rows_of(change)));
      for (std::size_t i = 0; i < changes_.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          c.difference = std::max(c.difference, rms(block.rows_of(changes_[i]) - block.rows_of(changes_[j])));
      out.push_back(std::move(c));
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const ForecastColumn& a, const ForecastColumn& b) { return a.difference > b.difference; });
    return out;
  }

 private:
  io::Table predicted(const std::vector<Part>& parts) const {
    return predict(simulator_, setup_of(scorer_.data, parts), experiment_);
  }

  /// What alternative `m` shows less a prediction, in noise.
  Eigen::VectorXd against(std::size_t m, const io::Table& table) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(data_[m].size);
    write_residuals(data_[m], 0, compare(data_[m], 0, table), out);
    return -counted_residual(data_[m], out);
  }

  Eigen::MatrixXd jacobian(std::size_t m) const {
    const Fitted& f = scorer_.fitted[m];
    std::vector<Part> parts = f.parts();
    std::vector<Eigen::VectorXd> columns;
    for (std::size_t k = 0; k < parts.size(); ++k)
      for (Eigen::Index i = 0; i < parts[k].x.size(); ++i) {
        const Coordinate& c = f.candidates[k].hypothesis.coordinates[static_cast<std::size_t>(i)];
        const double step = parts[k].x(i) + c.step <= c.upper ? c.step : -c.step;
        parts[k].x(i) += step;
        columns.push_back(against(m, predicted(parts)) / step);
        parts[k].x(i) -= step;
      }
    Eigen::MatrixXd J(data_[m].size, static_cast<Eigen::Index>(columns.size()));
    for (Eigen::Index i = 0; i < J.cols(); ++i) J.col(i) = columns[static_cast<std::size_t>(i)];
    return J;
  }

  Eigen::MatrixXd nuisance_directions() const {
    const ComparisonData& data = data_.front();
    const NuisanceModel all = make_nuisance_model(data, Eigen::VectorXd::Zero(data.size), 1);
    Eigen::MatrixXd N(data.size, static_cast<Eigen::Index>(all.signatures.size()));
    for (Eigen::Index i = 0; i < N.cols(); ++i) {
      Eigen::VectorXd column = Eigen::VectorXd::Zero(data.size);
      add(data, 1.0, all.signatures[static_cast<std::size_t>(i)], column);
      N.col(i) = column;
    }
    return N;
  }

  /// Root of the least sum of squares that alternative `j` leaves of what `i` shows: its parameters move as far as the
  /// context leaves them open, nominal parameters are uncertain, and each column of what `i` changes may be off by a
  /// factor.
  Separations distance(std::size_t i, std::size_t j, const Eigen::MatrixXd& J, const Eigen::MatrixXd& N) const {
    const Eigen::VectorXd r = against(i, table(j));
    const Eigen::Index n = J.cols(), m = N.cols();
    Eigen::MatrixXd M(r.size(), n + m + 1);
    M << J, N, r;
    const double accuracy = std::max(scorer_.accuracy + inaccuracy(i), 1e-9);
    std::vector<Eigen::MatrixXd> squares, along;
    for (const Block& block : data_[i].blocks) {
      const auto own = M.middleRows(block.first, block.rows);
      squares.push_back(own.transpose() * own);
      along.push_back(own.transpose() * block.rows_of(changes_[i]));
    }
    Separations out = {};
    for (std::size_t k = 0; k < repeats.size(); ++k) {
      const double times = repeats[k];
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + m + 1, n + m + 1);
      for (std::size_t b = 0; b < squares.size(); ++b) {
        const double gain = data_[i].blocks[b].rows_of(changes_[i]).squaredNorm();
        A += times * squares[b] -
             times * times / (times * gain + 1 / (accuracy * accuracy)) * along[b] * along[b].transpose();
      }
      Eigen::MatrixXd normal = A.topLeftCorner(n + m, n + m);
      normal.topLeftCorner(n, n) += scorer_.fitted[j].information;
      normal.diagonal().head(n).array() += 1 / (prior_width * prior_width);
      normal.diagonal().tail(m).array() += 1 / (scorer_.nuisance_std * scorer_.nuisance_std);
      const Eigen::VectorXd b = A.col(n + m).head(n + m);
      out[k] = std::sqrt(std::max(A(n + m, n + m) - b.dot(normal.ldlt().solve(b)), 0.0));
    }
    return out;
  }

  double inaccuracy(std::size_t m) const {
    double out = 0.0;
    for (const Candidate& c : scorer_.fitted[m].candidates) out = std::max(out, c.hypothesis.inaccuracy);
    return out;
  }

  const io::Table& table(std::size_t m) const { return shown_[m].experiments.front().data; }

  const ExperimentScorer& scorer_;
  const cell::Experiment& experiment_;
  const ToolSimulator& simulator_;
  std::vector<cell::Recording> shown_;
  std::vector<ComparisonData> data_;
  std::vector<Eigen::VectorXd> changes_;  ///< Prediction less the nominal one.
};

ToolSimulator::Tools tools_of(const cell::Cell& cell, const Proposal& proposal) {
  if (proposal.load <= 0) return {};
  return {{proposal.experiment.name, *with_load(cell, proposal.load).tool}};
}

}  // namespace

Eigen::VectorXd highest_current(const cell::Recording& recording) {
  Eigen::VectorXd out;
  for (const cell::Experiment& e : recording.experiments) {
    const int first = e.kind == cell::Kind::Motion ? e.data.find("i1") : -1;
    if (first < 0) continue;
    const Eigen::VectorXd most =
        e.data.values.middleCols(first, recording.cell.robot.joints()).cwiseAbs().colwise().maxCoeff();
    out = out.size() > 0 ? Eigen::VectorXd(out.cwiseMax(most)) : most;
  }
  return out;
}

std::optional<Score> ExperimentScorer::score(Proposal& proposal, bool with_nuisance) const try {
  const cell::Cell& cell = data.recording->cell;
  const ToolSimulator simulator(*data.simulator, tools_of(cell, proposal));
  io::Table nominal = simulator.predict_unchecked(cell, proposal.experiment);
  const Eigen::Index rows = nominal.values.rows();
  if (!keep_visible(cell, proposal, nominal)) return std::nullopt;
  if (proposal.experiment.data.values.rows() != rows) nominal = simulator.predict_unchecked(cell, proposal.experiment);
  const SimulatedProposal simulated(*this, proposal, simulator, nominal);
  if (!simulated.compares() || !simulated.strong(highest_current)) return std::nullopt;
  return Score{simulated.separation(with_nuisance && nuisance_std > 0), simulated.forecast()};
} catch (const InvalidArgument&) {
  return std::nullopt;  // the cell lacks a part that such an experiment needs
}

double ExperimentScorer::confirmed(const FitContext& context, const Proposal& proposal) const {
  constexpr int iterations = 6;
  double least = 1e300;
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    cell::Recording all = synthesize_recording(context, fitted[i]);
    const ToolSimulator simulator(context.simulator.inner(), tools_of(all.cell, proposal));
    all.experiments.push_back(proposal.experiment);
    const Setup setup = setup_of(context.data, fitted[i].parts());
    show(all.experiments.back(), predict(simulator, setup, proposal.experiment),
         columns_of(context.recording, proposal.experiment));
    ToolSimulator::Tools tools = context.simulator.tools();
    tools.merge(tools_of(all.cell, proposal));
    const FitContext both(std::move(all), context.simulator.inner(), std::move(tools));
    for (std::size_t j = 0; j < fitted.size(); ++j)
      if (i != j) least = std::min(least, refit(both, fitted[j], iterations).chi2);
  }
  return std::sqrt(std::max(least, 0.0));
}

}  // namespace kr5::gap

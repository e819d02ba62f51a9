// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/signature.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::gap {
namespace {

constexpr float nothing = 1e-6f;  // of noise: what a simulator's own rounding may be

/// Sum of products: of short pieces in the precision of the values, which is twice as fast, their sum in double.
double inner(const Eigen::VectorXf& a, const Eigen::VectorXf& b) {
  constexpr Eigen::Index piece = 64;
  double sum = 0.0;
  Eigen::Index i = 0;
  for (; i + piece <= a.size(); i += piece) sum += a.segment<piece>(i).dot(b.segment<piece>(i));
  return sum + a.tail(a.size() - i).dot(b.tail(a.size() - i));
}

/// Whether any column moved by more than a hundred thousandth of what it holds.
bool differ(const io::Table& a, const io::Table& b) {
  for (Eigen::Index c = 0; c < a.values.cols(); ++c) {
    const double moved = (a.values.col(c) - b.values.col(c)).cwiseAbs().maxCoeff();
    if (!(moved <= 1e-9 * (1.0 + a.values.col(c).cwiseAbs().maxCoeff()))) return true;
  }
  return false;
}

/// Rows that tell whether an effect acts at all: of still kinds some, of runs all.
std::vector<Eigen::Index> telling_rows(const cell::Experiment& e) {
  const Eigen::Index rows = e.data.values.rows();
  std::vector<Eigen::Index> out;
  const bool still = e.kind == cell::Kind::Poses || e.kind == cell::Kind::Views || e.kind == cell::Kind::Scan;
  const Eigen::Index stride = still ? std::max<Eigen::Index>(1, rows / 200) : 1;
  for (Eigen::Index row = 0; row < rows; row += stride) out.push_back(row);
  return out;
}

/// Where a joint is commanded to move fastest.
struct Moment {
  int experiment = -1;
  Eigen::Index row = 0;
  double step = -1.0;
};

Moment fastest_moment(const ComparisonData& data, int joint) {
  Moment out;
  for (std::size_t e = 0; e < data.recording->experiments.size(); ++e) {
    const io::Table& table = data.recording->experiments[e].data;
    const int at = table.find("qc" + std::to_string(joint + 1));
    if (data.blocks_of[e].empty() || at < 0) continue;
    for (Eigen::Index row = 1; row < table.values.rows(); ++row)
      if (const double step = std::abs(table.values(row, at) - table.values(row - 1, at)); step > out.step)
        out = {static_cast<int>(e), row, step};
  }
  return out;
}

/// Short pieces of motions in which each joint moves as fast as it ever does.
std::vector<std::pair<int, std::vector<Eigen::Index>>> telling_pieces(const ComparisonData& data) {
  constexpr Eigen::Index length = 80;
  std::vector<std::pair<int, std::vector<Eigen::Index>>> out;
  for (int joint = 0; joint < data.recording->cell.robot.joints(); ++joint) {
    const Moment moment = fastest_moment(data, joint);
    const auto covered = [&](const auto& piece) {
      return piece.first == moment.experiment && moment.row > piece.second.front() + length / 4 &&
             moment.row < piece.second.back() - length / 4;
    };
    if (moment.experiment < 0 || std::any_of(out.begin(), out.end(), covered)) continue;
    const Eigen::Index rows = data.recording->experiments[moment.experiment].data.values.rows();
    const Eigen::Index first =
        std::clamp<Eigen::Index>(moment.row - length / 2, 0, std::max<Eigen::Index>(rows - length, 0));
    out.push_back({moment.experiment, {}});
    for (Eigen::Index row = first; row < std::min(rows, first + length); ++row) out.back().second.push_back(row);
  }
  return out;
}

}  // namespace

double dot(const Signature& a, const Signature& b) {
  double sum = 0.0;
  for (auto i = a.parts.begin(), j = b.parts.begin(); i != a.parts.end() && j != b.parts.end();) {
    if (i->first == j->first) {
      sum += inner(i->second, j->second);
      ++i, ++j;
    } else if (i->first < j->first) {
      ++i;
    } else {
      ++j;
    }
  }
  return sum;
}

double dot(const ComparisonData& data, const Signature& a, const Eigen::VectorXd& stacked) {
  double sum = 0.0;
  for (const auto& [block, values] : a.parts) sum += values.cast<double>().dot(data.blocks[block].rows_of(stacked));
  return sum;
}

void add(const ComparisonData& data, double factor, const Signature& a, Eigen::VectorXd& stacked) {
  for (const auto& [block, values] : a.parts) data.blocks[block].rows_of(stacked) += factor * values.cast<double>();
}

void add(const ComparisonData& data, double factor, const Eigen::VectorXd& stacked, const std::vector<int>& experiments,
         Signature& out) {
  for (const int e : experiments)
    for (const int b : data.blocks_of[e]) {
      const auto at = std::ranges::lower_bound(out.parts, b, {}, [](const auto& part) { return part.first; });
      const Eigen::VectorXf more = (factor * data.blocks[b].rows_of(stacked)).cast<float>();
      if (at != out.parts.end() && at->first == b)
        at->second += more;
      else
        out.parts.insert(at, {b, more});
    }
}

Eigen::MatrixXd gram(const std::vector<Signature>& a, const std::vector<Signature>& b) {
  Eigen::MatrixXd out(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) out(i, j) = &a == &b && j < i ? out(j, i) : dot(a[i], b[j]);
  return out;
}

Signature difference(const ComparisonData& data, const std::vector<int>& experiments, const Eigen::VectorXd& before,
                     const Eigen::VectorXd& after, double factor) {
  Signature out;
  std::vector<int> sorted = experiments;
  std::sort(sorted.begin(), sorted.end());
  for (const int e : sorted)
    for (const int b : data.blocks_of[e]) {
      const Block& block = data.blocks[b];
      const Eigen::ArrayXd change = (block.rows_of(before) - block.rows_of(after)).array() * factor;
      Eigen::VectorXf values =
          (change.isNaN().select(0.0, change) * data.use.segment(block.first, block.rows)).matrix().cast<float>();
      if (values.size() > 0 && values.cwiseAbs().maxCoeff() > nothing) out.parts.emplace_back(b, std::move(values));
    }
  return out;
}

void apply(Setup& setup, const Hypothesis& hypothesis, const Eigen::VectorXd& x) {
  if (hypothesis.apply) hypothesis.apply(setup.cell, x);
  if (hypothesis.change)
    setup.changes.emplace_back([change = hypothesis.change, x](io::Table& table, const cell::Experiment& experiment) {
      change(table, experiment, x);
    });
}

Eigen::VectorXd residuals(const ComparisonData& data, const Setup& setup, const std::vector<int>& experiments,
                          const Eigen::VectorXd& base) {
  Eigen::VectorXd out = base;
  for (const int e : experiments) write_residuals(data, e, compare(data, e, setup), out);
  return out;
}

AffectedExperiments::AffectedExperiments(const ComparisonData& data) : data_(data) {
  for (const auto& [experiment, rows] : telling_pieces(data)) add(experiment, rows);
  for (std::size_t e = 0; e < data.recording->experiments.size(); ++e) {
    const cell::Experiment& whole = data.recording->experiments[e];
    if (!data.blocks_of[e].empty() && whole.kind != cell::Kind::Motion) add(static_cast<int>(e), telling_rows(whole));
  }
}

void AffectedExperiments::add(int experiment, const std::vector<Eigen::Index>& rows) {
  const cell::Experiment& whole = data_.recording->experiments[experiment];
  if (rows.empty()) return;
  Piece piece{{whole.name, whole.kind, whole.file, whole.split, {whole.data.columns, {}}, whole.joint_reference, {}},
              {}};
  piece.experiment.data.values = whole.data.values(rows, Eigen::all);
  piece.nominal = data_.simulator->predict(data_.recording->cell, piece.experiment);
  pieces_.push_back(std::move(piece));
}

std::vector<int> AffectedExperiments::experiments(const Hypothesis& hypothesis) const {
  std::vector<cell::Kind> kinds;
  for (const Piece& piece : pieces_) {
    if (std::find(kinds.begin(), kinds.end(), piece.experiment.kind) != kinds.end()) continue;
    Setup setup = data_.recording->cell;
    apply(setup, hypothesis, hypothesis.probes.back().points.back());
    try {
      if (differ(piece.nominal, predict(*data_.simulator, setup, piece.experiment)))
        kinds.push_back(piece.experiment.kind);
    } catch (const InvalidArgument&) {
      continue;  // a part of the cell that this kind would need is not there
    }
  }
  std::vector<int> out;
  for (std::size_t e = 0; e < data_.recording->experiments.size(); ++e)
    if (!data_.blocks_of[e].empty() &&
        std::find(kinds.begin(), kinds.end(), data_.recording->experiments[e].kind) != kinds.end())
      out.push_back(static_cast<int>(e));
  return out;
}

std::vector<int> experiments_of_split(const ComparisonData& data, const std::vector<int>& experiments,
                                      cell::Split split) {
  std::vector<int> out;
  for (const int e : experiments)
    if (data.recording->experiments[e].split == split) out.push_back(e);
  return out;
}

}  // namespace kr5::gap

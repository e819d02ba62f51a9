// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/measure.hpp>

#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/gap/notes.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "gap/comparison_data.hpp"
#include "gap/reporting/gap_breakdown.hpp"

namespace kr5::gap {
namespace {

std::string in_one(const std::vector<std::string>& reasons) {
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

std::vector<std::string> texts_of(const std::vector<LeftOut>& left_out) {
  std::vector<std::string> out;
  for (const LeftOut& part : left_out) out.push_back(left_out_text(part));
  return out;
}

}  // namespace

double noise_limit(double rows, int columns) {
  require(columns > 0, "columns must be positive");
  constexpr double chance = 0.001;
  if (!(rows > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(uncertainty::chi_square_quantile(1 - chance / columns, rows) / rows);
}

Measure measure(const cell::Recording& recording, const cell::Cell& cell, const cell::Simulator& simulator) {
  require_joints(recording, cell);
  cell.validate();
  ComparisonData data = compare_columns(recording, simulator);
  mark_unknown_directions(data);
  GapBreakdown parts(recording);
  Measure out;
  std::vector<LeftOut> refused;
  double sum = 0.0;
  for (std::size_t e = 0; e < recording.experiments.size(); ++e) {
    if (data.blocks_of[e].empty()) continue;
    const auto predicted = try_predict(data, cell, static_cast<int>(e), refused);
    if (!predicted) continue;
    const auto residuals = compare(data, static_cast<int>(e), *predicted);
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const Block& block = data.blocks[static_cast<std::size_t>(data.blocks_of[e][k])];
      if (!has_column_of(*predicted, block)) continue;
      const Eigen::VectorXd residual = used_rows(data, block, residuals[k]);
      if (!residual.array().isFinite().any()) {
        refused.push_back({block.kind, recording.experiments[e].name, {block.column}, LeftOutReason::NotFinite, ""});
        continue;
      }
      out.columns.push_back(parts.add(block.experiment, block.column, block.sigma, residual));
      out.exceeding += out.columns.back().exceeds ? 1 : 0;
      sum += out.columns.back().gap * out.columns.back().gap;
    }
  }
  refused.insert(refused.end(), data.left_out.begin(), data.left_out.end());
  out.refused = texts_of(refused);
  if (out.columns.empty() && !out.refused.empty()) throw InvalidArgument(in_one(out.refused));
  out.parts = parts.all();
  if (!out.columns.empty()) out.gap = std::sqrt(sum / static_cast<double>(out.columns.size()));
  return out;
}

Measure measure(const cell::Recording& recording, const cell::Simulator& simulator) {
  return measure(recording, recording.cell, simulator);
}

}  // namespace kr5::gap

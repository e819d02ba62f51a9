// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/measure.hpp>

#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "gap/data.hpp"
#include "gap/parts.hpp"

namespace kr5::gap {
namespace {

constexpr double certain = 0.999;

std::string unit_of(const Block& block, int joints) {
  for (const cell::Column& column : cell::columns(block.kind, joints))
    if (column.name == block.column) return column.unit;
  return "rad";  // rx ry rz, which are in no file
}

ColumnGap column_gap(const Data& data, const Block& block, const Eigen::VectorXd& residual) {
  ColumnGap out;
  const cell::Experiment& experiment = data.experiment(block);
  out.experiment = experiment.name;
  out.kind = block.kind;
  out.column = block.column;
  out.target = target_of(block.kind, block.column);
  out.unit = unit_of(block, data.recording->cell.robot.joints());
  out.split = experiment.split;
  out.noise = block.sigma;
  double sum = 0.0;
  for (const double r : residual)
    if (!std::isnan(r)) sum += r * r, ++out.rows;
  out.left_out = static_cast<int>(residual.size()) - out.rows;
  if (out.rows == 0) return out;
  out.gap = std::sqrt(sum / out.rows);
  out.rms = out.gap * out.noise;
  out.limit = std::sqrt(uncertainty::chi_square_quantile(certain, out.rows) / out.rows);
  out.exceeds = out.gap > out.limit;
  return out;
}

std::string in_one(const std::vector<std::string>& reasons) {
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

}  // namespace

Measure measure(const cell::Recording& recording, const cell::Cell& cell, const cell::Simulator& simulator) {
  require(cell.robot.joints() == recording.cell.robot.joints(), "the cell has " + std::to_string(cell.robot.joints()) +
                                                                    " joints, the one that was recorded " +
                                                                    std::to_string(recording.cell.robot.joints()));
  const Data data = make_data(recording, simulator);
  Measure out;
  double sum = 0.0;
  for (std::size_t e = 0; e < recording.experiments.size(); ++e) {
    if (data.blocks_of[e].empty()) continue;
    const auto predicted = shown(data, cell, static_cast<int>(e), out.refused);
    if (!predicted) continue;
    const auto residuals = compare(data, static_cast<int>(e), *predicted);
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const Block& block = data.blocks[static_cast<std::size_t>(data.blocks_of[e][k])];
      if (!shows(*predicted, block)) continue;
      out.columns.push_back(column_gap(data, block, residuals[k]));
      out.exceeding += out.columns.back().exceeds ? 1 : 0;
      sum += out.columns.back().gap * out.columns.back().gap;
    }
  }
  if (out.columns.empty() && !out.refused.empty()) throw InvalidArgument(in_one(out.refused));
  out.parts = parts_of(out.columns);
  if (!out.columns.empty()) out.gap = std::sqrt(sum / static_cast<double>(out.columns.size()));
  return out;
}

Measure measure(const cell::Recording& recording, const cell::Simulator& simulator) {
  return measure(recording, recording.cell, simulator);
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/gap_breakdown.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

namespace kr5::gap {
namespace {

const cell::Column& meaning_of(const ColumnGap& c) { return cell::find_column(c.kind, c.column); }

template <typename Name>
std::vector<std::string> names_of(const std::vector<ColumnGap>& columns, const Name& name) {
  std::vector<std::string> out;
  std::transform(columns.begin(), columns.end(), std::back_inserter(out), name);
  return out;
}

/// Unit of a column in this arm: those of joints read "rad or m", of a revolute and of a prismatic one.
std::string unit_in(const cell::Robot& robot, const cell::Column& column) {
  const std::string either = " or ";
  const auto at = column.unit.find(either);
  if (column.joint < 0 || at == std::string::npos) return column.unit;
  const bool slides = robot.dh[static_cast<std::size_t>(column.joint)].type == kinematics::JointType::Prismatic;
  return slides ? column.unit.substr(at + either.size()) : column.unit.substr(0, at);
}

ColumnGap make_column_gap(const cell::Robot& robot, const cell::Experiment& experiment, const std::string& column,
                          double sigma, const Eigen::VectorXd& residual) {
  ColumnGap out;
  out.experiment = experiment.name;
  out.kind = experiment.kind;
  out.column = column;
  const cell::Column& meaning = cell::find_column(experiment.kind, column);
  out.target = meaning.target;
  out.unit = unit_in(robot, meaning);
  out.split = experiment.split;
  out.noise = sigma;
  double sum = 0.0;
  for (const double r : residual)
    if (!std::isnan(r)) sum += r * r, ++out.rows;
  out.left_out = static_cast<int>(residual.size()) - out.rows;
  if (out.rows == 0) return out;
  out.gap = std::sqrt(sum / out.rows);
  out.rms = out.gap * out.noise;
  out.limit = noise_limit(out.rows);
  out.exceeds = out.gap > out.limit;
  return out;
}

/// The parts of columns with the same name, first seen first, then the widest gap first.
/// @param excess That each holds, of `all`.
void append(const std::string& by, const std::vector<ColumnGap>& columns, const std::vector<std::string>& names,
            const std::vector<double>& excess, double all, std::vector<GapPart>& out) {
  std::vector<GapPart> parts;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const ColumnGap& c = columns[k];
    auto part = std::find_if(parts.begin(), parts.end(), [&](const GapPart& p) { return p.name == names[k]; });
    if (part == parts.end()) part = parts.insert(parts.end(), {by, names[k]});
    part->columns += 1;
    part->exceeding += c.exceeds ? 1 : 0;
    part->gap += c.gap * c.gap;
    if (all > 0) part->share += excess[k] / all;
  }
  for (GapPart& part : parts) part.gap = std::sqrt(part.gap / part.columns);
  std::stable_sort(parts.begin(), parts.end(), [](const GapPart& a, const GapPart& b) { return a.gap > b.gap; });
  out.insert(out.end(), parts.begin(), parts.end());
}

}  // namespace

GapBreakdown::GapBreakdown(const cell::Recording& recording)
    : recording_(recording), conditions_({{"pose region", pose_regions(recording)}, {"speed", speeds(recording)}}) {}

ColumnGap GapBreakdown::add(int experiment, const std::string& column, double sigma, const Eigen::VectorXd& residual) {
  const cell::Experiment& of = recording_.experiments[static_cast<std::size_t>(experiment)];
  columns_.push_back(make_column_gap(recording_.cell.robot, of, column, sigma, residual));
  for (ByCondition& condition : conditions_) {
    std::map<std::string, std::vector<Eigen::Index>> rows;
    const std::vector<std::string>& words = condition.words[static_cast<std::size_t>(experiment)];
    for (std::size_t i = 0; i < words.size(); ++i) rows[words[i]].push_back(static_cast<Eigen::Index>(i));
    for (const auto& [word, at] : rows)
      if (const ColumnGap part = make_column_gap(recording_.cell.robot, of, column, sigma, residual(at));
          part.rows > 0) {
        condition.columns.push_back(part);
        condition.names.push_back(word);
        const ColumnGap& whole = columns_.back();
        condition.excess.push_back(whole.exceeds ? (part.gap * part.gap - 1) * part.rows / whole.rows : 0.0);
      }
  }
  return columns_.back();
}

std::vector<GapPart> GapBreakdown::all() const {
  std::vector<double> excess;
  for (const ColumnGap& c : columns_) excess.push_back(c.exceeds ? c.gap * c.gap - 1 : 0.0);
  const double all = std::accumulate(excess.begin(), excess.end(), 0.0);
  std::vector<GapPart> out;
  append("subsystem", columns_, names_of(columns_, [](const ColumnGap& c) { return meaning_of(c).subsystem; }), excess,
         all, out);
  append("target", columns_, names_of(columns_, [](const ColumnGap& c) { return c.target; }), excess, all, out);
  append("channel", columns_, names_of(columns_, [](const ColumnGap& c) { return meaning_of(c).channel; }), excess, all,
         out);
  append("experiment", columns_, names_of(columns_, [](const ColumnGap& c) { return c.experiment; }), excess, all, out);
  for (const ByCondition& c : conditions_) append(c.by, c.columns, c.names, c.excess, all, out);
  return out;
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/simulator.hpp>

#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "cell/effect_rows.hpp"

namespace kr5::cell {

io::Table Simulator::predict(const Cell& cell, const Experiment& experiment) const {
  cell.validate();
  return predict_unchecked(cell, experiment);
}

io::Table Simulator::predict_unchecked(const Cell& cell, const Experiment& experiment) const {
  const Eigen::Index before = experiment.lead_in.values.rows();
  if (before == 0) return predict_rows(cell, experiment);
  io::Table out = predict_rows(cell, with_lead_in(experiment));
  require(out.values.rows() == before + experiment.data.values.rows(),
          "a simulator must return one row for each recorded row");
  out.values = Eigen::MatrixXd(out.values.bottomRows(experiment.data.values.rows()));
  return out;
}

io::Table Simulator::predict_rows(const Cell& cell, const Experiment& experiment) const {
  std::vector<std::pair<const Effect*, ActiveEffect>> registered;
  for (ActiveEffect& active : registered_active_effects(cell.effects)) {
    const Effect* row = find_row(active.id);
    registered.emplace_back(row, std::move(active));
  }
  if (registered.empty()) return simulate(cell, experiment);
  Cell changed = cell;
  for (const auto& [row, active] : registered) changed.effects.remove(row->id);
  for (const auto& [row, active] : registered)
    if (row->change_cell) row->change_cell(changed, active);
  io::Table out = simulate(changed, experiment);
  for (const auto& [row, active] : registered)
    if (row->change_columns) row->change_columns(out, experiment, active);
  return out;
}

}  // namespace kr5::cell

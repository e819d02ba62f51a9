// SPDX-License-Identifier: BSD-3-Clause
#include "gap/recording_scope.hpp"

#include <algorithm>
#include <set>

namespace kr5::gap {
namespace {

bool at_rest(const cell::Experiment& e, int joints) {
  for (int j = 1; j <= joints; ++j) {
    const int at = e.data.find("qc" + std::to_string(j));
    if (at < 0 || e.data.values.col(at).maxCoeff() > e.data.values.col(at).minCoeff()) return false;
  }
  return true;
}

}  // namespace

std::vector<ScopeLimit> scope_limits(const cell::Recording& recording) {
  constexpr Eigen::Index min_rows = 10;
  std::vector<ScopeLimit> out;
  std::set<cell::Kind> kinds;
  for (const cell::Experiment& e : recording.experiments) {
    const Eigen::Index rows = e.data.values.rows();
    kinds.insert(e.kind);
    if (rows < min_rows)
      out.push_back({ScopeReason::FewRows, e.kind, e.name, static_cast<int>(rows)});
    else if (e.kind == cell::Kind::Motion && at_rest(e, recording.cell.robot.joints()))
      out.push_back({ScopeReason::AtRest, e.kind, e.name, static_cast<int>(rows)});
  }
  if (kinds.size() == 1) out.push_back({ScopeReason::OneKind, *kinds.begin(), "", 0});
  return out;
}

bool only_loads(const cell::Recording& recording) {
  return std::ranges::all_of(recording.experiments,
                             [](const cell::Experiment& e) { return e.kind == cell::Kind::Motion; });
}

}  // namespace kr5::gap

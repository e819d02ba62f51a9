// SPDX-License-Identifier: BSD-3-Clause
#include "gap/recording_scope.hpp"

#include <algorithm>
#include <set>

namespace kr5::gap {
namespace {

const char* shown_by(cell::Kind kind) {
  switch (kind) {
    case cell::Kind::Motion:
      return "the joints, their drives and the force sensor";
    case cell::Kind::Poses:
      return "the geometry of the arm and the tool";
    case cell::Kind::Views:
      return "the geometry of the arm and the camera";
    case cell::Kind::Scan:
      return "the geometry of the arm and the line scanner";
    case cell::Kind::Step:
      return "the path correction";
    case cell::Kind::Press:
      return "the contact, the path correction and the force sensor";
    case cell::Kind::Profile:
      return "the contact of peg and tube and the force sensor";
  }
  return "";
}

bool at_rest(const cell::Experiment& e, int joints) {
  for (int j = 1; j <= joints; ++j) {
    const int at = e.data.find("qc" + std::to_string(j));
    if (at < 0 || e.data.values.col(at).maxCoeff() > e.data.values.col(at).minCoeff()) return false;
  }
  return true;
}

}  // namespace

std::vector<std::string> scope_limits(const cell::Recording& recording) {
  constexpr Eigen::Index least_rows = 10;
  std::vector<std::string> out;
  std::set<cell::Kind> kinds;
  for (const cell::Experiment& e : recording.experiments) {
    const Eigen::Index rows = e.data.values.rows();
    kinds.insert(e.kind);
    if (rows < least_rows)
      out.push_back(e.name + " has " + std::to_string(rows) + (rows == 1 ? " row" : " rows") +
                    ": it can show neither a gap nor its absence");
    else if (e.kind == cell::Kind::Motion && at_rest(e, recording.cell.robot.joints()))
      out.push_back(e.name + " commands no motion: it cannot show friction, inertia and servos");
  }
  if (kinds.size() == 1)
    out.push_back("the recording has experiments of the kind " + std::string(kr5::name_of(*kinds.begin())) +
                  " only: it shows " + shown_by(*kinds.begin()) + ", not the rest of the cell");
  return out;
}

bool only_loads(const cell::Recording& recording) {
  return std::ranges::all_of(recording.experiments,
                             [](const cell::Experiment& e) { return e.kind == cell::Kind::Motion; });
}

}  // namespace kr5::gap

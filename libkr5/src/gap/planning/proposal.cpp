// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/proposal.hpp"

#include <algorithm>
#include <cstdio>

#include "gap/planning/motion_proposals.hpp"
#include "gap/planning/static_proposals.hpp"

namespace kr5::gap {

const cell::Experiment* recorded_experiment(const cell::Recording& recording, cell::Kind kind) {
  for (const cell::Experiment& e : recording.experiments)
    if (e.kind == kind && e.data.values.rows() > 1) return &e;
  return nullptr;
}

double end_time_of(const cell::Recording& recording, cell::Kind kind) {
  double end = 0.0;
  for (const cell::Experiment& e : recording.experiments)
    if (const int t = e.data.find("t"); e.kind == kind && t >= 0 && e.data.values.rows() > 0)
      end = std::max(end, e.data.values.col(t).maxCoeff());
  return end;
}

std::string two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

std::vector<int> joints_of(const std::vector<std::vector<EffectName>>& all) {
  std::vector<int> out;
  for (const auto& names : all)
    for (const EffectName& name : names) {
      const auto digits = name.target.find_first_of("0123456789");
      const bool joint = name.target.starts_with("joint") || name.target.starts_with("motor");
      if (!joint || digits == std::string::npos) continue;
      const int j = std::stoi(name.target.substr(digits)) - 1;
      if (std::find(out.begin(), out.end(), j) == out.end()) out.push_back(j);
    }
  return out;
}

Proposal repeat_experiment(const Family& family, const cell::Experiment& e, const std::string& what) {
  Proposal out{{"next", e.kind, "next.csv", cell::Split::Fit, {}, e.joint_reference, {}}, what, 0.0, set_up};
  const cell::Experiment whole = cell::with_lead_in(e);
  std::vector<Eigen::Index> at;
  for (const cell::Column& c : cell::columns(e.kind, family.recording.cell.robot.joints()))
    if (const int i = whole.data.find(c.name); c.role == cell::Role::Given && i >= 0) {
      at.push_back(i);
      out.experiment.data.columns.push_back(c.name);
    }
  out.experiment.data.values = whole.data.values(Eigen::all, at);
  if (const int t = out.experiment.data.find("t"); t >= 0) {
    const Eigen::VectorXd clock = out.experiment.data.values.col(t);
    out.seconds += clock.maxCoeff() - clock.minCoeff();
    out.experiment = cell::split_lead_in(out.experiment, e.data.column("t")(0) - clock(0));
    const double later = end_time_of(family.recording, e.kind) + set_up - clock.minCoeff();
    for (io::Table* part : {&out.experiment.lead_in, &out.experiment.data})
      if (part->values.rows() > 0) part->values.col(t).array() += later;
  }
  return out;
}

std::vector<Proposal> proposals(const Family& family, cell::Kind kind) {
  switch (kind) {
    case cell::Kind::Motion:
      return motion_proposals(family);
    case cell::Kind::Poses:
      return pose_proposals(family);
    case cell::Kind::Views:
      return view_proposals(family);
    case cell::Kind::Scan:
      return scan_proposals(family);
    case cell::Kind::Step:
      return step_proposals(family);
    case cell::Kind::Press:
      return press_proposals(family);
    case cell::Kind::Profile:
      return profile_proposals(family);
  }
  return {};
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/dynamics_model.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <kr5/core/error.hpp>

#include "identification/dynamics/friction_terms.hpp"

namespace kr5::identification {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int inertial_count = kinematics::inertial_parameter_count;
constexpr int coulomb_at = 10, viscous_at = 11, rotor_at = 12;  // of the 13 of a joint

/// Where kinematics::InertialRegressor has the inertial parameter k of the order of eq. 4.36.
constexpr int regressor_column(int k) { return k < 6 ? 4 + k : k < 9 ? k - 5 : 0; }

std::string parameter_name(int joint, int k) {
  const std::string i = std::to_string(joint + 1);
  static constexpr std::array<const char*, 6> inertia = {"xx", "xy", "xz", "yy", "yz", "zz"};
  static constexpr std::array<const char*, 3> axis = {"x", "y", "z"};
  if (k < 6) return "I" + i + inertia[static_cast<std::size_t>(k)];
  if (k < 9) return "m" + i + " c" + i + axis[static_cast<std::size_t>(k - 6)];
  if (k == 9) return "m" + i;
  return (k == coulomb_at ? "fc" : k == viscous_at ? "fv" : "Ia") + i;
}

std::string parameter_unit(int k, bool slides) {
  if (k < 6) return "kg m^2";
  if (k < 9) return "kg m";
  if (k == 9) return "kg";
  if (k == rotor_at) return slides ? "kg" : "kg m^2";
  return friction_unit(k == coulomb_at ? FrictionFactor::One : FrictionFactor::Speed, slides);
}

/// Whether a parameter is one of the ten of a link.
bool is_of_link(int column, int joints) {
  return column < parameters_per_joint * joints && column % parameters_per_joint < inertial_count;
}

void check_signals(const DynamicsModel& model, const JointMotion& motion, const MatrixXd& load) {
  const int n = model.joints();
  require(motion.joints() == n,
          "motion: expected " + std::to_string(n) + " joints, found " + std::to_string(motion.joints()));
  require(load.size() == 0 || (load.rows() == motion.samples() && load.cols() == n),
          "load: expected " + std::to_string(motion.samples()) + " x " + std::to_string(n) + " torques");
  for (int i = 0; i < n; ++i)
    require(!model.terms[static_cast<std::size_t>(i)].temperature || motion.temperature.size() > 0,
            "temperature: the friction of joint " + std::to_string(i + 1) +
                " depends on it; give the motion a temperature of each joint [deg C]");
}

/// Columns of the links, of all joints.
void fill_link_columns(const DynamicsModel& model, const JointMotion& motion, std::vector<JointRegressor>& out) {
  const int n = model.joints();
  kinematics::InertialRegressor inertial(model.chain, model.gravity);
  constexpr Index part = 64;  // samples whose regressor stays in the cache
  for (Index first = 0; first < motion.samples(); first += part) {
    const Index count = std::min(part, motion.samples() - first);
    const kinematics::Rows q = motion.q.middleRows(first, count), qd = motion.qd.middleRows(first, count),
                           qdd = motion.qdd.middleRows(first, count), Y = inertial.evaluate(q, qd, qdd);
    for (int i = 0; i < n; ++i) {
      JointRegressor& rows = out[static_cast<std::size_t>(i)];
      for (std::size_t at = 0; at < rows.columns.size(); ++at) {
        const int c = rows.columns[at];
        if (!is_of_link(c, n)) continue;
        const Index from = inertial_count * (c / parameters_per_joint) + regressor_column(c % parameters_per_joint);
        double* to = rows.X.col(static_cast<Index>(at)).data() + first;
        for (Index s = 0; s < count; ++s) to[s] = Y(s * n + i, from);
      }
    }
  }
}

}  // namespace

void DynamicsModel::validate() const {
  require(joints() > 0, "chain: no joint");
  require(gravity.allFinite(), "gravity must be finite [m/s^2]");
  const Index n = joints();
  if (structure.size() > 0) {
    require(structure.rows() == n && structure.cols() == n,
            "structure: expected " + std::to_string(n) + " x " + std::to_string(n) + " numbers, one row a motor");
    require(structure.allFinite() && (structure.diagonal().array() != 0.0).all(),
            "structure: numbers must be finite, those of the diagonal not 0");
  }
  require(terms.empty() || static_cast<Index>(terms.size()) == n,
          "terms: expected one entry a joint, " + std::to_string(n) + ", or none");
  for (const JointTerms& t : terms)
    require(t.stribeck_velocity >= 0 && std::isfinite(t.stribeck_velocity) && t.thermal_time_constant >= 0 &&
                std::isfinite(t.thermal_time_constant) && std::isfinite(t.temperature_reference) &&
                t.motor_stribeck_velocity >= 0 && std::isfinite(t.motor_stribeck_velocity),
            "terms: stribeck_velocity, motor_stribeck_velocity [rad/s] and thermal_time_constant [s] must not be "
            "negative, temperature_reference must be finite [deg C]");
}

DynamicsRegressor::DynamicsRegressor(DynamicsModel model) : model_(std::move(model)) {
  model_.validate();
  const int n = joints();
  model_.terms.resize(static_cast<std::size_t>(n));
  const auto slides = [&](int i) {
    return model_.chain.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Prismatic;
  };
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < parameters_per_joint; ++k) {
      names_.push_back(parameter_name(i, k));
      units_.push_back(parameter_unit(k, slides(i)));
    }
  for (int i = 0; i < n; ++i) {
    const std::vector<FrictionTerm>& table = friction_term_table();
    for (std::size_t row = 0; row < table.size(); ++row) {
      if (!table[row].present(model_.terms[static_cast<std::size_t>(i)])) continue;
      if (table[row].motor && !is_shared(model_.structure, i)) continue;
      names_.push_back(table[row].name + std::to_string(i + 1));
      units_.push_back(friction_unit(table[row].factor, slides(i)));
      terms_.push_back({i, row});
    }
  }
}

int DynamicsRegressor::index(const std::string& name) const {
  const auto at = std::find(names_.begin(), names_.end(), name);
  return at == names_.end() ? -1 : static_cast<int>(at - names_.begin());
}

std::vector<int> DynamicsRegressor::columns_of_joint(int i, const MatrixXd& structure,
                                                     const std::vector<char>& wanted) const {
  const int n = joints();
  const auto has = [&](int c) { return wanted[static_cast<std::size_t>(c)] != 0; };
  std::vector<int> out;
  for (int j = 0; j < n; ++j) {
    const JointTerms& t = model_.terms[static_cast<std::size_t>(j)];
    for (int k = 0; k < parameters_per_joint; ++k) {
      const bool there = k < inertial_count ? j >= i
                         : k == coulomb_at  ? j == i && t.coulomb
                         : k == viscous_at  ? j == i && t.viscous
                                            : structure(j, i) != 0.0 && t.rotor_inertia;
      if (const int c = parameters_per_joint * j + k; there && has(c)) out.push_back(c);
    }
  }
  for (std::size_t e = 0; e < terms_.size(); ++e) {
    const int c = parameters_per_joint * n + static_cast<int>(e), j = terms_[e].joint;
    if (friction_term_table()[terms_[e].row].share(structure, j, i) != 0.0 && has(c)) out.push_back(c);
  }
  return out;
}

void DynamicsRegressor::fill_drive_columns(int i, const JointMotion& motion, const MatrixXd& structure,
                                           const MatrixXd& load, JointRegressor& rows) const {
  const int links_and_drives = parameters_per_joint * joints();
  const JointSignals signals = joint_signals(motion, load, i);
  for (std::size_t at = 0; at < rows.columns.size(); ++at) {
    const int c = rows.columns[at], j = c / parameters_per_joint, k = c % parameters_per_joint;
    auto column = rows.X.col(static_cast<Index>(at));
    if (c >= links_and_drives) {
      const auto [joint, row] = terms_[static_cast<std::size_t>(c - links_and_drives)];
      const FrictionTerm& term = friction_term_table()[row];
      const JointTerms& shape = model_.terms[static_cast<std::size_t>(joint)];
      column =
          term.share(structure, joint, i) * term.column(shape, term.signals(structure, motion, load, joint)).matrix();
    } else if (k == rotor_at) {
      column = motion.qdd * structure.row(j).transpose() * (structure(j, i) / (structure(j, j) * structure(j, j)));
    } else if (k >= inertial_count) {
      column = (k == coulomb_at ? coulomb_column(signals) : viscous_column(signals)).matrix();
    }
  }
}

std::vector<JointRegressor> DynamicsRegressor::joint_regressors(const JointMotion& motion,
                                                                const std::vector<int>& columns,
                                                                const MatrixXd& load) const {
  const int n = joints();
  check_signals(model_, motion, load);
  std::vector<char> wanted(names_.size(), columns.empty());
  for (const int c : columns) wanted.at(static_cast<std::size_t>(c)) = 1;
  const MatrixXd S = model_.structure.size() > 0 ? model_.structure : MatrixXd::Identity(n, n);
  std::vector<JointRegressor> out(static_cast<std::size_t>(n));
  bool links = false;
  for (int i = 0; i < n; ++i) {
    JointRegressor& rows = out[static_cast<std::size_t>(i)];
    rows.columns = columns_of_joint(i, S, wanted);
    links = links || std::ranges::any_of(rows.columns, [&](int c) { return is_of_link(c, n); });
    rows.X.resize(motion.samples(), static_cast<Index>(rows.columns.size()));
    fill_drive_columns(i, motion, S, load, rows);
  }
  if (links) fill_link_columns(model_, motion, out);
  return out;
}

MatrixXd DynamicsRegressor::evaluate(const JointMotion& motion, const MatrixXd& load) const {
  const int n = joints();
  MatrixXd Y = MatrixXd::Zero(motion.samples() * n, parameters());
  const std::vector<JointRegressor> rows = joint_regressors(motion, {}, load);
  for (int i = 0; i < n; ++i) {
    const JointRegressor& joint = rows[static_cast<std::size_t>(i)];
    for (std::size_t at = 0; at < joint.columns.size(); ++at)
      for (Index s = 0; s < motion.samples(); ++s) Y(s * n + i, joint.columns[at]) = joint.X(s, static_cast<Index>(at));
  }
  return Y;
}

namespace {

MatrixXd weigh_columns(const std::vector<JointRegressor>& rows, Index samples, const VectorXd& parameters) {
  MatrixXd out = MatrixXd::Zero(samples, static_cast<Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    VectorXd chosen(static_cast<Index>(rows[i].columns.size()));
    for (std::size_t at = 0; at < rows[i].columns.size(); ++at)
      chosen[static_cast<Index>(at)] = parameters[rows[i].columns[at]];
    out.col(static_cast<Index>(i)) = rows[i].X * chosen;
  }
  return out;
}

/// Parameters that are not zero, of the kinds that are asked for: the others need no column.
std::vector<int> used_columns(const VectorXd& parameters, int joints, bool friction) {
  std::vector<int> out;
  for (int c = 0; c < parameters.size(); ++c) {
    const bool dry = c >= parameters_per_joint * joints || c % parameters_per_joint == coulomb_at ||
                     c % parameters_per_joint == viscous_at;
    if (parameters[c] != 0.0 && (friction || !dry)) out.push_back(c);
  }
  return out;
}

}  // namespace

MatrixXd DynamicsRegressor::link_torques(const JointMotion& motion, const VectorXd& parameters) const {
  require(parameters.size() == this->parameters(), "parameters: expected " + std::to_string(this->parameters()) +
                                                       " values, found " + std::to_string(parameters.size()));
  VectorXd links = parameters;
  for (int i = 0; i < joints(); ++i) links[parameters_per_joint * i + rotor_at] = 0.0;
  const std::vector<int> columns = used_columns(links, joints(), false);
  if (columns.empty()) return MatrixXd::Zero(motion.samples(), joints());
  return weigh_columns(joint_regressors(motion, columns), motion.samples(), parameters);
}

MatrixXd DynamicsRegressor::torques(const JointMotion& motion, const VectorXd& parameters) const {
  require(parameters.size() == this->parameters(), "parameters: expected " + std::to_string(this->parameters()) +
                                                       " values, found " + std::to_string(parameters.size()));
  const bool loaded = std::any_of(model_.terms.begin(), model_.terms.end(), [](const JointTerms& t) { return t.load; });
  const std::vector<int> columns = used_columns(parameters, joints(), true);
  if (columns.empty()) return MatrixXd::Zero(motion.samples(), joints());
  return weigh_columns(joint_regressors(motion, columns, loaded ? link_torques(motion, parameters) : MatrixXd()),
                       motion.samples(), parameters);
}

}  // namespace kr5::identification

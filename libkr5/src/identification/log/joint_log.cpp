// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/joint_log.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::identification {

namespace {

std::string log_column_name(const std::vector<std::string>& names, const char* stem, Eigen::Index joint) {
  return names.empty() ? stem + std::to_string(joint + 1) : names[static_cast<std::size_t>(joint)];
}

}  // namespace

std::string JointLog::q_name(Eigen::Index joint) const { return log_column_name(q_names, "q", joint); }
std::string JointLog::qd_name(Eigen::Index joint) const { return log_column_name(qd_names, "qd", joint); }
std::string JointLog::tau_name(Eigen::Index joint) const { return log_column_name(tau_names, "tau", joint); }

std::string JointLog::temperature_name(Eigen::Index joint) const {
  return log_column_name(temperature_names, "temperature", joint);
}

JointLog JointLog::with_rows(const std::vector<Eigen::Index>& rows) const {
  JointLog out = *this;
  out.t = t(rows);
  out.q = q(rows, Eigen::all);
  if (qd.size() > 0) out.qd = qd(rows, Eigen::all);
  out.tau = tau(rows, Eigen::all);
  if (temperature.size() > 0) out.temperature = temperature(rows, Eigen::all);
  return out;
}

void JointLog::validate() const {
  require(t.size() > 0 && q.cols() > 0, "t, q: no sample of any joint");
  const auto check_size = [&](const Eigen::MatrixXd& values, const char* name) {
    require(values.rows() == t.size() && values.cols() == q.cols(),
            std::string(name) + ": expected " + std::to_string(t.size()) + " x " + std::to_string(q.cols()) +
                " numbers, found " + std::to_string(values.rows()) + " x " + std::to_string(values.cols()));
  };
  check_size(q, "q");
  check_size(tau, "tau");
  if (qd.size() > 0) check_size(qd, "qd");
  if (temperature.size() > 0) check_size(temperature, "temperature");
  for (const auto* names : {&q_names, &qd_names, &tau_names, &temperature_names})
    require(names->empty() || static_cast<Eigen::Index>(names->size()) == q.cols(),
            "q_names, qd_names, tau_names, temperature_names: one name a joint, or none");
}

std::pair<JointLog, JointLog> split_log(const JointLog& log, double last) {
  log.validate();
  require(last >= 0 && last <= 1, "last: a share of the time, from 0 to 1 [-]");
  double begin = std::numeric_limits<double>::infinity(), end = -begin;
  for (const double t : log.t)
    if (std::isfinite(t)) begin = std::min(begin, t), end = std::max(end, t);
  const double cut = end - last * (end - begin);
  std::vector<Eigen::Index> early, late;
  for (Eigen::Index i = 0; i < log.t.size(); ++i) (log.t[i] >= cut ? late : early).push_back(i);
  return {log.with_rows(early), log.with_rows(late)};
}

}  // namespace kr5::identification

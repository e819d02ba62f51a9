// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_rows.hpp>

#include <algorithm>
#include <limits>

namespace kr5::rsi {
namespace {

constexpr double series_pause = 0.5;  // after which another sender is heard [s]
constexpr double series_jump = 1.0;   // of IPOC against the arrivals, after which a series begins anew [s]
constexpr double least_step = 1e-4;   // from the last row of a series to the first of the next [s]

void add_numbered(const std::string& letters, const robot::JointVector& values, std::vector<std::string>& to) {
  for (Eigen::Index i = 1; i <= values.size(); ++i) to.push_back(letters + std::to_string(i));
}

void add_values(const robot::JointVector& values, std::vector<double>& to) {
  to.insert(to.end(), values.begin(), values.end());
}

}  // namespace

LinkRowReader::LinkRowReader(const TelegramLayout& layout)
    : codec_(layout, Sender::Controller), units_(layout), names_{"t", "ipoc"} {
  Telegram full;
  full.present.set();
  const ControllerState state = units_.state(full);
  add_numbered("q", state.joints, names_);
  add_numbered("qc", state.joint_setpoints, names_);
  add_numbered("i", state.currents, names_);
  add_numbered("tau", state.efforts, names_);
  if (state.tool) names_.insert(names_.end(), {"x", "y", "z", "rx", "ry", "rz"});
  if (state.late_packets) names_.emplace_back("late_packets");
  if (state.program_state) names_.emplace_back("program_state");
  names_.emplace_back("answer_time");
}

/// Whether a telegram is a row; then `time_` is its time.
bool LinkRowReader::advance(const Exchange& e, const Ipoc& ipoc) {
  const double arrivals = e.time - last_arrival_;
  if (last_ipoc_ && e.sender != sender_ && arrivals < series_pause) return false;
  const double step = last_ipoc_ ? 1e-3 * static_cast<double>(ipoc_step(*last_ipoc_, ipoc)) : 0.0;
  const bool anew = !last_ipoc_ || e.sender != sender_ || step < -series_jump || step - arrivals > series_jump;
  if (!anew && step <= 0) return false;
  time_ = !anew ? time_ + step : last_ipoc_ ? std::max(e.time, time_ + least_step) : e.time;
  last_ipoc_ = ipoc;
  last_arrival_ = e.time;
  sender_ = e.sender;
  return true;
}

std::vector<double> LinkRowReader::row(const Exchange& e, const Telegram& telegram) const {
  const ControllerState state = units_.state(telegram);
  std::vector<double> out = {time_, static_cast<double>(telegram.ipoc.value())};
  for (const robot::JointVector& v : {state.joints, state.joint_setpoints, state.currents, state.efforts})
    add_values(v, out);
  if (state.tool) {
    const Vector6 pose = to_vector(*state.tool);
    out.insert(out.end(), pose.begin(), pose.end());
  }
  if (state.late_packets) out.push_back(*state.late_packets);
  if (state.program_state) out.push_back(*state.program_state);
  out.push_back(e.duration.value_or(std::numeric_limits<double>::quiet_NaN()));
  return out;
}

LinkRows LinkRowReader::read(const LinkObservations& observations) {
  LinkRows out;
  std::vector<std::vector<double>> rows;
  Telegram telegram;
  for (const Exchange& e : observations.exchanges) {
    const TelegramFault fault = codec_.decode(e.telegram, telegram);
    if (fault != TelegramFault::None)
      out.faulty.push_back({e.time, fault, e.sender});
    else if (advance(e, telegram.ipoc))
      rows.push_back(row(e, telegram));
  }
  out.values.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(names_.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    out.values.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVectorXd>(rows[i].data(), static_cast<Eigen::Index>(rows[i].size()));
  return out;
}

}  // namespace kr5::rsi

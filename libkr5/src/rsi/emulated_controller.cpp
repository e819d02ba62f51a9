// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/emulated_controller.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

constexpr std::size_t most_events = 10'000;
constexpr double program_stopped = 4;   // $PRO_STATE
constexpr double smallest_jump = 1e-9;  // [rad or m]

bool corrects(Meaning meaning) {
  return meaning == Meaning::AxisCorrection || meaning == Meaning::ExternalCorrection ||
         meaning == Meaning::CartesianCorrection;
}

/// Which values of an answer stay while none comes. A relative correction is a motion, which is not made twice.
std::vector<bool> held_values(const TelegramLayout& layout, const EmulationOptions& options) {
  const bool relative = options.mode == robot::CommandMode::Relative;
  const std::vector<TelegramField> all = telegram_fields(layout.receive);
  std::vector<bool> out(all.size(), true);
  for (const TelegramElement& element : layout.receive)
    for (const TelegramField& f : telegram_fields({element}))
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i].element != f.element || all[i].attribute != f.attribute) continue;
        const bool motion = relative && corrects(f.meaning) && !options.rules.relative_repeats_held;
        out[i] = element.hold.value_or(true) && !motion;
      }
  return out;
}

TelegramLayout without_elements(TelegramLayout layout) {
  layout.send.clear();
  return layout;
}

double largest_change(const robot::JointVector& a, const robot::JointVector& b, const Pose& T_a, const Pose& T_b) {
  const double joints = a.size() > 0 ? (b - a).cwiseAbs().maxCoeff() : 0.0;
  return joints > 0.0 ? joints : (T_b.translation() - T_a.translation()).cwiseAbs().maxCoeff();
}

}  // namespace

EmulatedController::EmulatedController(const TelegramLayout& layout, const robot::SensorModel& model,
                                       const EmulationOptions& options, robot::Robot& robot)
    : writer_(layout, Sender::Controller),
      greeter_(without_elements(layout), Sender::Controller),
      reader_(layout, Sender::Computer),
      units_(layout),
      model_(model),
      options_((options.validate(), options)),
      robot_(robot),
      only_send_(layout.only_send),
      holds_(held_values(layout, options)),
      total_(options.rules, options.mode, options.frame, units_.joints()),
      late_(options.rules),
      path_(options.path, options.path_speed, units_.joints()) {
  model_.validate();
  require(std::abs(robot.cycle() - options.rules.cycle) < 1e-6, "rules.cycle: the robot has another cycle [s]");
  const auto joints = static_cast<int>(model_.arm.joints.size());
  require(!has_arm() || joints == units_.joints(), "robot: its arm has " + std::to_string(joints) +
                                                       " joints, the layout has " + std::to_string(units_.joints()));
  require(has_arm() || (!units_.corrects_joints() && options.path.empty()),
          "robot: has no joints, which corrections of axes and a path need");
  require(options.axis_speeds.size() == 0 || options.axis_speeds.size() == units_.joints(),
          "axis_speeds: expected " + std::to_string(units_.joints()) + " speeds, or none [rad/s or m/s]");
  statistics_.override_share = options.override_share;
  begin();
  gripper_.hold = reading_.status.gripped;  // outputs are as they were when the program begins
}

std::uint64_t EmulatedController::ipoc_now() const noexcept {
  const double passed = static_cast<double>(cycle_ - 1 - begun_at_) * options_.rules.cycle;  // the first ends a cycle
  return options_.rules.first_ipoc + static_cast<std::uint64_t>(std::llround(1e3 * passed));
}

void EmulatedController::note(EventKind kind, double value, const ProgramStop& stop) {
  if (events_.size() == most_events) return;
  events_.push_back({static_cast<double>(cycle_) * options_.rules.cycle, kind, statistics_.ipoc, value, stop});
}

void EmulatedController::begin() {
  reading_ = robot_.read();
  require(!has_arm() || reading_.joints.size() == units_.joints(), "robot: tells another number of joints than it has");
  start_tool_ = reading_.T_base_tool;
  if (has_arm()) path_.begin(reading_.joints);
  setpoints_ = path_.joints();
  total_.clear();
  late_.restart();
  applied_ = {};
  sent_of_program_ = 0;
  idle_ = 0;
  asked_ = answered_ = met_ = false;
  if (options_.rules.ipoc_restarts) begun_at_ = cycle_;
  statistics_.phase = ControllerPhase::Running;
  statistics_.stop = {};
  ++statistics_.programs;
  note(EventKind::Started);
}

void EmulatedController::end(const ProgramStop& stop) {
  statistics_.phase = ControllerPhase::Ended;
  statistics_.stop = stop;
  asked_ = false;
  note(EventKind::Ended, 0.0, stop);
}

AnswerVerdict EmulatedController::receive(std::string_view bytes, double since) noexcept {
  const TelegramFault fault = reader_.decode(bytes, answer_);
  statistics_.telegrams.count(fault);
  const bool usable =
      fault == TelegramFault::None || (fault == TelegramFault::Incomplete && options_.rules.accepts_incomplete);
  if (!usable) return AnswerVerdict::Faulty;
  if (!asked_) return ++statistics_.unasked, AnswerVerdict::Unasked;
  if (!(answer_.ipoc == out_.ipoc)) {
    const bool earlier = answer_.ipoc.value() < out_.ipoc.value() && answer_.ipoc.value() >= options_.rules.first_ipoc;
    return ++(earlier ? statistics_.late : statistics_.foreign), earlier ? AnswerVerdict::Late : AnswerVerdict::Foreign;
  }
  if (answered_) return ++statistics_.repeated, AnswerVerdict::Repeated;
  if (since > options_.rules.answer_time) return ++statistics_.late, AnswerVerdict::Late;
  answered_ = true;
  for (std::size_t i = 0; i < holds_.size(); ++i)
    if (answer_.present[i] || !holds_[i]) applied_.values[i] = answer_.values[i];
  applied_.message = answer_.message;
  return AnswerVerdict::Good;
}

/// Makes of the last values those of this cycle: what HOLDON does not keep is 0 without an answer.
void EmulatedController::take_answer() noexcept {
  for (std::size_t i = 0; i < holds_.size(); ++i)
    if (!answered_ && !holds_[i]) applied_.values[i] = 0.0;
  applied_.present.set();
}

void EmulatedController::judge() {
  const bool answered = answered_;
  if (answered) ++statistics_.answered;
  if (answered && !met_) note(EventKind::Answered);
  met_ = met_ || answered;
  if (!met_ && options_.count_from == CountFrom::Answer) return;
  if (!answered && late_.in_succession() == 0) note(EventKind::Missing);
  const ProgramStopReason reason = late_.count(answered);
  statistics_.missing = late_.total();
  statistics_.missing_now = late_.in_succession();
  statistics_.missing_most = late_.max_in_succession();
  statistics_.missing_share = late_.share();
  if (reason != ProgramStopReason::None) return end({reason});
  take_answer();
  apply(units_.correction(applied_), answered);
}

void EmulatedController::note_jump(const robot::JointVector& joints, const Pose& tool) {
  const double size = largest_change(joints, total_.joints(), tool, total_.tool());
  if (size < smallest_jump) return;
  ++statistics_.jumps;
  statistics_.largest_jump = std::max(statistics_.largest_jump, size);
  note(EventKind::Jump, size);
}

bool EmulatedController::idles(const Correction& received, bool answered) noexcept {
  if (!relative() || !options_.rules.idle_limit) return false;
  const bool moves = !received.joints.isZero() || (received.tool && !received.tool->isApprox(Pose::Identity(), 1e-12));
  idle_ = moves || !answered ? 0 : idle_ + 1;
  return idle_ * options_.rules.cycle >= *options_.rules.idle_limit;
}

void EmulatedController::apply(const Correction& received, bool answered) {
  gripper_ = received.gripper;
  if (statistics_.phase != ControllerPhase::Running) return;  // an arm that stands is not corrected
  if (received.stop_move) return end({ProgramStopReason::Asked});
  if (idles(received, answered)) return end({ProgramStopReason::Idle});
  const robot::JointVector joints = total_.joints();
  const Pose tool = total_.tool();
  const bool was_limited = total_.limited();
  const double share = options_.rules.override_scales_corrections ? statistics_.override_share : 1.0;
  if (const ProgramStop stop = total_.take(received, share)) return end(stop);
  if (!answered) note_jump(joints, tool);
  if (total_.limited()) ++statistics_.limited;
  if (total_.limited() && !was_limited) note(EventKind::Limited);
}

ProgramStop EmulatedController::axis_too_fast(const robot::JointVector& setpoints) const noexcept {
  for (Eigen::Index i = 0; i < options_.axis_speeds.size(); ++i)
    if (std::abs(setpoints[i] - setpoints_[i]) > options_.axis_speeds[i] * options_.rules.cycle * (1 + 1e-9))
      return {ProgramStopReason::AxisSpeed, static_cast<int>(i) + 1};
  return {};
}

Pose EmulatedController::path_tool(const robot::JointVector& joints) const noexcept {
  return has_arm() ? Pose(model_.arm.flange(joints) * model_.T_flange_tool) : *start_tool_;
}

robot::RobotCommand EmulatedController::command(const robot::JointVector& setpoints) const noexcept {
  robot::RobotCommand out;
  if (units_.corrects_tool()) {
    out = robot::tool_command(total_.corrected(path_tool(setpoints)));
  } else if (has_arm()) {
    out.space = robot::CommandSpace::Joints;
    out.joints = setpoints;
  }
  out.gripper = gripper_;
  return out;
}

void EmulatedController::move() {
  robot::RobotCommand told;
  told.gripper = gripper_;
  told.stop = true;
  if (statistics_.phase == ControllerPhase::Running) {
    path_.advance(options_.rules.cycle, statistics_.override_share);
    const robot::JointVector setpoints = path_.joints() + total_.joints();
    if (const ProgramStop stop = axis_too_fast(setpoints)) {
      end(stop);
    } else {
      setpoints_ = setpoints;
      told = command(setpoints);
    }
  }
  robot_.send(told);
  reading_ = robot_.read();
  if (!told.stop && !reading_.status.reachable) end({ProgramStopReason::Unreachable});
}

std::string_view EmulatedController::tell() {
  const bool greeting = options_.rules.greets && sent_of_program_ == 0;
  ControllerState state;
  state.tool = reading_.T_base_tool;
  state.tool_setpoint = path_tool(path_.joints());
  if (has_arm()) {
    state.joints = reading_.joints;
    state.joint_setpoints = path_.joints();
  }
  state.efforts = reading_.efforts;
  state.currents = reading_.currents;
  state.sensor = reading_.sensor;
  state.late_packets = options_.rules.delay_restarts ? late_.in_succession() : static_cast<double>(late_.total());
  state.program_state = statistics_.phase == ControllerPhase::Running ? program_active : program_stopped;
  state.override_share = statistics_.override_share;
  state.gripped = reading_.status.gripped;
  units_.set_state(state, out_);
  statistics_.ipoc = ipoc_now();
  out_.ipoc = Ipoc(statistics_.ipoc);
  const std::size_t size = (greeting ? greeter_ : writer_).encode(out_, bytes_);
  require(size > 0, "robot: tells what is no number");
  asked_ = !greeting && !only_send_;
  answered_ = false;
  ++statistics_.sent;
  ++sent_of_program_;
  return {bytes_.data(), size};
}

std::string_view EmulatedController::cycle() {
  if (asked_) judge();
  asked_ = false;
  move();
  ++cycle_;
  ++statistics_.cycles;
  const ControllerPhase phase = statistics_.phase;
  if (phase == ControllerPhase::Ended) return {};
  if (phase != ControllerPhase::Running && !options_.rules.sends_while_stopped) return {};
  return tell();
}

void EmulatedController::set_drives(bool on) {
  const ControllerPhase phase = statistics_.phase;
  const bool stands = phase == ControllerPhase::DrivesOff || phase == ControllerPhase::EmergencyStop;
  if (phase == ControllerPhase::Ended || on != stands) return;
  statistics_.phase = on ? ControllerPhase::Running : ControllerPhase::DrivesOff;
  note(on ? EventKind::DrivesOn : EventKind::DrivesOff);
}

void EmulatedController::emergency_stop() {
  if (statistics_.phase == ControllerPhase::Ended || statistics_.phase == ControllerPhase::EmergencyStop) return;
  statistics_.phase = ControllerPhase::EmergencyStop;
  note(EventKind::EmergencyStop);
}

void EmulatedController::set_override(double share) {
  require(share >= 0 && share <= 1, "override_share: must lie between 0 and 1 [-]");
  statistics_.override_share = share;
  note(EventKind::Override, share);
}

void EmulatedController::reset_program() { begin(); }

void EmulatedController::disconnect() {
  if (statistics_.phase != ControllerPhase::Ended) end({ProgramStopReason::Disconnected});
}

void EmulatedController::note_overrun(std::uint64_t cycles) { note(EventKind::Overrun, static_cast<double>(cycles)); }

}  // namespace kr5::rsi

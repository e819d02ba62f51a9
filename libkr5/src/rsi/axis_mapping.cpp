// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/axis_mapping.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>
#include <kr5/rsi/controller_state.hpp>
#include <kr5/rsi/telegram_codec.hpp>

namespace kr5::rsi {
namespace {

constexpr int ways = 8;  // of one axis: two directions, four zeros
constexpr std::size_t most_postures = 12;
constexpr double quarter = std::numbers::pi / 2;

using Choice = std::array<int, 6>;  // of each axis, one of the ways

double way_sign(int way) { return way < 4 ? 1.0 : -1.0; }
double way_zero(int way) {
  constexpr std::array<double, 4> zeros = {0.0, quarter, -quarter, 2 * quarter};
  return zeros[static_cast<std::size_t>(way % 4)];
}
double mapped_joint(int way, double axis) { return way_sign(way) * axis + way_zero(way); }

ControllerAxes mapped_axes(const Choice& choice) {
  ControllerAxes out{Eigen::VectorXd(6), Eigen::VectorXd(6)};
  for (int i = 0; i < 6; ++i) {
    out.sign[i] = way_sign(choice[static_cast<std::size_t>(i)]);
    out.zero[i] = way_zero(choice[static_cast<std::size_t>(i)]);
  }
  return out;
}

/// How much a choice differs from the joints themselves.
int changes(const Choice& choice) {
  int out = 0;
  for (const int way : choice) out += (way >= 4 ? 1 : 0) + (way % 4 ? 1 : 0);
  return out;
}

/// Cosine of the angle between two orientations.
double cosine_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return 0.5 * (a.cwiseProduct(b).sum() - 1.0);
}

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return 2.0 * std::asin(std::min(1.0, (a - b).norm() / std::sqrt(8.0)));
}

/// Postures that lie apart, the first of them in the middle of the motion: a link tells thousands that are nearly
/// equal.
std::vector<AxisPoseRow> postures_of(const std::vector<AxisPoseRow>& rows) {
  constexpr double least_distance = 1e-3;  // [rad]
  std::vector<AxisPoseRow> good, out;
  for (const AxisPoseRow& r : rows)
    if (r.axes.allFinite() && r.pose.matrix().allFinite()) good.push_back(r);
  if (good.empty()) return out;
  std::vector<double> distance(good.size(), std::numeric_limits<double>::infinity());
  std::size_t next = good.size() / 2;
  while (out.size() < most_postures && distance[next] > least_distance) {
    out.push_back(good[next]);
    for (std::size_t i = 0; i < good.size(); ++i)
      distance[i] = std::min(distance[i], (good[i].axes - out.back().axes).norm());
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  return out;
}

class MappingSearch {
 public:
  MappingSearch(const std::vector<AxisPoseRow>& rows, const robot::SensorModel& model,
                const AxisMappingOptions& options)
      : rows_(rows), model_(model), options_(options) {}

  std::vector<std::pair<Choice, AxisMapping>> with_known_frames() const;
  std::vector<std::pair<Choice, AxisMapping>> with_unknown_frames() const;

 private:
  struct Half {
    std::array<int, 3> ways;
    Pose T;
  };

  /// Poses over three joints, of each of their choices. @param first Of the joints.
  std::vector<Half> halves(const Vector6& axes, int first, int fixed = -1) const;
  Pose flange(const Choice& choice, const Vector6& axes) const;
  bool estimate_frames(const Choice& choice, AxisMapping& out) const;
  bool fits(const Choice& choice, AxisMapping& out) const;

  const std::vector<AxisPoseRow>& rows_;
  const robot::SensorModel& model_;
  const AxisMappingOptions& options_;
};

std::vector<MappingSearch::Half> MappingSearch::halves(const Vector6& axes, int first, int fixed) const {
  std::array<std::array<Pose, ways>, 3> steps;
  for (int k = 0; k < 3; ++k)
    for (int w = 0; w < ways; ++w)
      steps[static_cast<std::size_t>(k)][static_cast<std::size_t>(w)] =
          model_.arm.joints[static_cast<std::size_t>(first + k)].transform(mapped_joint(w, axes[first + k]));
  const auto step = [&steps](int k, int w) { return steps[static_cast<std::size_t>(k)][static_cast<std::size_t>(w)]; };
  const auto wanted = [&](int k, int w) { return first + k != fixed || w % 4 == 0; };
  const Pose T_first = first == 0 ? model_.arm.T_base_0 : Pose::Identity();
  std::vector<Half> out;
  for (int a = 0; a < ways; ++a)
    for (int b = 0; b < ways; ++b) {
      const Pose T = T_first * step(0, a) * step(1, b);
      for (int c = 0; c < ways; ++c)
        if (wanted(0, a) && wanted(1, b) && wanted(2, c)) out.push_back({{a, b, c}, T * step(2, c)});
    }
  return out;
}

Pose MappingSearch::flange(const Choice& choice, const Vector6& axes) const {
  Pose out = model_.arm.T_base_0;
  for (std::size_t i = 0; i < 6; ++i)
    out = out * model_.arm.joints[i].transform(mapped_joint(choice[i], axes[static_cast<Eigen::Index>(i)]));
  return out;
}

/// Whether all poses agree, with the frames of the mapping; its misfits.
bool MappingSearch::fits(const Choice& choice, AxisMapping& out) const {
  out.position_misfit = out.rotation_misfit = 0.0;
  for (const AxisPoseRow& r : rows_) {
    const Pose T = out.T_active_base * flange(choice, r.axes) * out.T_flange_active;
    out.position_misfit = std::max(out.position_misfit, (T.translation() - r.pose.translation()).norm());
    out.rotation_misfit = std::max(out.rotation_misfit, angle_between(T.linear(), r.pose.linear()));
    if (!(out.position_misfit <= options_.position_tolerance && out.rotation_misfit <= options_.rotation_tolerance))
      return false;
  }
  out.axes = mapped_axes(choice);
  return true;
}

/// The first three joints and the last three meet in the first posture: A(q1..q3) B(q4..q6) = T_base_flange.
std::vector<std::pair<Choice, AxisMapping>> MappingSearch::with_known_frames() const {
  const AxisPoseRow& r = rows_.front();
  const std::vector<Half> bases = halves(r.axes, 0), wrists = halves(r.axes, 3);
  const Pose T_flange = r.pose * model_.T_flange_tool.inverse();
  const double lever = model_.T_flange_tool.translation().norm();
  const double reach = options_.position_tolerance + lever * options_.rotation_tolerance;
  const double least_cosine = std::cos(options_.rotation_tolerance);
  std::vector<std::pair<Choice, AxisMapping>> out;
  for (const Half& base : bases) {
    const Pose rest = base.T.inverse() * T_flange;
    for (const Half& wrist : wrists) {
      if ((rest.translation() - wrist.T.translation()).squaredNorm() > reach * reach) continue;
      if (cosine_between(rest.linear(), wrist.T.linear()) < least_cosine) continue;
      const Choice choice = {base.ways[0], base.ways[1], base.ways[2], wrist.ways[0], wrist.ways[1], wrist.ways[2]};
      AxisMapping mapping;
      mapping.T_flange_active = model_.T_flange_tool;
      if (fits(choice, mapping)) out.emplace_back(choice, mapping);
    }
  }
  return out;
}

/// Constant frames at both ends by the motions between the postures, in the sense of least squares: rotation by their
/// axes, translation by a linear system. False where the motions do not determine them.
bool MappingSearch::estimate_frames(const Choice& choice, AxisMapping& out) const {
  const std::size_t n = rows_.size();
  std::vector<Pose> told, moved;
  const Pose F = flange(choice, rows_.front().axes);
  for (std::size_t i = 1; i < n; ++i) {
    told.push_back(rows_.front().pose.inverse() * rows_[i].pose);
    moved.push_back(F.inverse() * flange(choice, rows_[i].axes));
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < told.size(); ++i)
    sum += log_rotation(moved[i].linear()) * log_rotation(told[i].linear()).transpose();
  constexpr double least_turn = 1e-3;  // [rad^2]
  if (Eigen::JacobiSVD<Eigen::Matrix3d>(sum).singularValues()[1] < least_turn) return false;
  const Eigen::Matrix3d R = nearest_rotation(sum);
  Eigen::MatrixXd A(3 * static_cast<Eigen::Index>(told.size()), 3);
  Eigen::VectorXd b(A.rows());
  for (std::size_t i = 0; i < told.size(); ++i) {  // moved Y = Y told
    const auto at = 3 * static_cast<Eigen::Index>(i);
    A.middleRows<3>(at) = moved[i].linear() - Eigen::Matrix3d::Identity();
    b.segment<3>(at) = R * told[i].translation() - moved[i].translation();
  }
  out.T_flange_active.linear() = R;
  out.T_flange_active.translation() = A.colPivHouseholderQr().solve(b);
  std::vector<Pose> bases;
  for (const AxisPoseRow& r : rows_) bases.push_back(r.pose * (flange(choice, r.axes) * out.T_flange_active).inverse());
  out.T_active_base = mean_pose(bases);
  return true;
}

/// The angle of a motion from one posture to another is the same in any frames. The zeros of the first and the last
/// axis are a turn of those frames.
std::vector<std::pair<Choice, AxisMapping>> MappingSearch::with_unknown_frames() const {
  struct Candidate {
    std::size_t base, wrist;
    Eigen::Matrix3d R;
  };
  const double slack = 2 * options_.rotation_tolerance;
  std::vector<Candidate> left;
  std::vector<std::pair<Choice, AxisMapping>> out;
  std::vector<Half> bases, wrists;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    bases = halves(rows_[i].axes, 0, 0);
    wrists = halves(rows_[i].axes, 3, 5);
    if (i == 0) {
      for (std::size_t a = 0; a < bases.size(); ++a)
        for (std::size_t b = 0; b < wrists.size(); ++b)
          left.push_back({a, b, bases[a].T.linear() * wrists[b].T.linear()});
      continue;
    }
    const double angle = angle_between(rows_.front().pose.linear(), rows_[i].pose.linear());
    const double most = std::cos(std::max(angle - slack, 0.0)),
                 least = std::cos(std::min(angle + slack, std::numbers::pi));
    std::erase_if(left, [&](const Candidate& c) {
      const double cosine = cosine_between(c.R, bases[c.base].T.linear() * wrists[c.wrist].T.linear());
      return cosine > most + 1e-12 || cosine < least - 1e-12;
    });
  }
  for (const Candidate& c : left) {
    const auto &f = bases[c.base].ways, &w = wrists[c.wrist].ways;
    const Choice choice = {f[0], f[1], f[2], w[0], w[1], w[2]};
    AxisMapping mapping;
    if (estimate_frames(choice, mapping) && fits(choice, mapping)) out.emplace_back(choice, mapping);
  }
  return out;
}

/// Whether two mappings give equal poses in postures that were not told, too.
bool are_equivalent(const AxisMapping& a, const AxisMapping& b, const robot::SensorModel& model) {
  constexpr double close = 1e-3;  // [m, rad], in frames that were estimated
  Eigen::VectorXd axes(6);
  for (int k = 1; k <= 4; ++k) {
    for (int i = 0; i < 6; ++i) axes[i] = std::fmod(1.7 * k + 0.9 * i * k, 2.0) - 1.0;
    const Pose A = a.T_active_base * model.arm.flange(a.axes.joints(axes)) * a.T_flange_active;
    const Pose B = b.T_active_base * model.arm.flange(b.axes.joints(axes)) * b.T_flange_active;
    const double slack_m = close + 4 * (a.position_misfit + b.position_misfit);
    const double slack_rad = close + 4 * (a.rotation_misfit + b.rotation_misfit);
    if ((A.translation() - B.translation()).norm() > slack_m || angle_between(A.linear(), B.linear()) > slack_rad)
      return false;
  }
  return true;
}

std::vector<std::string> unmoved_axes(const std::vector<AxisPoseRow>& rows, double least) {
  std::vector<std::string> out;
  for (Eigen::Index i = 0; i < 6; ++i) {
    double low = rows.front().axes[i], high = low;
    for (const AxisPoseRow& r : rows) low = std::min(low, r.axes[i]), high = std::max(high, r.axes[i]);
    if (high - low < least) out.push_back("A" + std::to_string(i + 1));
  }
  return out;
}

}  // namespace

void AxisMappingOptions::validate() const {
  require(position_tolerance > 0 && std::isfinite(position_tolerance), "position_tolerance: must be positive [m]");
  require(rotation_tolerance > 0 && rotation_tolerance < 0.5,
          "rotation_tolerance: must lie between 0 and 0.5 rad [rad]");
  require(min_motion > 0 && std::isfinite(min_motion), "min_motion: must be positive [rad]");
  require(min_rows >= 3 && min_rows <= static_cast<int>(most_postures), "min_rows: must lie between 3 and 12");
}

std::vector<AxisPoseRow> axis_pose_rows(const LinkObservations& observations, const TelegramLayout& layout) {
  TelegramLayout counted = layout;
  counted.axes.reset();
  const TelegramCodec codec(counted, Sender::Controller);
  const TelegramUnits units(counted);
  std::vector<AxisPoseRow> out;
  Telegram telegram;
  for (const Exchange& e : observations.exchanges) {
    if (codec.decode(e.telegram, telegram) != TelegramFault::None) continue;
    const ControllerState state = units.state(telegram);
    if (!state.tool || state.joints.size() < 6) return {};
    out.push_back({state.joints.head<6>(), *state.tool});
  }
  return out;
}

AxisMappingResult find_axis_mapping(const std::vector<AxisPoseRow>& rows, const robot::SensorModel& model,
                                    const AxisMappingOptions& options) {
  options.validate();
  model.validate();
  const auto revolute = [](const kinematics::DhJoint& j) { return j.type == kinematics::JointType::Revolute; };
  require(model.arm.joints.size() == 6 && std::ranges::all_of(model.arm.joints, revolute),
          "model.arm: expected six revolute joints");
  AxisMappingResult out;
  const std::vector<AxisPoseRow> postures = postures_of(rows);
  out.postures = static_cast<int>(postures.size());
  if (!postures.empty()) out.unmoved = unmoved_axes(postures, options.min_motion);
  if (out.postures < options.min_rows) return out;
  const MappingSearch search(postures, model, options);
  std::vector<std::pair<Choice, AxisMapping>> found;
  if (options.frames != MappingFrames::Unknown) found = search.with_known_frames();
  if (found.empty() && options.frames != MappingFrames::Known) {
    found = search.with_unknown_frames();
    out.frames_known = found.empty();
    if (!found.empty()) out.free_zeros = {"A1", "A6"};
  }
  std::ranges::stable_sort(found, {}, [](const auto& f) { return changes(f.first); });
  for (const auto& [choice, mapping] : found) out.mappings.push_back(mapping);
  if (found.empty()) {
    out.status = MappingStatus::NothingFits;
  } else if (!out.unmoved.empty()) {
    out.status = MappingStatus::NotMoved;
  } else {
    const bool alike = std::ranges::all_of(
        out.mappings, [&](const AxisMapping& m) { return are_equivalent(out.mappings.front(), m, model); });
    out.status = alike ? MappingStatus::Found : MappingStatus::Ambiguous;
  }
  return out;
}

}  // namespace kr5::rsi

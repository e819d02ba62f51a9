// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/posture_checks.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

#include "calibration/postures/device_fit.hpp"
#include "calibration/postures/measured_place.hpp"
#include "calibration/postures/row_order.hpp"

namespace kr5::calibration {
namespace {

constexpr std::size_t min_compared_places = 8;
constexpr double unit_tolerance = 0.05;  // relative difference of a scale from that of a unit

/// Postures of which a place was measured.
struct MeasuredRows {
  std::vector<int> row;  ///< Among all postures.
  std::vector<Pose> flanges;
  Eigen::Matrix3Xd places;

  MeasuredRows(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures) {
    places.resize(3, static_cast<Eigen::Index>(postures.size()));
    for (std::size_t i = 0; i < postures.size(); ++i) {
      const auto place = measured_place(postures[i]);
      if (!place) continue;
      places.col(static_cast<Eigen::Index>(row.size())) = *place;
      row.push_back(static_cast<int>(i));
      flanges.push_back(nominal.flange(postures[i].q));
    }
    places.conservativeResize(3, static_cast<Eigen::Index>(row.size()));
  }

  double misfit() const { return fit_device(flanges, places).misfit; }
  /// RMS distance of the places from their median.
  double spread() const {
    Eigen::Vector3d middle;
    for (int k = 0; k < 3; ++k) middle[k] = midpoint_median({places.row(k).begin(), places.row(k).end()});
    return std::sqrt((places.colwise() - middle).colwise().squaredNorm().mean());
  }
};

DeviceUnit device_unit(double scale) {
  for (const auto& [unit, factor] :
       {std::pair{DeviceUnit::Millimetre, 1e3}, {DeviceUnit::Centimetre, 1e2}, {DeviceUnit::Inch, 1 / 25.4e-3}})
    if (std::abs(scale / factor - 1) < unit_tolerance) return unit;
  return DeviceUnit::Unknown;
}

ScaledPlaces scaled_places(const MeasuredRows& rows) {
  const DeviceFit fit = fit_device(rows.flanges, rows.places, true);
  return {fit.scale, fit.scale_std, device_unit(fit.scale), fit.misfit};
}

MirroredPlaces mirrored_places(const MeasuredRows& rows) {
  const Eigen::Matrix3Xd mirrored = Eigen::Vector3d(1, 1, -1).asDiagonal() * rows.places;
  return {fit_device(rows.flanges, mirrored, true).misfit};
}

ShiftedPlaces shifted_rows(const MeasuredRows& rows, int shift) {
  const std::vector<Pose>& all = rows.flanges;
  const bool before = shift > 0;
  const std::vector<Pose> flanges(before ? all.begin() : all.begin() + 1, before ? all.end() - 1 : all.end());
  const auto n = static_cast<Eigen::Index>(flanges.size());
  const Eigen::Matrix3Xd places = before ? rows.places.rightCols(n) : rows.places.leftCols(n);
  return {shift, rows.row.front(), rows.row.back(), fit_device(flanges, places).misfit};
}

ReorderedRows reordered_rows(const MeasuredRows& rows) {
  const RowOrder order = match_rows(rows.flanges, rows.places);
  ReorderedRows out;
  out.misfit = order.misfit;
  for (std::size_t k = 0; k < rows.row.size(); ++k) {
    const auto other = static_cast<std::size_t>(order.posture[k]);
    if (other == k) continue;
    out.rows.push_back(rows.row[k]);
    out.belongs_to.push_back(rows.row[other]);
  }
  return out;
}

/// Keeps the explanation that leaves least.
class BestExplanation {
 public:
  explicit BestExplanation(PostureFindings& findings) : findings_(findings) {}

  template <class Finding>
  void consider(std::optional<Finding> PostureFindings::*member, const Finding& found) {
    if (!(found.misfit < misfit_)) return;
    misfit_ = found.misfit;
    clear();
    findings_.*member = found;
  }
  double misfit() const { return misfit_; }
  void clear() {
    findings_.scaled.reset(), findings_.mirrored.reset(), findings_.shifted.reset(), findings_.reordered.reset();
  }

 private:
  PostureFindings& findings_;
  double misfit_ = std::numeric_limits<double>::infinity();
};

/// What explains the misfit of the places, if anything does.
void explain_misfit(const MeasuredRows& rows, const PostureCheckOptions& options, PostureFindings& findings) {
  BestExplanation best(findings);
  const ScaledPlaces scaled = scaled_places(rows);
  if (std::abs(scaled.scale - 1) > options.scale_difference) best.consider(&PostureFindings::scaled, scaled);
  best.consider(&PostureFindings::mirrored, mirrored_places(rows));
  for (const int shift : {1, -1}) best.consider(&PostureFindings::shifted, shifted_rows(rows, shift));
  const double spread = rows.spread();
  const bool unrelated = findings.misfit > options.min_unrelated * spread;
  if (best.misfit() <= options.max_left * findings.misfit) return;
  best.clear();
  if (!unrelated) return;
  if (rows.row.size() <= static_cast<std::size_t>(options.max_matched)) {
    ReorderedRows reordered = reordered_rows(rows);
    if (reordered.misfit < options.max_left_reordered * findings.misfit) {
      findings.reordered = std::move(reordered);
      return;
    }
  }
  findings.unrelated = UnrelatedPlaces{rows.row.front(), rows.row.back(), spread};
}

}  // namespace

void PostureCheckOptions::validate() const {
  require(max_standing > 0, "max_standing must be positive [rad or m]");
  require(min_turn > 0, "min_turn must be positive [rad]");
  require(min_misfit >= 0, "min_misfit must not be negative [m]");
  require(max_left > 0 && max_left < 1, "max_left must lie between 0 and 1 [-]");
  require(min_unrelated > 0, "min_unrelated must be positive [-]");
  require(max_left_reordered > 0 && max_left_reordered < 1, "max_left_reordered must lie between 0 and 1 [-]");
  require(scale_difference >= 0, "scale_difference must not be negative [-]");
  require(max_matched >= 0, "max_matched must not be negative");
}

std::vector<StillJoint> find_still_joints(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                                          const PostureCheckOptions& options) {
  options.validate();
  for (std::size_t i = 0; i < postures.size(); ++i) check_joint_values(postures[i], i, nominal.joints.size());
  std::vector<StillJoint> out;
  for (std::size_t j = 0; !postures.empty() && j < nominal.joints.size(); ++j) {
    const auto value = [&](const ArmPosture& p) { return p.q[static_cast<Eigen::Index>(j)]; };
    const auto [low, high] = std::minmax_element(postures.begin(), postures.end(),
                                                 [&](const auto& a, const auto& b) { return value(a) < value(b); });
    const double range = value(*high) - value(*low);
    const bool moved = range >= options.max_standing;
    const bool turns = nominal.joints[j].type == kinematics::JointType::Revolute;
    if (!moved || (turns && range < options.min_turn)) out.push_back({static_cast<int>(j), range, moved});
  }
  return out;
}

PostureFindings check_postures(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                               const PostureCheckOptions& options) {
  PostureFindings out;
  out.still_joints = find_still_joints(nominal, postures, options);
  const MeasuredRows rows(nominal, postures);
  if (rows.row.size() < min_compared_places) return out;
  out.misfit = rows.misfit();
  if (out.misfit >= options.min_misfit) explain_misfit(rows, options, out);
  return out;
}

}  // namespace kr5::calibration

// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/scanner/scanner_causes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/Dense>
#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>

#include "calibration/scanner/scanner_start.hpp"

namespace kr5::calibration::scanner_problem {
namespace {

constexpr double degree = 57.29577951308232;
constexpr double min_turn = 0.05;        // spread of the orientations that determines a position [rad]
constexpr double shift_matters = 2e-4;   // distance below which a shifted list does no harm [m]
constexpr double shift_explains = 0.25;  // share of the distance that the right order leaves at most
constexpr double near_nominal = 0.35;    // of the rotation that a mistaken coordinate makes [rad]
constexpr double scale_matters = 0.02, scale_sigmas = 6.0;

std::string formatted(const char* format, double a, double b = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

/// The same with the pose of view i + by for view i.
double shifted_distance(const ScannerInput& input, int by) {
  std::vector<ScannerView> views;
  ScannerInput shifted{{}, input.targets, input.options, input.arm, {}, {}};
  const auto n = static_cast<int>(input.views.size());
  for (int i = 0; i < n; ++i) {
    if (i + by < 0 || i + by >= n) continue;
    const auto own = static_cast<std::size_t>(i), other = static_cast<std::size_t>(i + by);
    views.push_back(input.views[own]);
    views.back().q = input.views[other].q;
    shifted.target_of.push_back(input.target_of[own]);
    shifted.T_base_flange.push_back(input.T_base_flange[other]);
  }
  shifted.views = views;
  double least = std::numeric_limits<double>::infinity();
  for (const Pose& T : scanner_starts(shifted)) {
    ScannerSigmas sigmas;
    sigmas.position = sigmas.across = std::max(median_distance(shifted, T), 1e-5);
    ScannerProblem problem(shifted, sigmas, place_targets(shifted, T));
    if (shifted.arm) problem.fit.hold(problem.arm);
    problem.fit.solve({.max_iterations = 50, .loss = 2.0, .uncertainty = false});
    std::vector<double> sizes;
    for (std::size_t i = 0; i < views.size(); ++i) sizes.push_back(problem.distance(i));
    least = std::min(least, median(sizes));
  }
  return least;
}

void find_shift(const ScannerInput& input, ScannerResult& out) {
  std::vector<double> distances;
  for (const ScannerViewReport& view : out.views) distances.push_back(view.distance);
  const double now = median(distances);
  if (now < shift_matters || input.views.size() < 10) return;
  for (const int by : {1, -1}) {
    const double then = shifted_distance(input, by);
    if (then > shift_explains * now) continue;
    const ScannerCause cause{
        "shifted_list",
        formatted("one list is shifted: with the pose of the ", 0) + (by > 0 ? "next" : "previous") +
            formatted(" profile the median distance is %.3f mm instead of %.3f mm", 1e3 * then, 1e3 * now),
        "Pair the lists again, by number or by time."};
    out.fit.status = FitStatus::Degenerate;
    out.fit.message = cause.text + "; " + cause.remedy;
    out.causes = {cause};
    return;
  }
}

/// Coordinates that are mirrored or swapped look like a turned scanner, since y is zero; only a nominal pose tells.
void find_mistaken_axes(const ScannerInput& input, ScannerResult& out) {
  if (!input.options.T_flange_scanner) return;
  const Eigen::Matrix3d turned = input.options.T_flange_scanner->linear().transpose() * out.T_flange_scanner.linear();
  const struct {
    const char* cause;
    Eigen::Vector3d x, z;  // of the true scanner, where the file's X and Z point
    const char* text;
  } mistakes[] = {
      {"mirrored_x", -Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), "x counts the other way"},
      {"mirrored_z", Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitZ(), "z counts towards the scanner"},
      {"mirrored_x", -Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitZ(), "x and z both count the other way"},
      {"swapped_columns", Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), "x and z are swapped"}};
  for (const auto& mistake : mistakes) {
    Eigen::Matrix3d R;
    R << mistake.x, mistake.z.cross(mistake.x), mistake.z;
    if (log_rotation(R.transpose() * turned).norm() > near_nominal) continue;
    out.causes.push_back({mistake.cause,
                          std::string("the scanner is turned against its nominal pose as if ") + mistake.text,
                          "Look at the signs and the order of the columns of the profiles."});
  }
}

void find_scale(const ScannerInput& input, const std::vector<double>& weights, ScannerResult& out) {
  const auto scales = axis_scales(input, weights);
  if (!scales || !out.fit.usable()) return;
  for (int k = 0; k < 2; ++k) {
    const double off = scales->scale[k] - 1;
    if (std::abs(off) < std::max(scale_matters, scale_sigmas * scales->std[k])) continue;
    out.causes.push_back({"scale",
                          std::string(k ? "z" : "x") +
                              formatted(" of the profiles is scaled: multiplied by %.3f (± %.3f) they would agree",
                                        scales->scale[k], scales->std[k]),
                          "Look at the units and at the calibration of the scanner itself."});
  }
}

}  // namespace

std::optional<ScannerCause> missing_turn(const ScannerInput& input) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero(), spread = Eigen::Matrix3d::Zero();
  for (const Pose& T : input.T_base_flange) sum += T.linear();
  const Eigen::Matrix3d mean = nearest_rotation(sum);
  for (const Pose& T : input.T_base_flange) {
    const Eigen::Vector3d turn = log_rotation(mean.transpose() * T.linear());
    spread += turn * turn.transpose() / static_cast<double>(input.T_base_flange.size());
  }
  const SymmetricEigen eigen = symmetric_eigen(spread);
  if (std::sqrt(std::max(eigen.values[2], 0.0)) < min_turn)
    return ScannerCause{"same_orientation",
                        formatted("all poses have nearly the same orientation (spread %.2f deg)",
                                  degree * std::sqrt(std::max(eigen.values[2], 0.0))),
                        "turn the wrist by 20 deg or more about two axes"};
  if (std::sqrt(std::max(eigen.values[1], 0.0)) > min_turn) return std::nullopt;
  const Eigen::Vector3d axis = eigen.vectors.col(2);
  return ScannerCause{"one_axis",
                      formatted("the poses turn about one axis only, (%.2f, %.2f, ", axis.x(), axis.y()) +
                          formatted("%.2f) of the flange", axis.z()),
                      "add poses that tilt that axis by 20 deg or more"};
}

std::string missing_variety(const ScannerInput& input) {
  Eigen::Vector2d low = input.views[0].feature.points.col(0), high = low;
  for (const ScannerView& view : input.views)
    low = low.cwiseMin(view.feature.points.col(0)), high = high.cwiseMax(view.feature.points.col(0));
  if ((high - low).minCoeff() < 5e-3)
    return formatted(
        "the targets lie at nearly the same place of every profile (%.1f mm along x, %.1f mm along z): "
        "move them along the line and change the stand-off",
        1e3 * (high - low).x(), 1e3 * (high - low).y());
  return "take more profiles, from more directions and stand-offs";
}

void find_data_causes(const ScannerInput& input, const std::vector<double>& weights, ScannerResult& out) {
  find_shift(input, out);
  if (!out.fit.usable()) return;
  find_mistaken_axes(input, out);
  find_scale(input, weights, out);
}

}  // namespace kr5::calibration::scanner_problem

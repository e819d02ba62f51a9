// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_findings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kr5::vision::detail {
namespace {

constexpr int cell_rows = 8, cell_cols = 10;
constexpr double degree = 0.017453292519943295;
constexpr double useful_tilt = 10 * degree;  // below it perspective hardly shows
constexpr double alike_angle = 5 * degree;
constexpr double wanted_focal_std = 0.005;  // relative
constexpr double wanted_noise = 0.5;        // [px]; sharp corners of a flat board give 0.05 to 0.3
constexpr double wanted_cells = 0.6;

std::string format(const char* pattern, double a, double b = 0) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

/// Largest rectangle of empty cells: first row, first column, rows, columns.
Eigen::Vector4i largest_gap(const Eigen::MatrixXd& counts) {
  Eigen::Vector4i best = Eigen::Vector4i::Zero();
  for (int r = 0; r < counts.rows(); ++r)
    for (int c = 0; c < counts.cols(); ++c)
      for (int h = 1; r + h <= counts.rows(); ++h)
        for (int w = 1; c + w <= counts.cols() && counts.block(r, c, h, w).isZero(0); ++w)
          if (h * w > best[2] * best[3]) best = {r, c, h, w};
  return best;
}

/// Largest angle between the directions of the targets' normals of any two views used.
double normal_spread(const std::vector<CameraViewReport>& reports, const std::vector<bool>& used,
                     const TargetPlane& plane) {
  double spread = 0;
  for (std::size_t i = 0; i < used.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (!used[i] || !used[j]) continue;
      const Eigen::Vector3d a = reports[i].T_camera_target.linear() * plane.basis.col(2);
      const Eigen::Vector3d b = reports[j].T_camera_target.linear() * plane.basis.col(2);
      spread = std::max(spread, std::acos(std::clamp(a.dot(b), -1.0, 1.0)));
    }
  return spread;
}

using Findings = std::vector<CameraFinding>;

void find_bad_views(const CameraCalibration& result, Findings& out) {
  for (const CameraViewReport& v : result.views) {
    if (!v.outlier) continue;
    const bool mirrored = v.reason.starts_with("mirrored");
    out.push_back(
        {mirrored ? "mirrored_view" : "spoiling_view", v.name + ": " + v.reason + ".",
         mirrored ? "Check that the image is not flipped and that the points are numbered as in the others."
                  : "Check the image (blur, focus, a bent or partly visible board, another camera); take it again.",
         format("RMS %.3g px, probability for a sound view %.2g", v.rms_px, v.probability)});
  }
}

void find_thin_data(const std::vector<bool>& used, const TargetPlane& plane, const CameraCalibration& result,
                    Findings& out) {
  const auto views = std::count(used.begin(), used.end(), true);
  const std::string tilt_remedy = "Tilt the board by 20 to 45 degrees, in different directions.";
  if (plane.flat && views < 3) {
    out.push_back({"too_few_views", "A flat target needs at least 3 views.",
                   "Take 10 to 20 images; tilt the board, and move it into every corner of the image.",
                   format("%.0f usable of %.0f views", double(views), double(used.size())), true});
    return;
  }
  if (views == 0) out.push_back({"too_few_views", "No view can be used.", "See the message of each view.", "", true});
  if (!plane.flat || views == 0) return;
  const double spread = normal_spread(result.views, used, plane), tilt = result.coverage.tilt_max;
  if (spread < alike_angle && tilt >= useful_tilt)
    out.push_back({"views_alike", "All views show the board from the same direction.", tilt_remedy,
                   format("directions differ by at most %.1f deg", spread / degree), true});
  else if (tilt < useful_tilt)
    out.push_back({"fronto_parallel",
                   "The board was always nearly parallel to the image: focal length and distance "
                   "cannot be distinguished.",
                   tilt_remedy, format("largest tilt %.1f deg", tilt / degree), true});
}

/// Whether the same model with a flat target does worse on held-out views, where that was tried.
bool bent_for_sure(const CameraCalibration& result) {
  for (const CameraModelScore& flat : result.models)
    for (const CameraModelScore& own : result.models)
      if (own.chosen && flat.lens == own.lens && flat.square_pixels == own.square_pixels && !flat.bent_target)
        return own.bent_target && flat.excess - own.excess > flat.excess_std;
  return result.bent_target;
}

void find_focal_uncertainty(const CameraCalibration& result, Findings& out) {
  const double relative_std = std::sqrt(result.covariance(0, 0)) / std::max(result.camera.fx, 1e-9);
  if (result.fit.usable() && relative_std > wanted_focal_std)
    out.push_back({"uncertain", "The focal length is poorly known.",
                   "Take more images in which the board is nearer, more tilted, and fills the image.",
                   format("fx %.1f px known to %.2g %%", result.camera.fx, 100 * relative_std)});
  if (result.sigma_pixel > wanted_noise)
    out.push_back(
        {"noisy_corners", "The points scatter more than those of sharp images.",
         "Use a flat board, a steady camera, good light; check the focus, and that the board is the stated one.",
         format("%.2f px per axis", result.sigma_pixel)});
  if (result.dispersion > 1)
    out.push_back(
        {"views_disagree",
         "The views disagree more than the noise of their points allows; all uncertainties were inflated accordingly.",
         "Remove blurred images and check that the board is flat; the lens may need a model with more parameters.",
         format("%.1f times the squared difference expected", result.dispersion)});
  if (result.coverage.cells_hit < wanted_cells)
    out.push_back({"coverage", "Part of the image was never covered: the lens is not determined there.",
                   "Move the board there, and into the corners of the image.",
                   format("%.0f %% of the cells hit; largest empty rectangle %.0f %% of the image",
                          100 * result.coverage.cells_hit, 100 * result.coverage.largest_gap)});
  if (bent_for_sure(result))
    out.push_back({"bent_target", "The target is bent or stretched; this was estimated and corrected.",
                   "Glue the board to glass or aluminium; measure its squares along both sides.",
                   format("bow %.3f %%, stretch %.3f %% of half its size",
                          100 * result.target_shape.head<3>().cwiseAbs().maxCoeff(), 100 * result.target_shape[3])});
}

/// Severe where the two cannot be told apart and nothing else is wrong: what makes them alike comes first.
void find_second_minimum(const SecondCamera& second, CameraCalibration& result) {
  const bool undecided = second.minimum.probability >= fit::pipeline::undecided && result.fit.usable();
  if (undecided) result.fit.status = FitStatus::Degenerate;
  result.findings.push_back({"second_minimum", "Another focal length explains the views nearly as well.",
                             "Tilt the board by 20 to 45 degrees, in different directions, and take it nearer.",
                             format("fx %.1f px there: ", second.fx) + fit::pipeline::second_text(second.minimum),
                             undecided});
}

std::string summary(const CameraCalibration& result) {
  for (const CameraFinding& f : result.findings)
    if (f.severe) return f.text + " " + f.remedy;
  if (!result.fit.usable())
    return "the views do not determine the camera; tilt the board more and fill the image with it";
  return result.fit.status == FitStatus::Converged ? "converged" : "stopped before it converged";
}

}  // namespace

CameraCoverage coverage_of(std::span<const View> views, const std::vector<CameraViewReport>& reports, int width,
                           int height) {
  CameraCoverage out;
  out.counts = Eigen::MatrixXd::Zero(cell_rows, cell_cols);
  double near = 1e300, far = 0;
  out.tilt_min = 1e300;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (reports[i].outlier) continue;
    for (Eigen::Index k = 0; k < views[i].pixels.cols(); ++k) {
      const int c = int((views[i].pixels(0, k) + 0.5) / width * cell_cols);
      const int r = int((views[i].pixels(1, k) + 0.5) / height * cell_rows);
      out.counts(std::clamp(r, 0, cell_rows - 1), std::clamp(c, 0, cell_cols - 1)) += 1;
    }
    const double distance = reports[i].T_camera_target.translation().norm();
    near = std::min(near, distance), far = std::max(far, distance);
    out.tilt_min = std::min(out.tilt_min, reports[i].tilt);
    out.tilt_max = std::max(out.tilt_max, reports[i].tilt);
  }
  out.tilt_min = std::min(out.tilt_min, out.tilt_max);
  out.distance_ratio = near > 0 && far > 0 ? far / near : 1.0;
  out.cells_hit = double((out.counts.array() > 0).count()) / (cell_rows * cell_cols);
  const Eigen::Vector4i gap = largest_gap(out.counts);
  out.largest_gap = double(gap[2] * gap[3]) / (cell_rows * cell_cols);
  const double w = double(width) / cell_cols, h = double(height) / cell_rows;
  out.gap_region = {gap[1] * w - 0.5, gap[0] * h - 0.5, (gap[1] + gap[3]) * w - 0.5, (gap[0] + gap[2]) * h - 0.5};
  return out;
}

void add_findings(const std::vector<bool>& used, const TargetPlane& plane, const std::optional<SecondCamera>& second,
                  CameraCalibration& result) {
  find_thin_data(used, plane, result, result.findings);
  find_bad_views(result, result.findings);
  find_focal_uncertainty(result, result.findings);
  for (const CameraFinding& f : result.findings)
    if (f.severe) result.fit.status = FitStatus::Degenerate;
  if (second) find_second_minimum(*second, result);
  result.fit.message = summary(result);
}

}  // namespace kr5::vision::detail

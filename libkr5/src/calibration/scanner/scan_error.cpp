// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/scan_error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <kr5/calibration/profile_cloud.hpp>
#include <kr5/calibration/sphere_fit.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/inverse.hpp>

namespace kr5::calibration {
namespace {

constexpr double beyond_sphere = 1.1;  // half length of a pass, over the radius
constexpr double not_seen = std::numeric_limits<double>::quiet_NaN();

/// The arm along a straight pass; the first and the last pose lie outside the profiles, for the delay.
struct ScanPass {
  std::vector<double> t;  // [s]
  std::vector<Eigen::VectorXd> q;
  std::vector<Pose> T_base_flange;
};

/// Sets the effect of the scanner that has this parameter alone.
void set_scanner_effect(cell::Cell& cell, const std::string& parameter, double value) {
  for (const cell::Effect& row : cell::effect_catalogue())
    if (row.target == cell::EffectTarget::Laser && row.parameters.size() == 1 && row.parameters[0].name == parameter) {
      cell.effects.set(row.id, std::string(name_of(row.target)), parameter, value);
      return;
    }
  throw InvalidArgument("no effect of the scanner has the parameter " + parameter + " alone");
}

/// Sums of squares over passes.
struct ScanErrorSum {
  double squares = 0.0, centre = 0.0;

  ScanError mean(int passes) const { return {std::sqrt(squares / passes), std::sqrt(centre / passes)}; }
};

/// The passes of one study.
class ScanStudy {
 public:
  ScanStudy(const cell::Cell& cell, const cell::Simulator& simulator, const ScanErrorOptions& options)
      : cell_(cell), simulator_(simulator), options_(options), random_(options.seed), real_(cell) {
    require(cell.laser && cell.laser->target && cell::T_flange_scanner(cell),
            "the cell has no laser with a mount and a target");
    require(cell.robot.limits.has_value(), "the cell states no robot.limits, within which postures are chosen");
    set_scanner_effect(real_, "bias", options.bias);
    set_scanner_effect(real_, "lag", options.delay);
    real_.validate();
    T_flange_scanner_ = *cell::T_flange_scanner(cell);
  }

  ScanErrorResult run(double stand_off, double speed) {
    ScanErrorResult out;
    ScanErrorSum stamped, synchronised;
    for (int k = 0; k < options_.passes; ++k) {
      const ScanPass pass = make_pass(stand_off, speed, 2 * std::numbers::pi * k / options_.passes);
      const std::vector<TimedProfile> profiles = scan(pass, speed);
      for (const auto& [delay, sum] : {std::pair(0.0, &stamped), std::pair(options_.delay, &synchronised)}) {
        const FitReport fit = add_error(pass, profiles, delay, *sum);
        if (!fit.usable()) {
          out.fit.message = "pass " + std::to_string(k + 1) + ": " + fit.message;
          return out;
        }
        out.fit.iterations += fit.iterations;
        out.fit.final_rms = std::max(out.fit.final_rms, fit.final_rms);
      }
    }
    out.fit.status = FitStatus::Converged;
    out.fit.message = "the sphere was found in every pass";
    out.as_stamped = stamped.mean(options_.passes);
    out.synchronised = synchronised.mean(options_.passes);
    return out;
  }

 private:
  /// A straight pass along Y of the scanner, looking down.
  ScanPass make_pass(double stand_off, double speed, double azimuth) const {
    const cell::ScannerTarget& target = *cell_.laser->target;
    Pose T_base_scanner = Pose::Identity();
    T_base_scanner.linear() =
        exp_rotation(azimuth * Eigen::Vector3d::UnitZ()) * Eigen::Vector3d(1, -1, -1).asDiagonal();
    const Eigen::Vector3d middle = target.sphere + (stand_off + target.radius) * Eigen::Vector3d::UnitZ();
    const double half = beyond_sphere * target.radius, step = 2 * half / (options_.lines - 1);
    const double ahead = step * std::max(1.0, std::ceil(speed * std::abs(options_.delay) / step));
    const kinematics::DhChain chain = cell::nominal_chain(cell_);
    kinematics::InverseOptions inverse{.lower = cell_.robot.limits->lower, .upper = cell_.robot.limits->upper};
    ScanPass out;
    for (int line = -1; line <= options_.lines; ++line) {
      const double along = line < 0 ? -half - ahead : line == options_.lines ? half + ahead : -half + line * step;
      T_base_scanner.translation() = middle + along * T_base_scanner.linear().col(1);
      inverse.near = posture(chain, T_base_scanner * T_flange_scanner_.inverse(), inverse, stand_off);
      out.q.push_back(inverse.near);
      out.T_base_flange.push_back(chain.flange(inverse.near));
      out.t.push_back((along + half + ahead) / speed);
    }
    return out;
  }

  static Eigen::VectorXd posture(const kinematics::DhChain& chain, const Pose& T_base_flange,
                                 const kinematics::InverseOptions& options, double stand_off) {
    if (const auto found = kinematics::inverse_kinematics(chain, T_base_flange, options).nearest()) return *found;
    throw InvalidArgument("the arm does not reach a pass at a stand-off of " +
                          std::to_string(std::lround(1e3 * stand_off)) + " mm; move the target");
  }

  /// What the scanner shows of the sphere in a pass; NaN beside it.
  std::vector<TimedProfile> scan(const ScanPass& pass, double speed) {
    const Eigen::Index count = options_.points;
    const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(count, -options_.width / 2, options_.width / 2);
    const io::Table shown = simulator_.predict(real_, experiment(pass, x, speed));
    const Eigen::VectorXd z = shown.column("z"), sphere = shown.column("sphere");
    std::vector<TimedProfile> out;
    for (int line = 0; line < options_.lines; ++line) {
      TimedProfile& at = out.emplace_back();
      at.t = pass.t[static_cast<std::size_t>(line) + 1];
      at.profile.x = x;
      at.profile.z = z.segment(line * count, count) + random_.normal_vector(count, cell_.noise.laser);
      at.profile.z = (sphere.segment(line * count, count).array() > 0).select(at.profile.z, not_seen);
    }
    return out;
  }

  cell::Experiment experiment(const ScanPass& pass, const Eigen::VectorXd& x, double speed) const {
    const int joints = cell_.robot.joints();
    cell::Experiment out{.name = "scan", .kind = cell::Kind::Scan, .file = "scan.csv"};
    out.data.columns = {"line", "t", "speed"};
    for (int j = 1; j <= joints; ++j) out.data.columns.push_back("q" + std::to_string(j));
    out.data.columns.push_back("x");
    out.data.values.resize(options_.lines * x.size(), joints + 4);
    for (int line = 0; line < options_.lines; ++line) {
      const std::size_t pose = static_cast<std::size_t>(line) + 1;
      Eigen::RowVectorXd of_line(joints + 3);
      of_line << line + 1, pass.t[pose], speed, pass.q[pose].transpose();
      auto rows = out.data.values.middleRows(line * x.size(), x.size());
      rows.leftCols(joints + 3).rowwise() = of_line;
      rows.col(joints + 3) = x;
    }
    return out;
  }

  /// Adds the errors of the cloud of one pass.
  FitReport add_error(const ScanPass& pass, const std::vector<TimedProfile>& profiles, double delay,
                      ScanErrorSum& sum) const {
    const cell::ScannerTarget& target = *cell_.laser->target;
    const ProfileCloudOptions all{.delay = delay, .max_gap = std::numeric_limits<double>::infinity()};
    const ProfileCloud cloud = profiles_to_cloud(profiles, pass.t, pass.T_base_flange, T_flange_scanner_, all);
    const SphereFit found = fit_sphere(cloud.points, target.radius, target.sphere);
    if (!found.fit.usable()) return found.fit;
    const auto distance = (cloud.points.colwise() - target.sphere).colwise().norm();
    sum.squares += (distance.array() - target.radius).square().mean();
    sum.centre += (found.centre - target.sphere).squaredNorm();
    return found.fit;
  }

  const cell::Cell& cell_;
  const cell::Simulator& simulator_;
  const ScanErrorOptions& options_;
  Random random_;
  cell::Cell real_;  // with the bias and the delay
  Pose T_flange_scanner_ = Pose::Identity();
};

}  // namespace

void ScanErrorOptions::validate() const {
  require(std::isfinite(bias), "bias must be finite [m]");
  require(std::isfinite(delay), "delay must be finite [s]");
  require(passes >= 1, "passes must be at least 1");
  require(lines >= 2, "lines must be at least 2");
  require(points >= 2, "points must be at least 2");
  require(width > 0 && std::isfinite(width), "width must be positive [m]");
}

ScanErrorResult simulate_scan_error(const cell::Cell& cell, const cell::Simulator& simulator, double stand_off,
                                    double speed, const ScanErrorOptions& options) {
  options.validate();
  require(stand_off > 0 && std::isfinite(stand_off), "stand_off must be positive [m]");
  require(speed > 0 && std::isfinite(speed), "speed must be positive [m/s]");
  return ScanStudy(cell, simulator, options).run(stand_off, speed);
}

}  // namespace kr5::calibration

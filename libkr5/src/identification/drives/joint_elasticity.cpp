// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/joint_elasticity.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/log/residual_correlation.hpp"
#include "identification/log/runs.hpp"
#include "identification/log/standard_deviation.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr Index fewest_readings = 10;
constexpr double min_reliability = 0.5;  // share of the moment of the torques that is no noise, below which nothing
                                         // is estimated: the method is one of small corrections
constexpr double min_spread = 1e-6;      // of torques; less is what rounding leaves of none [N m or N]
constexpr double side_noise = 4.0;       // standard deviations of the torque that tell its sign

/// Readings of one joint, and which of them follow one another.
struct SpringRows {
  VectorXd lead, torque, link;
  std::vector<physics::RowRange> runs;
  double least = 0.0;                         ///< Torques below it are left out [N m or N].
  double edge_above = 0.0, edge_below = 0.0;  ///< Readings per torque at `least` and at its negative [1/(N m)].
};

/// Estimate with noise in the torque. Columns: one, torque, with a play half its sign, and on demand the link angle.
struct SpringFit {
  bool determined = false;
  VectorXd values;
  MatrixXd covariance;
  double dof = 1.0, noise = 0.0, reliability = 0.0, spread = 0.0;

  /// Of the values, for a parameter alone.
  double std_of(Index k) const {
    const auto n = static_cast<double>(values.size());
    return std::sqrt(covariance(k, k) * uncertainty::covariance_inflation(1.0, dof) /
                     uncertainty::covariance_inflation(n, dof));
  }
};

MatrixXd spring_columns(const SpringRows& rows, bool play, bool with_link) {
  MatrixXd out(rows.torque.size(), 2 + play + with_link);
  out.col(0).setOnes();
  out.col(1) = rows.torque;
  if (play) out.col(2) = 0.5 * rows.torque.cwiseSign();
  if (with_link) out.rightCols(1) = rows.link;
  return out;
}

/// Expected products of the columns with the noise u of the torque, in units of its variance. Of a reading with the
/// torque x, u is -p'(x) / p(x) in the mean (Tweedie), p the density of the readings; over all readings that makes 1 a
/// reading for the torque, and by parts the terms of the edges where readings are left out by their torque.
VectorXd noise_products(const SpringRows& rows, Index columns, bool play) {
  VectorXd out = VectorXd::Zero(columns);
  const double edges = rows.edge_above + rows.edge_below;
  out[0] = rows.edge_above - rows.edge_below;
  out[1] = static_cast<double>(rows.torque.size()) + rows.least * edges;
  if (play) out[2] = 0.5 * edges;
  return out;
}

SpringFit fit_spring(const SpringRows& rows, double torque_noise, bool play, bool with_link = false) {
  const MatrixXd J = spring_columns(rows, play, with_link);
  const auto count = static_cast<double>(J.rows());
  const MatrixXd moments = J.transpose() * J;
  const VectorXd scale = moments.diagonal().cwiseSqrt().cwiseInverse();
  SpringFit out;
  if (!scale.allFinite()) return out;
  const MatrixXd scaled = scale.asDiagonal() * moments * scale.asDiagonal();
  const MatrixXd inverse = scaled.ldlt().solve(MatrixXd::Identity(J.cols(), J.cols()));
  const double own = 1.0 / (inverse(1, 1) * scale[1] * scale[1]);  // what no other column explains of the torque
  if (!(own > std::max(1e-12 * moments(1, 1), count * min_spread * min_spread))) return out;
  const VectorXd products = torque_noise * torque_noise * noise_products(rows, J.cols(), play);
  const double taken = products[1];
  out.reliability = (own - taken) / own;
  out.spread = std::sqrt(std::max(own - taken, 0.0) / count);
  if (out.reliability < min_reliability) return out;
  MatrixXd corrected = moments;
  corrected.col(1) -= products;
  const MatrixXd back =
      scale.asDiagonal() * MatrixXd(scale.asDiagonal() * corrected * scale.asDiagonal()).inverse() * scale.asDiagonal();
  out.values = back * (J.transpose() * rows.lead);
  const CorrelatedCovariance plain = correlated_covariance(J, rows.lead - J * out.values, rows.runs);
  if (plain.covariance.size() == 0) return out;
  // Fuller 1987, theorem 1.2.1: beside the residuals, what the noise of the torques leaves in their moment.
  const MatrixXd widened = back * moments;
  const double moment_noise = out.values[1] * torque_noise * torque_noise;
  out.covariance = widened * plain.covariance * widened.transpose() +
                   count * moment_noise * moment_noise * back.col(1) * back.col(1).transpose();
  out.dof = std::max(1.0, (count - static_cast<double>(J.cols())) / std::max(plain.inflation, 1.0));
  out.noise = std::sqrt(plain.variance);
  out.determined = true;
  return out;
}

/// The readings whose torque is greater than `least` (0: all); runs end where one is left out.
SpringRows rows_above(const ElasticityReadings& readings, Index joint, double least) {
  std::vector<Index> kept;
  SpringRows out;
  out.least = least;
  const double window = 0.5 * least;  // about the edges
  for (const physics::RowRange& run : runs_of(readings.run_starts, readings.motor.rows()))
    for (Index k = run.first; k < run.first + run.size(); ++k) {
      const double lead = readings.motor(k, joint) - readings.link(k, joint), torque = readings.torque(k, joint);
      if (std::isnan(lead) || std::isnan(torque)) continue;
      if (std::abs(torque - least) < window) out.edge_above += 0.5 / window;
      if (std::abs(torque + least) < window) out.edge_below += 0.5 / window;
      if (std::abs(torque) < least) continue;
      const auto at = static_cast<Index>(kept.size());
      const bool follows = !kept.empty() && kept.back() == k - 1 && k > run.first;
      if (!follows) out.runs.push_back({at, at});
      ++out.runs.back().last;
      kept.push_back(k);
    }
  out.lead = (readings.motor.col(joint) - readings.link.col(joint))(kept);
  out.torque = readings.torque.col(joint)(kept);
  out.link = readings.link.col(joint)(kept);
  return out;
}

void require_joint_side(const SpringRows& rows, int joint) {
  constexpr double max_lead = 0.1, max_share = 0.1;  // [rad or m], of the motion
  const double lead = standard_deviation(rows.lead);
  require(lead < max_lead || lead < max_share * standard_deviation(rows.link),
          "motor: joint " + std::to_string(joint) + " differs from link by " + short_number(lead) +
              " (standard deviation), expected a deflection: angles over the gear ratio, both in rad or m");
}

void describe(JointSpring& out, const SpringFit& fit, double significance) {
  out.compliance = fit.values[1];
  out.offset = fit.values[0];
  out.compliance_std = fit.std_of(1);
  out.offset_std = fit.std_of(0);
  if (fit.values.size() > 2) out.gap = fit.values[2], out.gap_std = fit.std_of(2);
  out.covariance = fit.covariance;
  out.noise = fit.noise;
  const double reach = uncertainty::student_factor(fit.dof) * out.compliance_std;
  out.stiffness_low = out.compliance + reach > 0 ? 1 / (out.compliance + reach) : infinite;
  out.stiffness_high = out.compliance - reach > 0 ? 1 / (out.compliance - reach) : infinite;
  const double shown = uncertainty::student_factor(fit.dof, 1 - 2 * significance) * out.compliance_std;
  require(out.compliance > -2 * shown, "torque: joint " + std::to_string(out.joint) +
                                           " deflects against its torque: its sign is reversed, or motor and link are "
                                           "exchanged");
  out.told = out.compliance > shown;
  out.stiffness = out.told ? 1 / out.compliance : infinite;
  out.message = out.told ? "stiffness determined"
                         : "compliance not distinguishable from 0; the joint is stiffer than stiffness_low";
}

/// What the lead says of the gear ratio, by which the motor angles were divided: a part of it that grows with the
/// angle.
std::string ratio_warning(const SpringRows& rows, double noise, bool play) {
  constexpr double false_alarm = 1e-3;
  const SpringFit fit = fit_spring(rows, noise, play, true);
  const Index last = fit.values.size() - 1;
  if (!fit.determined ||
      std::abs(fit.values[last]) < uncertainty::student_factor(fit.dof, 1 - false_alarm) * fit.std_of(last))
    return "";
  return "; motor minus link angle grows with the angle by " + short_number(fit.values[last]) +
         ", which is no spring: check the gear ratio";
}

JointSpring spring_of(const ElasticityReadings& readings, Index joint, const ElasticityOptions& options) {
  JointSpring out;
  out.joint = static_cast<int>(joint) + 1;
  out.stiffness = out.stiffness_high = infinite;
  const VectorXd& noises = options.torque_noise;
  const double noise = noises.size() == 0 ? 0.0 : noises[noises.size() == 1 ? 0 : joint];
  SpringRows rows = rows_above(readings, joint, 0.0);
  out.readings = static_cast<int>(rows.lead.size());
  if (rows.lead.size() < fewest_readings) {
    out.message =
        "found " + std::to_string(rows.lead.size()) + " readings, expected at least " + std::to_string(fewest_readings);
    return out;
  }
  require_joint_side(rows, out.joint);
  SpringFit fit = fit_spring(rows, noise, false);
  std::string note;
  if (options.play) {
    SpringRows sure = rows_above(readings, joint, std::max(options.side_torque, side_noise * noise));
    const auto positive = (sure.torque.array() > 0).count();
    if (std::min<Index>(positive, sure.torque.size() - positive) < fewest_readings / 2) {
      note = "; loads of both signs are needed to distinguish free play from the offset";
    } else if (const SpringFit with = fit_spring(sure, noise, true);
               with.determined &&
               with.values[2] >
                   uncertainty::student_factor(with.dof, 1 - 2 * options.play_false_alarm) * with.std_of(2)) {
      fit = with;
      rows = std::move(sure);
    }
  }
  out.readings = static_cast<int>(rows.lead.size());
  out.torque_spread = fit.spread;
  out.attenuation = fit.reliability;
  if (fit.determined) {
    describe(out, fit, options.significance);
    note += ratio_warning(rows, noise, fit.values.size() > 2);
  } else {
    out.message = "the torques change too little: their spread is " + short_number(fit.spread) +
                  " N m or N beside noise of " + short_number(noise);
  }
  out.message += note;
  out.doubtful = !out.told || !note.empty();
  return out;
}

}  // namespace

void ElasticityOptions::validate() const {
  require(torque_noise.size() == 0 || (torque_noise.allFinite() && torque_noise.minCoeff() >= 0),
          "torque_noise must not be negative [N m or N]");
  require(play_false_alarm > 0 && play_false_alarm < 0.5, "play_false_alarm: between 0 and 0.5 [-]");
  require(significance > 0 && significance < 0.5, "significance: between 0 and 0.5 [-]");
  require(side_torque >= 0 && std::isfinite(side_torque), "side_torque must not be negative [N m or N]");
}

ElasticityResult identify_elasticity(const ElasticityReadings& readings, const ElasticityOptions& options) {
  options.validate();
  const Index rows = readings.motor.rows(), n = readings.motor.cols();
  require(rows > 0 && n > 0, "motor: no reading of any joint");
  for (const auto& [name, values] : {std::pair{"motor", &readings.motor}, std::pair{"link", &readings.link},
                                     std::pair{"torque", &readings.torque}}) {
    require(values->rows() == rows && values->cols() == n,
            std::string(name) + ": expected " + std::to_string(rows) + " x " + std::to_string(n) + " numbers, found " +
                std::to_string(values->rows()) + " x " + std::to_string(values->cols()));
    require(!values->array().isInf().any(), std::string(name) + ": infinite numbers; NaN where nothing was read");
  }
  require(options.torque_noise.size() <= 1 || options.torque_noise.size() == n,
          "torque_noise: found " + std::to_string(options.torque_noise.size()) + " values, expected 1 or " +
              std::to_string(n) + " [N m or N]");
  require_run_starts(readings.run_starts, rows);
  ElasticityResult out;
  for (Index j = 0; j < n; ++j) out.joints.push_back(spring_of(readings, j, options));
  const auto told = std::count_if(out.joints.begin(), out.joints.end(), [](const JointSpring& s) { return s.told; });
  out.fit.status = told > 0 ? FitStatus::Converged : FitStatus::Degenerate;
  out.fit.message = "stiffness of " + std::to_string(told) + " of " + std::to_string(n) + " joints determined";
  for (const JointSpring& s : out.joints)
    if (!s.told) out.fit.message += "; joint " + std::to_string(s.joint) + ": " + s.message;
  return out;
}

}  // namespace kr5::identification

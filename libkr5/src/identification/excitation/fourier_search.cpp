// SPDX-License-Identifier: BSD-3-Clause
#include "identification/excitation/fourier_search.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/random.hpp>

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Harmonics of one joint.
struct JointCurve {
  double offset = 0.0;
  VectorXd sine, cosine;
};

/// Draws curves of single joints that keep the limits of the joint at every time.
class CurveSource {
 public:
  CurveSource(const MotionLimits& limits, const ExcitationOptions& options)
      : limits_(limits), options_(options), w_(2 * M_PI / options.duration) {
    const Index H = options.harmonics, steps = 32 * H;
    step_ = options.duration / static_cast<double>(steps);
    sin_.resize(steps, H);
    cos_.resize(steps, H);
    rate_ = w_ * VectorXd::LinSpaced(H, 1.0, static_cast<double>(H));
    for (Index k = 0; k < steps; ++k)
      for (Index l = 0; l < H; ++l) {
        sin_(k, l) = std::sin(rate_[l] * step_ * static_cast<double>(k));
        cos_(k, l) = std::cos(rate_[l] * step_ * static_cast<double>(k));
      }
  }

  /// @param part Of the size that the limits allow. @param middle About which the curve lies, as far as it may.
  JointCurve draw(Index joint, double part, double middle, Random& random) const {
    const Index H = rate_.size();
    JointCurve out{0.0, random.normal_vector(H).cwiseQuotient(rate_), random.normal_vector(H).cwiseQuotient(rate_)};
    rest_at_start(out);
    scale(out, joint, part * random.uniform(0.4, 1.0), true);
    out.offset = middle;
    place(out, joint);
    return out;
  }

  /// A curve near another.
  JointCurve near(const JointCurve& from, Index joint, Random& random) const {
    const double size = random.uniform(0.02, 0.5) * std::hypot(from.sine.norm(), from.cosine.norm());
    JointCurve out = from;
    out.sine += size * random.normal_vector(rate_.size()).cwiseQuotient(rate_) * rate_[0];
    out.cosine += size * random.normal_vector(rate_.size()).cwiseQuotient(rate_) * rate_[0];
    rest_at_start(out);
    scale(out, joint, 1.0, random.integer(2) == 0);
    out.offset += random.normal(0.1) * (limits_.upper[joint] - limits_.lower[joint]);
    place(out, joint);
    return out;
  }

 private:
  /// Takes out what has a speed or an acceleration at time 0.
  void rest_at_start(JointCurve& c) const {
    const VectorXd squared = rate_.cwiseAbs2();
    c.sine -= rate_ * (rate_.dot(c.sine) / rate_.squaredNorm());
    c.cosine -= squared * (squared.dot(c.cosine) / squared.squaredNorm());
  }

  /// Greatest |value| of a curve between samples: a parabola through its samples misses less than h^2/8 |curvature|.
  double between(const JointCurve& c, int derivative) const {
    return step_ * step_ / 8 *
           (c.sine.cwiseAbs() + c.cosine.cwiseAbs()).dot(rate_.array().pow(derivative + 2).matrix());
  }

  /// Makes the curve as large as its limits allow, times `part`; smaller ones only grow on demand.
  void scale(JointCurve& c, Index joint, double part, bool grow) const {
    const VectorXd x = sin_ * c.sine + cos_ * c.cosine;
    const VectorXd v = cos_ * rate_.cwiseProduct(c.sine) - sin_ * rate_.cwiseProduct(c.cosine);
    const VectorXd squared = rate_.cwiseAbs2();
    const VectorXd a = sin_ * squared.cwiseProduct(c.sine) + cos_ * squared.cwiseProduct(c.cosine);
    const double slack = between(c, 0);
    double most = limits_.speed[joint] / (v.cwiseAbs().maxCoeff() + between(c, 1));
    most = std::min(most, limits_.acceleration[joint] / (a.cwiseAbs().maxCoeff() + between(c, 2)));
    if (options_.start.size() > 0) {
      const double start = options_.start[joint];
      most = std::min(most, (limits_.upper[joint] - start) / (x.maxCoeff() - x[0] + slack));
      most = std::min(most, (start - limits_.lower[joint]) / (x[0] - x.minCoeff() + slack));
    } else {
      most = std::min(most, (limits_.upper[joint] - limits_.lower[joint]) / (x.maxCoeff() - x.minCoeff() + 2 * slack));
    }
    const double factor = grow ? part * most : std::min(1.0, most);
    c.sine *= factor;
    c.cosine *= factor;
  }

  /// Moves the curve into the range, or to the start.
  void place(JointCurve& c, Index joint) const {
    const VectorXd x = sin_ * c.sine + cos_ * c.cosine;
    const double slack = between(c, 0);
    c.offset = options_.start.size() > 0 ? options_.start[joint] - x[0]
                                         : std::clamp(c.offset, limits_.lower[joint] - x.minCoeff() + slack,
                                                      std::max(limits_.lower[joint] - x.minCoeff() + slack,
                                                               limits_.upper[joint] - x.maxCoeff() - slack));
  }

  const MotionLimits& limits_;
  const ExcitationOptions& options_;
  double w_, step_ = 0.0;
  VectorXd rate_;
  MatrixXd sin_, cos_;
};

void set_curve(ExcitationMotion& motion, Index joint, const JointCurve& c) {
  motion.offset[joint] = c.offset;
  motion.sine.row(joint) = c.sine.transpose();
  motion.cosine.row(joint) = c.cosine.transpose();
}

JointCurve curve_of(const ExcitationMotion& motion, Index joint) {
  return {motion.offset[joint], motion.sine.row(joint).transpose(), motion.cosine.row(joint).transpose()};
}

}  // namespace

ExcitationSearch search_fourier(ExcitationProblem& problem, const ExcitationOptions& options) {
  const Index n = problem.joints(), H = options.harmonics;
  const CurveSource source(problem.limits(), options);
  const Index looks = std::clamp<Index>(40 * H, 100, 400);  // in one period, the end of which is its start
  const VectorXd looked_at = VectorXd::LinSpaced(looks + 1, 0.0, options.duration).head(looks);
  Random random(options.seed);
  ExcitationSearch out;
  double best = std::numeric_limits<double>::infinity();
  const auto consider = [&](const ExcitationMotion& motion) {
    const MatrixXd mean = problem.information(motion.states(looked_at)) / static_cast<double>(looked_at.size());
    const double value = problem.value(mean);
    if (!(value < best)) return false;
    std::string objection = problem.objection(motion.sampled(considered_interval));
    if (!objection.empty()) {
      if (!std::isfinite(best)) out.objection = std::move(objection);
      return false;
    }
    best = value;
    out.motion = motion;
    out.objection.clear();
    out.condition_after.push_back(problem.shown_condition(mean));
    return true;
  };
  const int attempts = 20 * options.starts;  // an arm close to what it must avoid needs more
  double part = 1.0;                         // smaller motions stay clear of it
  const int steps = attempts + options.exchanges;
  int kept = 0;
  for (int k = 0; k < attempts && (kept < options.starts || !std::isfinite(best)); ++k) {
    ExcitationMotion motion{
        .period = options.duration, .offset = VectorXd(n), .sine = MatrixXd(n, H), .cosine = MatrixXd(n, H)};
    const VectorXd middle = problem.clear_posture(random);
    for (Index j = 0; j < n; ++j) set_curve(motion, j, source.draw(j, part, middle[j], random));
    if (consider(motion) || std::isfinite(best))
      ++kept;
    else
      part = std::max(0.97 * part, 0.02);
    if (options.progress) options.progress(static_cast<double>(k) / steps);
  }
  if (!std::isfinite(best)) return out;
  for (int k = 0; k < options.exchanges; ++k) {
    const Index joint = k % n;
    const double middle = random.uniform(problem.limits().lower[joint], problem.limits().upper[joint]);
    ExcitationMotion motion = out.motion;
    set_curve(motion, joint,
              random.integer(4) == 0 ? source.draw(joint, 1.0, middle, random)
                                     : source.near(curve_of(motion, joint), joint, random));
    out.exchanges += consider(motion);
    if (options.progress) options.progress(static_cast<double>(attempts + k + 1) / steps);
  }
  return out;
}

}  // namespace kr5::identification

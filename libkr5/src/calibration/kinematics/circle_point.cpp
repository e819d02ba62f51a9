// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/circle_point.hpp>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <numbers>
#include <numeric>
#include <sstream>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/problem.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

using Eigen::Vector3d;

constexpr double min_moved = 5.0;      // first over third singular value below which the joint did not move
constexpr double min_curved = 3.0;     // second over third below which the arc is no more than a line
constexpr double sound_samples = 0.7;  // at least this part of the samples stays in the fit
constexpr double degree = std::numbers::pi / 180;

std::string in_degrees(double angle) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << angle / degree << " deg";
  return text.str();
}

/// A first axis, before the fit.
struct AxisStart {
  Vector3d centre = Vector3d::Zero(), direction = Vector3d::UnitZ();
  std::vector<double> angles;
  double quality = 0.0;
  std::string degenerate;
};

bool is_seen(const JointSample& sample, Eigen::Index c) {
  return c < sample.points.cols() && sample.points.col(c).allFinite();
}

Eigen::Index marker_count(std::span<const JointSample> samples) {
  Eigen::Index out = 0;
  for (const JointSample& sample : samples) out = std::max(out, sample.points.cols());
  return out;
}

/// Points of one marker, and the samples they are of.
std::pair<Eigen::Matrix3Xd, std::vector<std::size_t>> marker_trace(std::span<const JointSample> samples,
                                                                   Eigen::Index c) {
  std::vector<std::size_t> index;
  for (std::size_t k = 0; k < samples.size(); ++k)
    if (is_seen(samples[k], c)) index.push_back(k);
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(index.size()));
  for (std::size_t k = 0; k < index.size(); ++k)
    points.col(static_cast<Eigen::Index>(k)) = samples[index[k]].points.col(c);
  return {points, index};
}

struct Plane {
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d V = Eigen::Matrix3d::Identity();  ///< Principal directions, the widest first.
  Vector3d sigma = Vector3d::Zero();                ///< Singular values.
};

Plane plane_of(const Eigen::Matrix3Xd& points) {
  Plane out;
  out.mean = points.rowwise().mean();
  const Eigen::Matrix3Xd N = points.colwise() - out.mean;
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(N * N.transpose()));
  for (int k = 0; k < 3; ++k) {
    out.V.col(k) = eigen.vectors.col(2 - k);
    out.sigma[k] = std::sqrt(std::max(eigen.values[2 - k], 0.0));
  }
  return out;
}

/// Circle in its plane by linear least squares: 2 x c1 + 2 y c2 + k3 = x^2 + y^2 (eq. 4.4-4.6).
Vector3d circle_centre(const Eigen::Matrix3Xd& points, const Plane& plane) {
  const Eigen::Matrix2Xd R = plane.V.leftCols<2>().transpose() * (points.colwise() - plane.mean);
  Eigen::MatrixXd A(points.cols(), 3);
  A << 2 * R.transpose(), Eigen::VectorXd::Ones(points.cols());
  const Eigen::Vector3d c = least_squares(A, R.colwise().squaredNorm().transpose().eval());
  return plane.mean + plane.V.leftCols<2>() * c.head<2>();
}

double unwrapped(double angle, double near) {
  return angle + 2 * std::numbers::pi * std::round((near - angle) / (2 * std::numbers::pi));
}

/// By the marker with the widest trace; joint values of samples that do not show it stay between their
/// neighbours'.
AxisStart start_from_points(std::span<const JointSample> samples) {
  AxisStart out;
  Eigen::Index best = -1;
  double widest = 0.0;
  Plane plane;
  for (Eigen::Index c = 0; c < marker_count(samples); ++c) {
    const auto [points, index] = marker_trace(samples, c);
    if (points.cols() < 4) continue;
    const Plane other = plane_of(points);
    const double width = other.sigma[1] / std::sqrt(points.cols());
    if (best < 0 || width > widest) best = c, widest = width, plane = other;
  }
  if (best < 0) {
    out.degenerate = "no point was seen in four samples";
    return out;
  }
  const auto [points, index] = marker_trace(samples, best);
  const double third = std::max(plane.sigma[2], 1e-12);
  out.quality = plane.sigma[0] / third;
  if (plane.sigma[0] < min_moved * third || plane.sigma[0] < 1e-9)
    out.degenerate = "the joint did not move: the points lie within their noise";
  else if (plane.sigma[1] < min_curved * third)
    out.degenerate = "the arc is too short: within their noise the points lie on a line";
  out.direction = plane.V.col(2);
  out.centre = circle_centre(points, plane);
  const Vector3d x = (points.col(0) - out.centre).normalized(), y = out.direction.cross(x);
  out.angles.assign(samples.size(), 0.0);
  double last = 0.0;
  std::size_t k = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (k < index.size() && index[k] == i) {
      const Vector3d r = points.col(static_cast<Eigen::Index>(k)) - out.centre;
      last = unwrapped(std::atan2(y.dot(r), x.dot(r)), last);
      ++k;
    }
    out.angles[i] = last;
  }
  return out;
}

/// Distance of each point from a circle.
Eigen::VectorXd circle_distances(const Eigen::Matrix3Xd& points, const Vector3d& centre, const Vector3d& normal,
                                 double radius) {
  Eigen::VectorXd out(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d r = points.col(i) - centre;
    const double height = normal.dot(r);
    out[i] = std::hypot(height, (r - height * normal).norm() - radius);
  }
  return out;
}

/// The circle through points in the sense of eq. 4.2-4.6, and the distance of all points from it.
Eigen::VectorXd distances_from_circle_of(const Eigen::Matrix3Xd& some, const Eigen::Matrix3Xd& all) {
  const Plane plane = plane_of(some);
  const Vector3d centre = circle_centre(some, plane);
  const double radius = (some.colwise() - centre).colwise().norm().mean();
  return circle_distances(all, centre, plane.V.col(2), radius);
}

Eigen::Matrix3Xd columns(const Eigen::Matrix3Xd& points, const std::vector<Eigen::Index>& index) {
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(index.size()));
  for (std::size_t k = 0; k < index.size(); ++k) out.col(static_cast<Eigen::Index>(k)) = points.col(index[k]);
  return out;
}

/// Which points lie on the circle that most of them have in common: the one through three of them with the least median
/// distance, then through all that are near to it.
std::vector<bool> points_on_one_circle(const Eigen::Matrix3Xd& points) {
  constexpr int triples = 300;
  constexpr double far_off = 10.0;  // robust standard deviations
  const Eigen::Index n = points.cols();
  std::vector<bool> out(static_cast<std::size_t>(n), true);
  if (n < 8) return out;
  Random random(1);
  const double size = (points.colwise() - points.rowwise().mean()).colwise().norm().maxCoeff();
  double least = std::numeric_limits<double>::infinity();
  Eigen::VectorXd best;
  for (int k = 0; k < triples; ++k) {
    const int count = static_cast<int>(n);
    const Eigen::Matrix3Xd three =
        columns(points, {random.integer(count), random.integer(count), random.integer(count)});
    const Vector3d a = three.col(1) - three.col(0), b = three.col(2) - three.col(0);
    if (a.cross(b).norm() < 1e-9 * size * size + 1e-300) continue;
    const Eigen::VectorXd d = distances_from_circle_of(three, points);
    const double middle = median({d.begin(), d.end()});
    if (middle < least) least = middle, best = d;
  }
  for (int round = 0; round < 3 && best.size() > 0; ++round) {
    const double sigma = std::max(mad_to_sigma * median({best.begin(), best.end()}), 1e-9 * size);
    std::vector<Eigen::Index> near;
    for (Eigen::Index i = 0; i < n; ++i) {
      out[static_cast<std::size_t>(i)] = best[i] < far_off * sigma;
      if (out[static_cast<std::size_t>(i)]) near.push_back(i);
    }
    best = distances_from_circle_of(columns(points, near), points);
  }
  return out;
}

/// Samples without gross outliers. Of a pose, two points away from its origin must be on their circles.
std::vector<bool> samples_on_one_circle(std::span<const JointSample> samples) {
  std::vector<bool> out(samples.size(), true);
  const auto keep = [&](const Eigen::Matrix3Xd& points, const std::vector<std::size_t>& index) {
    const std::vector<bool> on = points_on_one_circle(points);
    for (std::size_t k = 0; k < index.size(); ++k) out[index[k]] = out[index[k]] && on[k];
  };
  if (samples.front().T_world_tool) {
    std::vector<std::size_t> all(samples.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    for (const Vector3d& lever : {Vector3d(0.3, 0.2, 0.25), Vector3d(-0.25, 0.3, 0.2)}) {
      Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(samples.size()));
      for (std::size_t i = 0; i < samples.size(); ++i)
        points.col(static_cast<Eigen::Index>(i)) = *samples[i].T_world_tool * lever;
      keep(points, all);
    }
  } else {
    for (Eigen::Index c = 0; c < marker_count(samples); ++c) {
      const auto [points, index] = marker_trace(samples, c);
      keep(points, index);
    }
  }
  // Where too few agree there is no majority to believe.
  const auto sound = std::count(out.begin(), out.end(), true);
  if (static_cast<double>(sound) < sound_samples * static_cast<double>(samples.size()))
    out.assign(samples.size(), true);
  return out;
}

AxisStart start_from_poses(std::span<const JointSample> samples) {
  AxisStart out;
  const Pose& first = *samples.front().T_world_tool;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero(), A = Eigen::Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Pose& T = *samples[i].T_world_tool;
    const Eigen::Matrix3d R = T.linear() * first.linear().transpose();
    const Vector3d w = log_rotation(R);
    spread += w * w.transpose();
    const Eigen::Matrix3d D = Eigen::Matrix3d::Identity() - R;  // (I - R) c = t - R t0
    A += D.transpose() * D;
    b += D.transpose() * (T.translation() - R * first.translation());
    places.col(static_cast<Eigen::Index>(i)) = T.translation();
  }
  out.direction = symmetric_eigen(spread).vectors.col(2);
  A += out.direction * out.direction.transpose() * std::max(A.trace(), 1e-12);  // anywhere along the axis
  out.centre = A.ldlt().solve(b);
  out.centre += out.direction * out.direction.dot(places.rowwise().mean() - out.centre);
  const Plane plane = plane_of(places);
  out.quality = plane.sigma[0] / std::max(plane.sigma[2], 1e-12);
  double last = 0.0;
  for (const JointSample& sample : samples) {
    const Vector3d w = log_rotation(sample.T_world_tool->linear() * first.linear().transpose());
    last = unwrapped(out.direction.dot(w), last);
    out.angles.push_back(last);
  }
  return out;
}

/// The sense of growing joint values, else of the order of the samples.
void orient(std::span<const JointSample> samples, AxisStart& start) {
  double along = 0.0;
  const auto middle =
      std::accumulate(start.angles.begin(), start.angles.end(), 0.0) / static_cast<double>(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double order = static_cast<double>(i) - 0.5 * static_cast<double>(samples.size() - 1);
    along += (start.angles[i] - middle) * (samples[i].q ? *samples[i].q : order);
  }
  if (along >= 0) return;
  start.direction = -start.direction;
  for (double& angle : start.angles) angle = -angle;
}

/// The fit: an arm of one joint, whose base is the axis and whose value at each sample is unknown but for the first's.
struct AxisFit {
  fit::Problem fit;
  fit::FitBlock axis, tool;
  std::vector<fit::FitBlock> points, angles;
  std::vector<std::vector<fit::FitMeasurement>> observations;
  fit::Solution result;

  AxisFit(std::span<const JointSample> samples, const AxisStart& start, double sigma_position, double sigma_rotation) {
    kinematics::DhChain joint;
    joint.joints.resize(1);
    const fit::FitBlock arm = fit.add_arm("joint", joint);
    fit.hold(arm);
    Pose T = Pose::Identity();
    T.translation() = start.centre;
    T.linear() = rotation_from_z(start.direction);
    axis = fit.add_pose("axis", T);
    fit.hold(axis, 2), fit.hold(axis, 5);
    const bool poses = samples.front().T_world_tool.has_value();
    if (poses) tool = fit.add_pose("tool", T.inverse() * *samples.front().T_world_tool);
    for (Eigen::Index c = 0; c < marker_count(samples); ++c) {
      Vector3d place = Vector3d::Zero();
      for (std::size_t i = samples.size(); i-- > 0;)
        if (is_seen(samples[i], c))
          place = Eigen::AngleAxisd(-start.angles[i], Vector3d::UnitZ()) *
                  (T.inverse() * Vector3d(samples[i].points.col(c)));
      points.push_back(fit.add_point("point" + std::to_string(c + 1), place));
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      angles.push_back(i == 0 ? fit::FitBlock{}
                              : fit.add_nuisance_vector("angle", Eigen::VectorXd::Zero(1), {"q [rad]"}));
      const Eigen::MatrixXd one = i == 0 ? Eigen::MatrixXd() : Eigen::MatrixXd::Ones(1, 1);
      const fit::PoseChain chain =
          fit::PoseChain().then(axis).then_arm(arm, Eigen::VectorXd::Constant(1, start.angles[i]), angles[i], one);
      std::vector<fit::FitMeasurement>& mine = observations.emplace_back();
      if (poses)
        mine.push_back(fit.add(fit::PoseMeasurement(fit::PoseChain(chain).then(tool), *samples[i].T_world_tool,
                                                    sigma_position, sigma_rotation)));
      for (Eigen::Index c = 0; c < samples[i].points.cols(); ++c)
        if (is_seen(samples[i], c))
          mine.push_back(fit.add(fit::PositionMeasurement(chain, points[static_cast<std::size_t>(c)],
                                                          Vector3d(samples[i].points.col(c)), sigma_position)));
    }
  }
  void set_weights(const std::vector<double>& weights) {
    for (std::size_t i = 0; i < observations.size(); ++i)
      for (const fit::FitMeasurement o : observations[i]) fit.set_weight(o, weights[i]);
  }
};

/// Root of the mean square of residuals of positions and of rotations, for the degrees of freedom that are left.
struct AxisNoise {
  double position = 1.0, rotation = 1.0;
  double dof = 1.0;
};

AxisNoise axis_noise(const AxisFit& fit, const std::vector<double>& weights) {
  double squares[2] = {0, 0}, rows[2] = {0, 0}, inside = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    ++inside;
    for (const fit::FitMeasurement o : fit.observations[i]) {
      const Eigen::VectorXd r = fit.fit.residuals(o);
      for (Eigen::Index k = 0; k < r.size(); ++k) squares[k >= 3] += r[k] * r[k], ++rows[k >= 3];
    }
  }
  AxisNoise out;
  const double all = rows[0] + rows[1];
  out.dof = std::max(1.0, all - static_cast<double>(fit.result.coordinates.size()) - (inside - 1));
  // What the parameters take up is shared by both kinds in proportion to their number.
  const auto rms = [&](int kind) {
    return rows[kind] > 0 ? std::sqrt(squares[kind] / (rows[kind] / all * out.dof)) : 1.0;
  };
  out.position = rms(0), out.rotation = rms(1);
  return out;
}

/// The estimation while it goes on, in the stages of the pipeline; its one start has a closed form.
struct AxisEstimation {
  using Place = AxisStart;

  std::span<const JointSample> samples;
  const JointAxisOptions& options;
  AxisStart start;
  double sigma_position = 1e-4, sigma_rotation = 1e-4;
  std::vector<double> weights;
  std::optional<AxisFit> fit;
  AxisNoise noise;

  void solve(double loss = 0.0) {
    fit.emplace(samples, start, sigma_position, sigma_rotation);
    fit->set_weights(weights);
    fit->result = fit->fit.solve({.loss = loss, .uncertainty = loss == 0});
    noise = axis_noise(*fit, weights);
  }
  void find_noise(double loss = 0.0) {
    for (int round = 0; round < 4; ++round) {
      solve(loss);
      if (options.sigma_position == 0) sigma_position = std::max(sigma_position * noise.position, 1e-12);
      if (options.sigma_rotation == 0) sigma_rotation = std::max(sigma_rotation * noise.rotation, 1e-12);
    }
    solve(loss);
  }
  bool noise_known() const {
    return options.sigma_position > 0 && (options.sigma_rotation > 0 || !samples.front().T_world_tool);
  }
  double probability(std::size_t i) const {
    const fit::Agreement agreement = fit->result.agreement(fit->fit, fit->observations[i]);
    return fit::pipeline::sound_probability(agreement.squared_distance, agreement.dof, weights[i] > 0,
                                            noise_known() ? uncertainty::known_noise : noise.dof);
  }
  std::vector<AxisStart> starts() const { return {start}; }
  fit::pipeline::Minimum<AxisStart> descend(const AxisStart& from) const { return {from, 0.0}; }
  void begin(const AxisStart& from) {
    start = from;
    find_noise(2.0);
  }
  std::size_t fewest() const {
    return static_cast<std::size_t>(std::ceil(sound_samples * static_cast<double>(samples.size())));
  }
  double false_alarm() const { return options.outlier_false_alarm; }
  /// The first sample carries the zero of the angles; one that is out has no angle of its own by which to come back.
  std::vector<double> probabilities() const {
    std::vector<double> out(samples.size(), 1.0);
    for (std::size_t i = 1; i < out.size(); ++i) out[i] = weights[i] > 0 ? probability(i) : 0.0;
    return out;
  }
};

/// Angle about the axis at which each sample was found [rad].
double found_angle(const AxisEstimation& estimation, std::size_t i) {
  const fit::FitBlock change = estimation.fit->angles[i];
  return estimation.start.angles[i] + (change.exists() ? estimation.fit->fit.values(change)[0] : 0.0);
}

/// Standard deviation of the radius over the radius, by which all angles of points are too large or too small together
/// [-]; those of poses do not depend on it.
double relative_radius_std(const AxisFit& fit) {
  double radius = 0.0;
  for (const fit::FitBlock point : fit.points) radius = std::max(radius, fit.fit.values(point).head<2>().norm());
  if (radius == 0.0) return 0.0;
  const std::vector<int> places = fit.result.places(fit.axis);
  Eigen::Matrix2d offset;
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c)
      offset(r, c) = fit.result.covariance(places[static_cast<std::size_t>(r)], places[static_cast<std::size_t>(c)]);
  return std::sqrt(symmetric_eigen(offset).values[1]) / radius;
}

/// Empty when the joint turned as its readings say, as far as noise lets it be seen.
std::optional<ScaledReadings> find_scaled_readings(const AxisEstimation& estimation) {
  constexpr double matters = 0.005, false_alarm = 1e-4;  // of a sound encoder
  std::vector<double> readings, found;
  for (std::size_t i = 0; i < estimation.samples.size(); ++i) {
    if (!estimation.samples[i].q) return {};
    if (!(estimation.weights[i] > 0)) continue;
    readings.push_back(*estimation.samples[i].q), found.push_back(found_angle(estimation, i));
  }
  const auto n = static_cast<Eigen::Index>(readings.size());
  if (n < 4) return {};
  Eigen::VectorXd q = Eigen::VectorXd::Map(readings.data(), n), angle = Eigen::VectorXd::Map(found.data(), n);
  q.array() -= q.mean(), angle.array() -= angle.mean();
  const double qq = q.squaredNorm(), qa = q.dot(angle), dof = static_cast<double>(n) - 2;
  if (!(qq > 0)) return {};
  const double slope = qa / qq;
  const double variance =
      std::max(angle.squaredNorm() - slope * qa, 0.0) / dof / qq + std::pow(relative_radius_std(*estimation.fit), 2);
  const double f = (slope - 1) * (slope - 1) / std::max(variance, 1e-30);
  if (std::abs(slope - 1) < matters || 1 - uncertainty::fisher_cdf(f, 1, dof) > false_alarm) return {};
  return ScaledReadings{slope, std::sqrt(variance)};
}

/// Residuals of neighbours along the arc are alike where the points leave their circle.
std::optional<SystematicResiduals> find_systematic_residuals(const AxisEstimation& estimation) {
  double product = 0.0, square = 0.0, pairs = 0.0;
  Eigen::VectorXd before;
  for (std::size_t i = 0; i < estimation.samples.size(); ++i) {
    if (!(estimation.weights[i] > 0) || estimation.fit->observations[i].empty()) continue;
    const Eigen::VectorXd r = estimation.fit->fit.residuals(estimation.fit->observations[i].front()).head<3>();
    square += r.squaredNorm();
    if (before.size()) product += r.dot(before), pairs += 3;
    before = r;
  }
  if (pairs < 24 || !(product / square > 5 / std::sqrt(pairs))) return {};
  return SystematicResiduals{product / square, 1 / std::sqrt(pairs)};
}

AxisFindings find_in_axis(const AxisEstimation& estimation) {
  constexpr double rounding = 1e-9;  // computed samples have no noise that could be systematic [m]
  if (estimation.sigma_position < rounding) return {};
  return {find_systematic_residuals(estimation), find_scaled_readings(estimation)};
}

void check_samples(std::span<const JointSample> samples) {
  require(samples.size() >= 4, "an axis needs at least four samples, found " + std::to_string(samples.size()));
  const bool poses = samples.front().T_world_tool.has_value();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::string where = "sample " + std::to_string(i) + ": ";
    require(samples[i].T_world_tool.has_value() == poses, where + "poses and points cannot be mixed");
    require(!poses || samples[i].points.cols() == 0, where + "poses and points cannot be mixed");
    require(poses || (samples[i].points.cols() > 0 && samples[i].points.array().isFinite().colwise().all().any()),
            where + "nothing was measured");
    require(!samples[i].points.array().isInf().any(), where + "points must be finite, or NaN where not seen");
    require(!samples[i].q || std::isfinite(*samples[i].q), where + "q must be finite [rad]");
    require(!poses ||
                (samples[i].T_world_tool->matrix().allFinite() && is_rotation(samples[i].T_world_tool->linear(), 1e-3)),
            where + "T_world_tool has no proper rotation");
  }
}

void write_axis(const AxisEstimation& estimation, JointAxisResult& out) {
  const AxisFit& fit = *estimation.fit;
  out.T_world_axis = fit.fit.pose(fit.axis);
  out.sigma_position = estimation.sigma_position;
  out.sigma_rotation = estimation.sigma_rotation;
  out.dof = estimation.noise_known() ? uncertainty::known_noise : estimation.noise.dof;
  const std::vector<int> places = fit.result.places(fit.axis);
  const int mine[] = {places[0], places[1], places[3], places[4]};
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      out.covariance(r, c) = uncertainty::covariance_inflation(4, out.dof) * fit.result.covariance(mine[r], mine[c]);
  out.radii.resize(static_cast<Eigen::Index>(fit.points.size()));
  for (std::size_t c = 0; c < fit.points.size(); ++c)
    out.radii[static_cast<Eigen::Index>(c)] = fit.fit.values(fit.points[c]).head<2>().norm();
  const double height =
      fit.points.empty() ? fit.fit.pose(fit.tool).translation().z() : fit.fit.values(fit.points[0]).z();
  out.axis.direction = out.T_world_axis.linear().col(2);
  out.axis.point = out.T_world_axis * Vector3d(0, 0, height);
  out.angles.resize(static_cast<Eigen::Index>(estimation.samples.size()));
  double squares = 0.0, count = 0.0;
  for (std::size_t i = 0; i < estimation.samples.size(); ++i) {
    out.angles[static_cast<Eigen::Index>(i)] = found_angle(estimation, i);
    if (!(estimation.weights[i] > 0)) {
      out.outliers.push_back(static_cast<int>(i));
      continue;
    }
    for (const fit::FitMeasurement o : fit.observations[i])
      squares += fit.fit.residuals(o).head<3>().squaredNorm() * out.sigma_position * out.sigma_position, ++count;
  }
  out.rms = std::sqrt(squares / std::max(count, 1.0));
  out.arc = out.angles.maxCoeff() - out.angles.minCoeff();
  out.findings = find_in_axis(estimation);
  out.fit = fit.result.fit;
}

}  // namespace

void JointAxisOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_rotation >= 0, "sigma_rotation must not be negative [rad]; 0 means estimated");
  require(min_arc > 0 && min_arc < 3, "min_arc must lie between 0 and 3 [rad]");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
}

namespace {

JointAxisResult identify_sound(std::span<const JointSample> samples, const JointAxisOptions& options) {
  JointAxisResult out;
  const bool poses = samples.front().T_world_tool.has_value();
  AxisEstimation estimation{samples, options, poses ? start_from_poses(samples) : start_from_points(samples),
                            1e-4,    1e-4,    std::vector<double>(samples.size(), 1.0),
                            {},      {}};
  AxisStart& start = estimation.start;
  out.quality = start.quality;
  out.axis.direction = start.direction, out.axis.point = start.centre;
  if (start.degenerate.empty()) {
    orient(samples, start);
    const auto [low, high] = std::minmax_element(start.angles.begin(), start.angles.end());
    out.arc = *high - *low;
    if (out.arc < options.min_arc)
      start.degenerate = "the joint turned by " + in_degrees(out.arc) + " only; at least " +
                         in_degrees(options.min_arc) + " are needed";
  }
  if (!start.degenerate.empty()) {
    out.fit.message = start.degenerate;
    return out;
  }
  if (options.sigma_position > 0) estimation.sigma_position = options.sigma_position;
  if (options.sigma_rotation > 0) estimation.sigma_rotation = options.sigma_rotation;
  fit::pipeline::run(estimation);
  write_axis(estimation, out);
  return out;
}

/// Joint value of a sample that took no part, by where its first seen point, or its tool, is about the axis.
double angle_about_axis(const JointAxisResult& axis, const JointSample& sample, const JointSample& known,
                        double known_angle) {
  const Pose to_axis = axis.T_world_axis.inverse();
  const auto turn = [&](const Vector3d& place, const Vector3d& other) {
    const Vector3d a = to_axis * other, b = to_axis * place;
    return unwrapped(known_angle + std::atan2(b.y(), b.x()) - std::atan2(a.y(), a.x()), known_angle);
  };
  if (sample.T_world_tool) return turn(sample.T_world_tool->translation(), known.T_world_tool->translation());
  for (Eigen::Index c = 0; c < sample.points.cols(); ++c)
    if (is_seen(sample, c) && is_seen(known, c)) return turn(sample.points.col(c), known.points.col(c));
  return known_angle;
}

}  // namespace

JointAxisResult identify_joint_axis(std::span<const JointSample> samples, const JointAxisOptions& options) {
  options.validate();
  check_samples(samples);
  // Gross outliers would spoil the singular values by which the estimation starts.
  const std::vector<bool> sound =
      options.outlier_false_alarm > 0 ? samples_on_one_circle(samples) : std::vector<bool>(samples.size(), true);
  if (std::find(sound.begin(), sound.end(), false) == sound.end()) return identify_sound(samples, options);
  std::vector<JointSample> kept;
  std::vector<int> index;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (sound[i]) kept.push_back(samples[i]), index.push_back(static_cast<int>(i));
  JointAxisResult out = identify_sound(kept, options);
  if (!out.fit.usable()) return out;
  for (int& i : out.outliers) i = index[static_cast<std::size_t>(i)];
  Eigen::VectorXd angles(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t i = 0, k = 0; i < samples.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (sound[i]) {
      angles[at] = out.angles[static_cast<Eigen::Index>(k++)];
    } else {
      angles[at] = angle_about_axis(out, samples[i], kept.front(), out.angles[0]);
      out.outliers.push_back(static_cast<int>(i));
    }
  }
  std::sort(out.outliers.begin(), out.outliers.end());
  out.angles = angles;
  return out;
}

}  // namespace kr5::calibration

// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/repeatability.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/pipeline/sound_probability.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

constexpr double ppm_sigma = 1e-12;    // below this a scatter is taken for none [m or rad]
constexpr double sound_returns = 0.6;  // at least this part of a point's returns stays sound
constexpr double gross = 8.0;          // robust deviations beyond which a return is first left out

using Deviations = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Returns of one point.
struct Group {
  std::string point;
  std::vector<int> index;  ///< In the input.
  std::vector<bool> sound;
  Pose T_mean = Pose::Identity();

  std::size_t size() const { return index.size(); }
  int used() const { return static_cast<int>(std::count(sound.begin(), sound.end(), true)); }
};

Eigen::Vector3d kuka_angles(const Eigen::Matrix3d& R) {
  Pose T = Pose::Identity();
  T.linear() = R;
  return to_xyzrpy(T).tail<3>().reverse();
}

/// A return relative to a mean: x y z in the frame of the measurement, rotation vector in the mean pose.
Vector6 deviation(const Pose& mean, const Pose& T) {
  Vector6 d;
  d << T.translation() - mean.translation(), log_rotation(mean.linear().transpose() * T.linear());
  return d;
}

struct Returns {
  std::span<const PoseReturn> all;
  std::vector<Group> groups;

  Pose mean(const Group& group, bool sound_only) const {
    std::vector<Pose> poses;
    for (std::size_t k = 0; k < group.size(); ++k)
      if (!sound_only || group.sound[k]) poses.push_back(all[static_cast<std::size_t>(group.index[k])].T);
    return mean_pose(poses);
  }
  const Pose& pose(const Group& group, std::size_t k) const { return all[static_cast<std::size_t>(group.index[k])].T; }
  Deviations deviations(const Group& group, bool sound_only) const {
    const Pose about = mean(group, sound_only);
    Deviations out(6, sound_only ? group.used() : static_cast<int>(group.size()));
    Eigen::Index column = 0;
    for (std::size_t k = 0; k < group.size(); ++k)
      if (!sound_only || group.sound[k]) out.col(column++) = deviation(about, pose(group, k));
    return out;
  }
};

std::string return_name(std::span<const PoseReturn> all, std::size_t i) {
  return all[i].name.empty() ? "return " + std::to_string(i + 1) : all[i].name;
}

Returns grouped(std::span<const PoseReturn> all) {
  Returns out{all, {}};
  std::map<std::string, std::size_t> known;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Pose& T = all[i].T;
    const std::string where = return_name(all, i) + ": ";
    require(T.matrix().allFinite(), where + "the pose must be finite");
    require(is_rotation(T.linear(), 1e-3), where + "the pose has no proper rotation");
    const auto [at, fresh] = known.emplace(all[i].point, out.groups.size());
    if (fresh) out.groups.push_back({.point = all[i].point, .index = {}, .sound = {}});
    out.groups[at->second].index.push_back(static_cast<int>(i));
    out.groups[at->second].sound.push_back(true);
  }
  require(!out.groups.empty(), "repeatability needs returns to at least one point");
  for (const Group& group : out.groups)
    require(group.size() >= 3, "point " + group.point + " has " + std::to_string(group.size()) +
                                   (group.size() == 1 ? " return" : " returns") +
                                   "; repeatability needs at least three of each point, ISO 9283 requires 30");
  return out;
}

/// Middle of a point's poses that outliers do not move: medians of the coordinates about the first pose.
Pose robust_middle(const Returns& returns, const Group& group) {
  const Pose& first = returns.pose(group, 0);
  Vector6 middle;
  for (int c = 0; c < 6; ++c) {
    std::vector<double> values;
    for (std::size_t k = 0; k < group.size(); ++k) values.push_back(deviation(first, returns.pose(group, k))[c]);
    middle[c] = median(values);
  }
  Pose T = first;
  T.translation() += middle.head<3>();
  T.linear() = first.linear() * exp_rotation(middle.tail<3>());
  return T;
}

/// Squared distance of a return from the others in position (from 0) or rotation (from 3), over its own uncertainty,
/// and the dimensions that scatter.
struct Distance {
  double squared = 0.0;
  int dimensions = 0;
};
Distance distance_of(const Eigen::Matrix3Xd& others, const Eigen::Vector3d& own) {
  const auto n = static_cast<double>(others.cols());
  const Eigen::Vector3d mean = others.rowwise().mean();
  const Eigen::Matrix3Xd centred = others.colwise() - mean;
  const SymmetricEigen eigen = symmetric_eigen(Eigen::Matrix3d(centred * centred.transpose() / (n - 1)));
  Distance out;
  for (int k = 0; k < 3; ++k) {
    const double variance = std::max(eigen.values[k], ppm_sigma * ppm_sigma);
    const double along = eigen.vectors.col(k).dot(own - mean);
    out.squared += along * along / (variance * (1 + 1 / n));
    ++out.dimensions;
  }
  return out;
}

/// Probability that a sound return lies as far from the other sound ones of its point (Hotelling); of position and
/// rotation the smaller, doubled.
double sound_return(const Returns& returns, const Group& group, std::size_t k, const Pose& about) {
  std::vector<std::size_t> others;
  for (std::size_t j = 0; j < group.size(); ++j)
    if (j != k && group.sound[j]) others.push_back(j);
  const auto n = static_cast<Eigen::Index>(others.size());
  if (n < 5) return 1.0;  // too few to tell
  Deviations d(6, n);
  for (Eigen::Index j = 0; j < n; ++j)
    d.col(j) = deviation(about, returns.pose(group, others[static_cast<std::size_t>(j)]));
  const Vector6 own = deviation(about, returns.pose(group, k));
  double least = 1.0;
  for (const int first : {0, 3}) {
    const Distance far = distance_of(d.middleRows<3>(first), own.segment<3>(first));
    const double f = far.squared * static_cast<double>(n - 3) / (3.0 * static_cast<double>(n - 1));
    least = std::min(least, 1 - uncertainty::fisher_cdf(f, 3, static_cast<double>(n - 3)));
  }
  return std::min(1.0, 2 * least);
}

/// Marks the returns of a point that contradict the others; false alarms over all of its returns.
void mark_outliers(const Returns& returns, Group& group, double false_alarm) {
  const Pose middle = robust_middle(returns, group);
  Eigen::MatrixXd squares(2, static_cast<Eigen::Index>(group.size()));
  for (std::size_t k = 0; k < group.size(); ++k) {
    const Vector6 d = deviation(middle, returns.pose(group, k));
    squares.col(static_cast<Eigen::Index>(k)) << d.head<3>().norm(), d.tail<3>().norm();
  }
  for (int part = 0; part < 2; ++part) {
    const Eigen::VectorXd row = squares.row(part);
    const double scale = median({row.begin(), row.end()}) / std::sqrt(uncertainty::chi_square_quantile(0.5, 3));
    for (std::size_t k = 0; k < group.size(); ++k)
      if (row[static_cast<Eigen::Index>(k)] > gross * std::max(scale, ppm_sigma)) group.sound[k] = false;
  }
  const auto least = static_cast<int>(std::ceil(sound_returns * static_cast<double>(group.size())));
  if (group.used() < least) std::fill(group.sound.begin(), group.sound.end(), true);  // no majority to judge by
  std::vector<double> weights(group.sound.begin(), group.sound.end());
  const auto probabilities = [&] {
    std::vector<double> out;
    for (std::size_t k = 0; k < group.size(); ++k) out.push_back(sound_return(returns, group, k, middle));
    return out;
  };
  fit::pipeline::settle_outliers(weights, false_alarm, static_cast<std::size_t>(least), probabilities,
                                 [&] { std::copy(weights.begin(), weights.end(), group.sound.begin()); });
}

/// The point whose poses a return is among, when it lies nearer to another point than to its own.
std::string nearest_point(const Returns& returns, const Group& own, const Pose& T) {
  const auto far = [&](const Group& group) {
    return (returns.mean(group, true).translation() - T.translation()).norm();
  };
  const Group* best = &own;
  for (const Group& group : returns.groups)
    if (far(group) < 0.2 * far(*best)) best = &group;
  return best == &own ? "" : best->point;
}

double mean_plus_three_sigma(const Eigen::VectorXd& l) {
  const double mean = l.mean();
  return mean + 3 * std::sqrt((l.array() - mean).square().sum() / static_cast<double>(l.size() - 1));
}

Eigen::Matrix3d square_root(const Eigen::Matrix3d& covariance) {
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

/// Covariance of one return of each group, with the number of its returns.
struct Scatter {
  Eigen::Matrix3d root;
  int returns = 0;
};

/// Distances from their own means in one simulated test.
Eigen::VectorXd simulated_distances(const std::vector<Scatter>& groups, Random& random) {
  Eigen::Index all = 0;
  for (const Scatter& group : groups) all += group.returns;
  Eigen::VectorXd l(all);
  Eigen::Index at = 0;
  for (const Scatter& group : groups) {
    Eigen::Matrix3Xd x(3, group.returns);
    for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] = random.normal();
    x = group.root * (x.colwise() - x.rowwise().mean()).eval();
    l.segment(at, group.returns) = x.colwise().norm();
    at += group.returns;
  }
  return l;
}

/// Mean distance plus three deviations of the whole population that the groups are samples of.
double population_figure(const std::vector<Scatter>& groups, Random& random) {
  constexpr int draws = 20'000;
  double sum = 0.0, squares = 0.0, all = 0.0;
  for (const Scatter& group : groups) all += group.returns;
  for (const Scatter& group : groups) {
    const double share = group.returns / all / draws;
    for (int k = 0; k < draws; ++k) {
      const double l = (group.root * Eigen::Vector3d(random.normal(), random.normal(), random.normal())).norm();
      sum += share * l, squares += share * l * l;
    }
  }
  return sum + 3 * std::sqrt(std::max(squares - sum * sum, 0.0));
}

/// Bounds of a figure from simulated tests: estimate over truth is spread as simulated over assumed.
BoundedFigure simulated_bounds(double value, const std::vector<Scatter>& groups, const RepeatabilityOptions& options) {
  BoundedFigure out{value, value, value};
  if (!(value > ppm_sigma)) return out;
  Random random(static_cast<std::uint64_t>(options.seed));
  const double truth = population_figure(groups, random);
  std::vector<double> ratios;
  for (int k = 0; k < options.simulations; ++k)
    ratios.push_back(mean_plus_three_sigma(simulated_distances(groups, random)) / truth);
  std::sort(ratios.begin(), ratios.end());
  const double tail = (1 - options.confidence) / 2 * static_cast<double>(ratios.size() - 1);
  const auto at = [&](double place) { return ratios[static_cast<std::size_t>(std::lround(place))]; };
  out.low = value / at(static_cast<double>(ratios.size() - 1) - tail);
  out.high = value / at(tail);
  return out;
}

BoundedFigure three_sigma(double variance, double dof, double confidence) {
  const double value = 3 * std::sqrt(variance), tail = (1 - confidence) / 2;
  return {value, value * std::sqrt(dof / uncertainty::chi_square_quantile(1 - tail, dof)),
          value * std::sqrt(dof / uncertainty::chi_square_quantile(tail, dof))};
}

/// Length of a mean that scatters with `covariance` of one return, and bounds of the true length.
BoundedFigure length_bounds(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance, int n, double confidence) {
  BoundedFigure out{mean.norm(), mean.norm(), mean.norm()};
  const Eigen::Vector3d along = out.value > 0 ? Eigen::Vector3d(mean / out.value) : Eigen::Vector3d::UnitX();
  const double variance = along.dot(covariance * along);
  if (!(variance > ppm_sigma * ppm_sigma)) return out;
  // Across the offset the scatter adds length, as that many dimensions like the one along it.
  const double dimensions = std::min(covariance.trace() / variance, 50.0), tail = (1 - confidence) / 2;
  const double f = out.value * out.value * n / (dimensions * variance);
  const double unit = std::sqrt(variance / n);
  if (out.value > 20 * unit) {  // the scatter across adds nothing that counts
    const double half = uncertainty::student_factor(n - 1.0, confidence) * unit;
    return {out.value, out.value - half, out.value + half};
  }
  const auto length_at = [&](double probability) {
    const auto below = [&](double length) {
      return uncertainty::noncentral_fisher_cdf(f, dimensions, n - 1.0, std::pow(length / unit, 2));
    };
    if (below(0.0) <= probability) return 0.0;
    double low = 0.0, high = out.value + unit;
    while (below(high) > probability) low = high, high = 2 * high + unit;
    for (int k = 0; k < 60; ++k) (below((low + high) / 2) > probability ? low : high) = (low + high) / 2;
    return high;
  };
  out.low = length_at(1 - tail);
  out.high = length_at(tail);
  return out;
}

/// Deviations in angles A, B, C.
Eigen::Matrix3Xd angles_of(const Deviations& d) {
  Eigen::Matrix3Xd out(3, d.cols());
  for (Eigen::Index k = 0; k < d.cols(); ++k) out.col(k) = kuka_angles(exp_rotation(d.col(k).tail<3>()));
  return out;
}

struct Sample {
  Deviations d;
  Eigen::Matrix3Xd abc;
  int dof = 0;
};

void write_figures(const std::vector<Sample>& samples, const RepeatabilityOptions& options, PointRepeatability& out) {
  Matrix6 squares = Matrix6::Zero();
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();
  double dof = 0.0;
  Eigen::Index all = 0;
  std::vector<Scatter> positions, rotations;
  for (const Sample& s : samples) {
    squares += s.d * s.d.transpose();
    angles += s.abc.cwiseAbs2().rowwise().sum();
    dof += s.dof, all += s.d.cols();
    const Matrix6 own = s.d * s.d.transpose() / s.dof;
    positions.push_back({square_root(own.topLeftCorner<3, 3>()), static_cast<int>(s.d.cols())});
    rotations.push_back({square_root(own.bottomRightCorner<3, 3>()), static_cast<int>(s.d.cols())});
  }
  Eigen::VectorXd l(all), turn(all);
  Eigen::Index at = 0;
  for (const Sample& s : samples) {
    l.segment(at, s.d.cols()) = s.d.topRows<3>().colwise().norm();
    turn.segment(at, s.d.cols()) = s.d.bottomRows<3>().colwise().norm();
    at += s.d.cols();
  }
  out.returns = static_cast<int>(all);
  out.covariance = squares / dof;
  out.RP = simulated_bounds(mean_plus_three_sigma(l), positions, options);
  out.RR = simulated_bounds(mean_plus_three_sigma(turn), rotations, options);
  out.RR_A = three_sigma(angles[0] / dof, dof, options.confidence);
  out.RR_B = three_sigma(angles[1] / dof, dof, options.confidence);
  out.RR_C = three_sigma(angles[2] / dof, dof, options.confidence);
}

void write_accuracy(const Pose& commanded, double confidence, PointRepeatability& out) {
  const Eigen::Matrix3d turned = commanded.linear().transpose() * out.T_mean.linear();
  const Eigen::Vector3d shift = out.T_mean.translation() - commanded.translation(), turn = log_rotation(turned);
  out.offset.resize(6);
  out.offset << shift, kuka_angles(turned);
  out.AP = length_bounds(shift, out.covariance.topLeftCorner<3, 3>(), out.returns, confidence);
  out.AR = length_bounds(turn, out.covariance.bottomRightCorner<3, 3>(), out.returns, confidence);
}

/// Trend of all deviations over their order, each point about its own mean.
ReturnDrift find_drift(const Returns& returns, double false_alarm) {
  ReturnDrift out;
  std::vector<double> time;
  std::vector<Vector6> d;
  double dof = -1.0;  // of the slope
  for (const Group& group : returns.groups) {
    Deviations own = returns.deviations(group, true);
    // The device turns alike for all points, in its own frame, whatever their orientation.
    own.bottomRows<3>() = returns.mean(group, true).linear() * own.bottomRows<3>();
    double mean = 0.0;
    std::vector<double> t;
    for (std::size_t k = 0; k < group.size(); ++k)
      if (group.sound[k]) t.push_back(group.index[k]);
    for (const double value : t) mean += value / static_cast<double>(t.size());
    for (std::size_t k = 0; k < t.size(); ++k)
      time.push_back(t[k] - mean), d.push_back(own.col(static_cast<Eigen::Index>(k)));
    dof += static_cast<double>(t.size()) - 1;
  }
  double tt = 0.0;
  Vector6 td = Vector6::Zero();
  for (std::size_t k = 0; k < time.size(); ++k) tt += time[k] * time[k], td += time[k] * d[k];
  if (!(tt > 0) || dof < 3) return out;
  const Vector6 slope = td / tt;
  Vector6 left = Vector6::Zero();
  for (std::size_t k = 0; k < time.size(); ++k) left += (d[k] - slope * time[k]).cwiseAbs2();
  const double span = static_cast<double>(returns.all.size() - 1);
  out.motion = slope * span;
  out.sigma = (left / dof / tt).cwiseSqrt() * span;
  for (int c = 0; c < 6; ++c) {
    if (!(out.sigma[c] > ppm_sigma)) continue;
    const double f = std::pow(out.motion[c] / out.sigma[c], 2);
    out.probability = std::min(out.probability, 6 * (1 - uncertainty::fisher_cdf(f, 1, dof)));
  }
  out.significant = out.probability < false_alarm;
  return out;
}

}  // namespace

void RepeatabilityOptions::validate() const {
  require(confidence > 0 && confidence < 1, "confidence must lie between 0 and 1 [-]");
  require(false_alarm > 0 && false_alarm < 0.5, "false_alarm must lie between 0 and 0.5 [-]");
  require(simulations >= 200 && simulations <= 1'000'000, "simulations must lie between 200 and a million");
}

RepeatabilityResult measure_repeatability(std::span<const PoseReturn> all, std::span<const CommandedPose> commanded,
                                          const RepeatabilityOptions& options) {
  options.validate();
  Returns returns = grouped(all);
  std::map<std::string, const Pose*> commands;
  for (const CommandedPose& c : commanded) {
    require(std::ranges::any_of(returns.groups, [&](const Group& g) { return g.point == c.point; }),
            "point " + c.point + " has a command, but no returns");
    require(c.T.matrix().allFinite() && is_rotation(c.T.linear(), 1e-3),
            "the commanded pose of point " + c.point + " has no proper rotation, or is not finite");
    require(commands.emplace(c.point, &c.T).second, "point " + c.point + " has two commanded poses");
  }
  RepeatabilityResult out;
  const double each = options.false_alarm / static_cast<double>(all.size());
  for (Group& group : returns.groups) mark_outliers(returns, group, each * static_cast<double>(group.size()));
  for (const Group& group : returns.groups)
    for (std::size_t k = 0; k < group.size(); ++k) {
      if (group.sound[k]) continue;
      const Pose mean = returns.mean(group, true);
      const Vector6 off = deviation(mean, returns.pose(group, k));
      out.outliers.push_back({.index = group.index[k],
                              .distance = off.head<3>().norm(),
                              .angle = off.tail<3>().norm(),
                              .probability = sound_return(returns, group, k, mean),
                              .belongs_to = nearest_point(returns, group, returns.pose(group, k))});
    }
  std::ranges::sort(out.outliers, {}, &SuspectReturn::index);
  std::vector<Sample> samples;
  for (const Group& group : returns.groups) {
    PointRepeatability point;
    point.point = group.point;
    point.T_mean = returns.mean(group, options.leave_out_outliers);
    Sample sample{returns.deviations(group, options.leave_out_outliers), {}, 0};
    sample.abc = angles_of(sample.d);
    sample.dof = static_cast<int>(sample.d.cols()) - 1;
    write_figures({sample}, options, point);
    if (const auto c = commands.find(group.point); c != commands.end())
      write_accuracy(*c->second, options.confidence, point);
    samples.push_back(std::move(sample));
    out.points.push_back(std::move(point));
  }
  write_figures(samples, options, out.overall);
  out.drift = find_drift(returns, options.false_alarm);
  out.fit.status = FitStatus::Converged;
  out.fit.message = std::to_string(all.size()) + " returns to " + std::to_string(returns.groups.size()) +
                    (returns.groups.size() == 1 ? " point" : " points");
  return out;
}

}  // namespace kr5::calibration

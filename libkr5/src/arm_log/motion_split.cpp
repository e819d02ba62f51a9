// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/motion_split.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include <kr5/arm_log/measured_positions.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;

namespace {

constexpr double gap_steps = 5.0;        // median steps, more than which is a gap
constexpr double min_gap = 0.01;         // [s]
constexpr double quiet_share = 0.01;     // of a joint's fastest speed, below which it rests
constexpr double min_rest = 0.25;        // [s]
constexpr double noticeable = 0.05;      // over which a way is counted, so that noise adds little to it [s]
constexpr double starting = 0.5;         // of the speed of its command, below which an arm begins at rest
constexpr double sure_speed = 4.0;       // standard deviations of a speed that is no noise
constexpr double min_motion = 1e-3;      // that a joint must go to have moved [rad or m]
constexpr double fit_share = 0.7;        // of the motion
constexpr double moving_speed = 0.02;    // at its first rows, above which a motion does not begin at rest
constexpr Index fewest_split_rows = 10;  // of a part
constexpr Index most_thinning = 2;       // by which a part has fewer rows than its motion needs
constexpr Index stretches = 10;          // of a part that is too long, at least
constexpr double most_longer = 4.0;      // times these, of a part that is much longer
constexpr Index most_judged_rows = 50000;
constexpr double stretch_length = 10.0;  // of an arm that is simulated so [s]
constexpr double stretch_lead_in = 2.0;  // before each of them [s]
constexpr double most_steps_to_fit = 16000, most_steps_to_check = 8000;

VectorXd steps_of(const VectorXd& t) { return t.tail(t.size() - 1) - t.head(t.size() - 1); }

double middle(const VectorXd& values) { return median({values.begin(), values.end()}); }

/// Range of each column.
VectorXd ranges(const MatrixXd& q) { return (q.colwise().maxCoeff() - q.colwise().minCoeff()).transpose(); }

/// Noise of the readings of each joint, where the motion is slow.
VectorXd roughness(const MatrixXd& q) {
  VectorXd out(q.cols());
  for (Index j = 0; j < q.cols(); ++j) {
    std::vector<double> second;
    for (Index i = 2; i < q.rows(); ++i) second.push_back(std::abs(q(i, j) - 2 * q(i - 1, j) + q(i - 2, j)));
    out[j] = mad_to_sigma * median(std::move(second)) / std::sqrt(6.0);
  }
  return out;
}

/// Speeds at the rows, second order in uneven steps.
MatrixXd gradient(const VectorXd& t, const MatrixXd& q) {
  const Index n = t.size();
  MatrixXd out(n, q.cols());
  out.row(0) = (q.row(1) - q.row(0)) / (t[1] - t[0]);
  out.row(n - 1) = (q.row(n - 1) - q.row(n - 2)) / (t[n - 1] - t[n - 2]);
  for (Index i = 1; i + 1 < n; ++i) {
    const double a = t[i] - t[i - 1], b = t[i + 1] - t[i];
    out.row(i) = (a / b * (q.row(i + 1) - q.row(i)) + b / a * (q.row(i) - q.row(i - 1))) / (a + b);
  }
  return out;
}

/// The value below which a share of a column lies, linear between its values.
double quantile(const VectorXd& column, double share) {
  std::vector<double> x(column.begin(), column.end());
  std::sort(x.begin(), x.end());
  const double at = share * static_cast<double>(x.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(at), x.size() - 2);
  return x[k] + (at - static_cast<double>(k)) * (x[k + 1] - x[k]);
}

double between(const VectorXd& t, const VectorXd& values, double at) {
  const auto after = std::upper_bound(t.begin(), t.end(), at) - t.begin();
  if (after == 0) return values[0];
  if (after == t.size()) return values[t.size() - 1];
  const Index k = after - 1;
  return values[k] + (at - t[k]) / (t[k + 1] - t[k]) * (values[k + 1] - values[k]);
}

/// Share of the way of all joints, each in units of its range, that lies before each time; a rest adds nothing.
VectorXd motion_share(const VectorXd& t, const MatrixXd& q) {
  const Index n = t.size();
  const auto stride =
      std::max<Index>(1, static_cast<Index>(std::nearbyint(noticeable / std::max(middle(steps_of(t)), 1e-9))));
  std::vector<Index> rows;
  for (Index i = 0; i < n - 1; i += stride) rows.push_back(i);
  rows.push_back(n - 1);
  const VectorXd range = ranges(q).cwiseMax(min_motion);
  const auto count = static_cast<Index>(rows.size());
  VectorXd at(count), way = VectorXd::Zero(count);
  for (Index k = 0; k < count; ++k) at[k] = static_cast<double>(rows[static_cast<std::size_t>(k)]);
  for (Index k = 1; k < count; ++k) {
    const Index now = rows[static_cast<std::size_t>(k)], before = rows[static_cast<std::size_t>(k - 1)];
    way[k] = way[k - 1] + (q.row(now) - q.row(before)).transpose().cwiseAbs().cwiseQuotient(range).sum();
  }
  way /= std::max(way[count - 1], 1e-30);
  VectorXd out(n);
  for (Index i = 0; i < n; ++i) out[i] = between(at, way, static_cast<double>(i));
  return out;
}

/// Time of the rest nearest to a share of the motion, between a half and 0.9 of it.
std::optional<double> cut_at_rest(const VectorXd& t, const MatrixXd& q, const VectorXd& before) {
  std::optional<double> out;
  double nearest = std::numeric_limits<double>::infinity();
  for (const TimeSpan& rest : rests(t, q)) {
    const double share = between(t, before, rest.end);
    if (share < 0.5 || share > 0.9 || std::abs(share - fit_share) >= nearest) continue;
    nearest = std::abs(share - fit_share);
    out = std::max(rest.begin, rest.end - min_rest / 2);
  }
  return out;
}

/// A time to a tenth of a millisecond [s], as people write it.
double to_tenth_of_ms(double t) { return std::nearbyint(t * 1e4) / 1e4; }

double to_three_digits(double value) {
  char out[32];
  std::snprintf(out, sizeof out, "%.3g", value);
  return std::strtod(out, nullptr);
}

/// A part of a log, and its rows.
struct Piece {
  MotionSpan span;
  RowRange rows;
  double length = 0.0;  // [s]
};

/// Whether an arm is told to move, where its log has commands; after a motion it may creep for a while.
bool is_told_to_move(const LoggedMotion& log, const RowRange& rows) {
  return log.command.size() == 0 || (ranges(log.command.middleRows(rows.first, rows.size())).array() > 0.0).any();
}

/// A log, parted where its clock stands still.
std::vector<Piece> pieces_of(const LoggedMotion& log, int number) {
  std::vector<RowRange> found;
  for (const RowRange& part : parts_without_gap(log.t, log.max_gap))
    if (part.size() >= fewest_split_rows && joints_move(log.q.middleRows(part.first, part.size())) &&
        is_told_to_move(log, part))
      found.push_back(part);
  if (found.empty()) found.push_back({0, log.t.size()});
  std::vector<Piece> out;
  for (const RowRange& rows : found) {
    Piece piece{{.log = number}, rows, log.t[rows.last - 1] - log.t[rows.first]};
    const auto cut = [&](Index row) { return to_tenth_of_ms((log.t[row - 1] + log.t[row]) / 2); };
    if (rows.first > 0) piece.span.begin = cut(rows.first);
    if (rows.last < log.t.size()) piece.span.end = cut(rows.last);
    out.push_back(piece);
  }
  return out;
}

std::vector<Piece> halves(const Piece& piece, const LoggedMotion& log) {
  const VectorXd t = log.t.segment(piece.rows.first, piece.rows.size());
  const MatrixXd q = log.q.middleRows(piece.rows.first, piece.rows.size());
  const VectorXd before = motion_share(t, q);
  const std::optional<double> rest = cut_at_rest(t, q, before);
  const auto share = std::lower_bound(before.begin(), before.end(), fit_share) - before.begin();
  const double cut = to_tenth_of_ms(rest ? *rest : t[std::min<Index>(share, t.size() - 1)]);
  Piece fit = piece, check = piece;
  fit.span.end = cut;
  check.span.split = cell::Split::Check;
  const auto row_at = [&](double time) {
    return (std::lower_bound(t.begin(), t.end(), time) - t.begin()) + piece.rows.first;
  };
  fit.rows.last = row_at(cut);
  if (rest || !log.commanded) {
    check.span.begin = cut;
  } else {
    const double first = std::isfinite(piece.span.begin) ? piece.span.begin : t[0];
    if (log.stepwise && cut - stretch_lead_in > first) check.span.begin = to_tenth_of_ms(cut - stretch_lead_in);
    check.span.lead_in = to_tenth_of_ms(cut - std::max(first, check.span.begin));
  }
  check.rows.first = row_at(check.span.begin);
  fit.span.cut = check.span.cut = rest ? CutReason::AtRest : !log.commanded ? CutReason::Measured : CutReason::LeadIn;
  fit.length = cut - t[0];
  check.length = t[t.size() - 1] - cut;
  return {fit, check};
}

/// The last pieces are to check.
void split_whole(std::vector<Piece>& pieces) {
  double all = 0.0;
  for (const Piece& piece : pieces) all += piece.length;
  double reached = 0.0, nearest = std::numeric_limits<double>::infinity();
  std::size_t fitted = 1;
  for (std::size_t k = 0; k + 1 < pieces.size(); ++k) {
    reached += pieces[k].length / std::max(all, 1e-30);
    if (std::abs(reached - fit_share) >= nearest) continue;
    nearest = std::abs(reached - fit_share);
    fitted = k + 1;
  }
  for (std::size_t k = fitted; k < pieces.size(); ++k) pieces[k].span.split = cell::Split::Check;
}

/// A simulation begins at rest: one of a log that begins in motion is judged once the servos have forgotten it.
void add_lead_in(Piece& piece, const LoggedMotion& log) {
  if (!log.commanded || piece.span.lead_in > 0) return;
  const auto part = [&](const MatrixXd& m) {
    return m.size() > 0 ? MatrixXd(m.middleRows(piece.rows.first, piece.rows.size())) : MatrixXd();
  };
  const VectorXd t = log.t.segment(piece.rows.first, piece.rows.size());
  const double speed = sure_initial_speeds(t, part(log.q), part(log.command)).maxCoeff();
  if (!(speed > moving_speed && log.settle < 0.5 * piece.length)) return;
  piece.span.lead_in = to_three_digits(log.settle);
  piece.span.initial_speed = speed;
}

/// Rows of a part that its motion needs, one in how many.
int needed_stride(const Piece& piece, const LoggedMotion& log) {
  const Index rows = std::min(piece.rows.size(), most_judged_rows);  // of its middle, which tell how fast it moves
  const Index first = piece.rows.first + (piece.rows.size() - rows) / 2;
  return choose_smoothing(log.t.segment(first, rows), log.q.middleRows(first, rows)).stride;
}

/// A part, or stretches of it where it is too long: with fewer rows a period than it needs, its motion would be lost.
std::vector<MotionSpan> stretches_of(const Piece& piece, const LoggedMotion& log) {
  const Index most = most_thinning * max_experiment_rows;
  if (log.commanded || piece.rows.size() <= most) return {piece.span};
  const int stride = needed_stride(piece, log);
  if (piece.rows.size() / stride <= most) return {piece.span};
  const Index length = most / stretches * stride;
  // A longer log tells more, up to what a diagnosis has time for: with sixteen times the rows half the interval.
  const double longer = std::sqrt(static_cast<double>(piece.rows.size()) / static_cast<double>(stride * most));
  const auto count = static_cast<Index>(stretches * std::min(longer, most_longer));
  std::vector<MotionSpan> out;
  for (Index k = 0; k < count; ++k) {
    const Index first = piece.rows.first + k * (piece.rows.size() - length) / (count - 1);
    if (!joints_move(log.q.middleRows(first, length))) continue;
    MotionSpan span = piece.span;
    span.stretch = true;
    span.begin = to_tenth_of_ms(log.t[first]);
    span.end = to_tenth_of_ms(log.t[first + length - 1]);
    out.push_back(span);
  }
  return out.empty() ? std::vector<MotionSpan>{piece.span} : out;
}

double simulated_steps(const Piece& piece, const LoggedMotion& log) {
  const double rows = static_cast<double>(piece.rows.size());
  return std::max(rows, (log.t[piece.rows.last - 1] - log.t[piece.rows.first]) / predict::servo_arm_step);
}

/// Rows of a part after its lead-in.
RowRange judged_rows(const Piece& piece, const LoggedMotion& log) {
  const double begin = log.t[piece.rows.first] + piece.span.lead_in;
  const auto first = std::lower_bound(log.t.begin() + piece.rows.first, log.t.begin() + piece.rows.last - 1, begin);
  return {first - log.t.begin(), piece.rows.last};
}

/// The first row of the stretch within some rows in which most moves.
Index busiest_row(const VectorXd& t, const VectorXd& before, RowRange rows) {
  Index best = rows.first, end = rows.first;
  double most = -1.0;
  for (Index k = rows.first; k < rows.last; ++k) {
    while (end + 1 < rows.last && t[end] < t[k] + stretch_length) ++end;
    if (before[end] - before[k] > most) best = k, most = before[end] - before[k];
  }
  return best;
}

/// Stretches of a part in which most moves, one in each of as many equal parts of it as there are steps for.
std::vector<MotionSpan> busiest_stretches(const Piece& piece, const LoggedMotion& log, double most_steps) {
  const RowRange judged = judged_rows(piece, log);
  const VectorXd t = log.t.segment(judged.first, judged.size());
  const MatrixXd q = log.q.middleRows(judged.first, judged.size());
  const double length = t[t.size() - 1] - t[0];
  const double rate = simulated_steps(piece, log) / (log.t[piece.rows.last - 1] - log.t[piece.rows.first]);
  const double fitting = most_steps / (rate * (stretch_length + stretch_lead_in));
  const auto count = static_cast<Index>(std::min(std::max(std::nearbyint(fitting), 1.0), length / stretch_length));
  if (count < 1) return {piece.span};
  const VectorXd before = motion_share(t, q);
  std::vector<MotionSpan> out;
  for (Index k = 0; k < count; ++k) {
    const RowRange slot{k * t.size() / count, (k + 1) * t.size() / count};
    if (!joints_move(q.middleRows(slot.first, slot.size()))) continue;
    const Index first = busiest_row(t, before, slot);
    MotionSpan span = piece.span;
    span.stretch = true;
    span.begin = to_tenth_of_ms(std::max(t[first] - stretch_lead_in, log.t[piece.rows.first]));
    span.lead_in = to_tenth_of_ms(t[first] - span.begin);
    span.end = to_tenth_of_ms(std::min(t[first] + stretch_length, t[slot.last - 1]));
    out.push_back(span);
  }
  return out.empty() ? std::vector<MotionSpan>{piece.span} : out;
}

/// Share of the steps of all parts with a split that there are to simulate.
double share_to_simulate(const std::vector<Piece>& pieces, const std::vector<LoggedMotion>& logs, cell::Split split) {
  double all = 0.0;
  for (const Piece& piece : pieces) {
    const LoggedMotion& log = logs[static_cast<std::size_t>(piece.span.log)];
    if (log.stepwise && piece.span.split == split) all += simulated_steps(piece, log);
  }
  return (split == cell::Split::Fit ? most_steps_to_fit : most_steps_to_check) / std::max(all, 1.0);
}

void require_sizes(const LoggedMotion& log) {
  require(log.t.size() >= 3, "t: found " + std::to_string(log.t.size()) + " rows, expected a motion");
  require(log.q.rows() == log.t.size() && log.q.cols() > 0, "q: expected a row for each time");
  require(log.command.size() == 0 || (log.command.rows() == log.q.rows() && log.command.cols() == log.q.cols()),
          "command: expected as many rows and joints as q has");
}

}  // namespace

std::vector<RowRange> parts_without_gap(const VectorXd& t, double max_gap) {
  const Index n = t.size();
  double longest = max_gap;
  if (!(longest > 0))
    longest = n > 2 ? std::max(gap_steps * middle(steps_of(t)), min_gap) : std::numeric_limits<double>::infinity();
  std::vector<RowRange> out;
  Index first = 0;
  for (Index i = 1; i <= n; ++i) {
    if (i < n && t[i] - t[i - 1] <= longest) continue;
    out.push_back({first, i});
    first = i;
  }
  return out;
}

bool joints_move(const MatrixXd& q) { return q.rows() > 0 && (ranges(q).array() > min_motion).any(); }

std::vector<TimeSpan> rests(const VectorXd& t, const MatrixXd& q) {
  if (t.size() < 5 || !(middle(steps_of(t)) > 0)) return {};
  const MatrixXd speed = gradient(t, q).cwiseAbs();
  double fastest = 0.0;
  for (Index j = 0; j < q.cols(); ++j) fastest = std::max(fastest, quantile(speed.col(j), 0.99));
  const VectorXd limit = (5 * roughness(q) / middle(steps_of(t))).cwiseMax(quiet_share * fastest);
  std::vector<TimeSpan> out;
  Index first = -1;
  for (Index i = 0; i <= t.size(); ++i) {
    const bool still = i < t.size() && (speed.row(i).transpose().array() <= limit.array()).all();
    if (still && first < 0) first = i;
    if (still || first < 0) continue;
    if (t[i - 1] - t[first] >= min_rest) out.push_back({t[first], t[i - 1]});
    first = -1;
  }
  return out;
}

VectorXd sure_initial_speeds(const VectorXd& t, const MatrixXd& q, const MatrixXd& command) {
  const VectorXd noise = roughness(q);
  VectorXd out(q.cols());
  for (Index j = 0; j < q.cols(); ++j) {
    const cell::InitialSpeed found = cell::initial_speed(t, q.col(j));
    out[j] = std::max(std::abs(found.value) - sure_speed * found.noise_gain * noise[j], 0.0);
    if (command.size() > 0 && out[j] < starting * std::abs(cell::initial_speed(t, command.col(j)).value)) out[j] = 0.0;
  }
  return out;
}

std::vector<MotionSpan> split_motions(const std::vector<LoggedMotion>& logs) {
  require(!logs.empty(), "logs: found none, expected at least one motion");
  std::vector<Piece> pieces;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    require_sizes(logs[k]);
    for (const Piece& piece : pieces_of(logs[k], static_cast<int>(k))) pieces.push_back(piece);
  }
  const auto kept = [](const LoggedMotion& log) { return log.kept_to_check; };
  require(!std::all_of(logs.begin(), logs.end(), kept), "kept_to_check: found every log, expected one to fit");
  if (std::any_of(logs.begin(), logs.end(), kept))
    for (Piece& piece : pieces)
      piece.span.split = kept(logs[static_cast<std::size_t>(piece.span.log)]) ? cell::Split::Check : cell::Split::Fit;
  else if (pieces.size() == 1)
    pieces = halves(pieces.front(), logs.front());
  else
    split_whole(pieces);
  const double to_fit = share_to_simulate(pieces, logs, cell::Split::Fit);
  const double to_check = share_to_simulate(pieces, logs, cell::Split::Check);
  std::vector<MotionSpan> out;
  for (Piece& piece : pieces) {
    const LoggedMotion& log = logs[static_cast<std::size_t>(piece.span.log)];
    add_lead_in(piece, log);
    const double share = piece.span.split == cell::Split::Fit ? to_fit : to_check;
    const bool reduced = log.stepwise && share < 1.0;
    for (const MotionSpan& span :
         reduced ? busiest_stretches(piece, log, share * simulated_steps(piece, log)) : stretches_of(piece, log))
      out.push_back(span);
  }
  return out;
}

}  // namespace kr5::arm_log

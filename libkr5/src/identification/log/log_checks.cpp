// SPDX-License-Identifier: BSD-3-Clause
#include "identification/log/log_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/identification/zero_phase.hpp>

#include "identification/log/even_log.hpp"
#include "identification/log/standard_deviation.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {

namespace {

constexpr Index min_rows = 30;           // below which only the clock and missing numbers are judged
constexpr double even_steps = 0.02;      // of the median step: below that a clock counts as even
constexpr double few_backward = 0.05;    // share of rows out of order that sorting mends
constexpr double bridged_gap = 0.01;     // in which an arm does nothing unforeseen [s]
constexpr double standing_range = 2e-3;  // motion of a joint that counts as none [rad or m]
constexpr double degrees_per_radian = 180.0 / std::numbers::pi;
constexpr double derivative_correlation = 0.9;
constexpr double speed_scale_tolerance = 0.05;
constexpr double max_delay = 0.2;                   // that is searched [s]
constexpr double coldest = -40.0, hottest = 200.0;  // that a drive may be [deg C]
constexpr double zero_celsius = 273.15;             // [K]

/// Channels of one kind with their names.
struct ChannelGroup {
  const MatrixXd* values;
  std::string (JointLog::*name)(Index) const;
};

std::array<ChannelGroup, 4> channel_groups(const JointLog& log) {
  return {{{&log.q, &JointLog::q_name},
           {&log.qd, &JointLog::qd_name},
           {&log.tau, &JointLog::tau_name},
           {&log.temperature, &JointLog::temperature_name}}};
}

// Rows

void name_missing(const JointLog& log, std::vector<char>& keep, std::vector<LogFinding>& out) {
  const auto scan = [&](const auto& column, const std::string& name, Index joint) {
    Index first = -1, last = -1, count = 0;
    for (Index i = 0; i < log.t.size(); ++i)
      if (!std::isfinite(column[i])) {
        keep[static_cast<std::size_t>(i)] = 0;
        if (first < 0) first = i;
        last = i;
        ++count;
      }
    if (count == 0) return;
    LogFinding f{LogFault::NotFinite, LogSeverity::Error,         name, static_cast<int>(joint + 1), log.t[first],
                 log.t[last],         static_cast<double>(count), ""};
    f.text = name + ": no number in " + std::to_string(count) + " of " + std::to_string(log.t.size()) +
             " rows, first in row " + std::to_string(first + 1) +
             "; leave them out (leave_out_faulty), or repair the log";
    out.push_back(f);
  };
  scan(log.t, "t", -1);
  for (const ChannelGroup& g : channel_groups(log))
    for (Index j = 0; j < g.values->cols(); ++j) scan(g.values->col(j), (log.*g.name)(j), j);
}

LogFinding clock_finding(LogFault fault, LogSeverity severity, double from, double to, double value,
                         const std::string& text) {
  return {fault, severity, "t", 0, from, to, value, "t: " + text};
}

/// Rows in ascending order of time, each time once.
std::vector<Index> ordered_rows(const JointLog& log, const std::vector<char>& keep, std::vector<LogFinding>& out) {
  std::vector<Index> rows;
  for (Index i = 0; i < log.t.size(); ++i)
    if (keep[static_cast<std::size_t>(i)]) rows.push_back(i);
  Index backward = 0, first_back = -1;
  for (std::size_t k = 1; k < rows.size(); ++k)
    if (log.t[rows[k]] < log.t[rows[k - 1]]) {
      if (backward++ == 0) first_back = rows[k];
    }
  if (backward > 0) {
    const bool few = static_cast<double>(backward) <= few_backward * static_cast<double>(rows.size());
    out.push_back(clock_finding(LogFault::ClockBackward, few ? LogSeverity::Warning : LogSeverity::Error,
                                log.t[first_back], log.t[first_back], static_cast<double>(backward),
                                "time goes back " + std::to_string(backward) + " times, first in row " +
                                    std::to_string(first_back + 1) +
                                    (few ? "; the rows were sorted" : "; are these several logs in one file?")));
    std::stable_sort(rows.begin(), rows.end(), [&](Index a, Index b) { return log.t[a] < log.t[b]; });
  }
  std::vector<Index> single;
  double first_double = 0.0;
  for (const Index row : rows) {
    if (!single.empty() && log.t[row] == log.t[single.back()]) {
      if (single.size() + 1 < rows.size() && first_double == 0.0) first_double = log.t[row];
      continue;
    }
    single.push_back(row);
  }
  if (const std::size_t doubles = rows.size() - single.size(); doubles > 0)
    out.push_back(clock_finding(LogFault::ClockDuplicate, LogSeverity::Warning, first_double, first_double,
                                static_cast<double>(doubles),
                                std::to_string(doubles) + " rows have the time of the row before, first at " +
                                    short_number(first_double) + " s; they were left out"));
  return single;
}

void check_steps(const OrderedLog& data, const ConditioningOptions& options, std::vector<LogFinding>& out) {
  const VectorXd& t = data.log.t;
  Index gaps = 0, at = 0;
  double widest = 0.0, uneven = 0.0;
  for (Index i = 1; i < t.size(); ++i) {
    const double step = t[i] - t[i - 1];
    if (step > longest_step(data, options)) {
      ++gaps;
      if (step > widest) widest = step, at = i;
    } else {
      uneven += std::abs(step - data.step);
    }
  }
  if (gaps > 0)
    out.push_back(clock_finding(LogFault::ClockGap, LogSeverity::Warning, t[at - 1], t[at], widest,
                                std::to_string(gaps) + " gaps, the widest of " + short_number(widest) + " s from " +
                                    short_number(t[at - 1]) + " s; a run ends at each"));
  const double mean = uneven / (static_cast<double>(t.size()) * data.step);
  if (mean > even_steps)
    out.push_back(clock_finding(LogFault::ClockJitter, LogSeverity::Note, t[0], t[t.size() - 1], mean,
                                "steps differ from their median, " + short_number(1e3 * data.step) + " ms, by " +
                                    short_number(100 * mean) + " % on average; the rows were resampled at even steps"));
}

// Speeds

struct Alignment {
  double lag = 0.0;          ///< Rows by which the second signal is late.
  double correlation = 0.0;  ///< There.
  double scale = 0.0;        ///< Second over first, there.
};

/// The shift at which |correlation| of two signals is greatest.
Alignment align_signals(const VectorXd& a, const VectorXd& b, Index most) {
  const Index n = a.size();
  most = std::min(most, n / 4);
  const auto at = [&](Index lag) {
    const Index size = n - std::abs(lag);
    VectorXd x = a.segment(std::max<Index>(0, -lag), size), y = b.segment(std::max<Index>(0, lag), size);
    x.array() -= x.mean();
    y.array() -= y.mean();
    const double xx = x.squaredNorm(), yy = y.squaredNorm(), xy = x.dot(y);
    return Alignment{static_cast<double>(lag), xy / std::sqrt(std::max(xx * yy, 1e-300)), xy / std::max(xx, 1e-300)};
  };
  const Index stride = std::max<Index>(1, most / 25);
  Alignment best = at(0);
  const auto search = [&](Index from, Index to, Index by) {
    for (Index lag = from; lag <= to; lag += by) {
      const Alignment now = at(lag);
      if (std::abs(now.correlation) > std::abs(best.correlation)) best = now;
    }
  };
  search(-most, most, stride);
  const auto coarse = static_cast<Index>(best.lag);
  if (stride > 1) search(std::max(-most, coarse - stride), std::min(most, coarse + stride), 1);
  const auto peak = static_cast<Index>(best.lag);
  if (std::abs(peak) < most) {
    const double left = std::abs(at(peak - 1).correlation), top = std::abs(best.correlation),
                 right = std::abs(at(peak + 1).correlation);
    const double bend = left - 2 * top + right;
    if (bend < 0) best.lag += std::clamp(0.5 * (left - right) / bend, -0.5, 0.5);
  }
  return best;
}

std::string scale_text(double scale) {
  if (std::abs(scale / degrees_per_radian - 1) < 0.1) return "; are they degrees per second?";
  if (std::abs(scale * degrees_per_radian - 1) < 0.1) return "; are the positions degrees?";
  if (std::abs(scale / 1000 - 1) < 0.1 || std::abs(scale * 1000 - 1) < 0.1) return "; is one of them in mm?";
  return "; is it a motor-side speed, or is the clock of another unit?";
}

/// @param derivative Of the positions; @param logged Speeds, smoothed alike; both of one run.
void check_speed_of(const OrderedLog& data, const MatrixXd& derivative, const MatrixXd& logged, Index j,
                    const ConditioningOptions& options, std::vector<LogFinding>& out) {
  const Index last = data.rows() - 1, most = static_cast<Index>(max_delay / data.step);
  const Alignment own = align_signals(derivative.col(j), logged.col(j), most);
  const std::string name = data.log.qd_name(j);
  const auto add = [&](LogFault fault, LogSeverity severity, double value, const std::string& text) {
    LogFinding f = finding_at(data, fault, severity, name, j, 0, last);
    f.value = value;
    f.text = name + ": " + text;
    out.push_back(f);
  };
  if (std::abs(own.correlation) < derivative_correlation) {
    std::string other;
    for (Index k = 0; k < data.log.q.cols(); ++k)
      if (k != j && align_signals(derivative.col(k), logged.col(j), most).correlation > 0.97)
        other = "; it is that of " + data.log.q_name(k) + ": columns are swapped";
    add(LogFault::SpeedUnrelated, LogSeverity::Error, own.correlation,
        "not the derivative of " + data.log.q_name(j) + " (correlation " + short_number(own.correlation) + ")" +
            (other.empty() ? "; is it the right column?" : other));
    return;
  }
  if (own.scale < 0)
    add(LogFault::SpeedSign, LogSeverity::Error, own.scale,
        "opposite sign to the derivative of " + data.log.q_name(j) + "; reverse one of both");
  // Noise makes the slope smaller, the more the lower the correlation.
  if (std::abs(std::abs(own.scale) - 1) > speed_scale_tolerance + 2 * (1 - std::abs(own.correlation)))
    add(LogFault::SpeedScale, LogSeverity::Error, own.scale,
        short_number(own.scale) + " times the derivative of " + data.log.q_name(j) + scale_text(std::abs(own.scale)));
  if (const double delay = own.lag * data.step; std::abs(own.lag) > 1.5 && std::abs(delay) > 1e-3)
    add(LogFault::SpeedDelay, options.speeds == SpeedSource::Logged ? LogSeverity::Error : LogSeverity::Warning, delay,
        short_number(1e3 * delay) + " ms behind the derivative of " + data.log.q_name(j) +
            (options.speeds == SpeedSource::Logged ? "; take speeds from positions" : "; speeds come from positions"));
}

// Flat channels

struct FlatSpan {
  Index first, last;
  Index size() const { return last - first + 1; }
};

/// Spans of equal neighbours, single values included.
std::vector<FlatSpan> flat_spans(const Eigen::Ref<const VectorXd>& x) {
  std::vector<FlatSpan> out;
  for (Index i = 0; i < x.size();) {
    Index end = i;
    while (end + 1 < x.size() && x[end + 1] == x[i]) ++end;
    out.push_back({i, end});
    i = end + 1;
  }
  return out;
}

/// Length that nine of ten values of a quantised channel stay below, with which a flat span is compared.
double usual_length(const std::vector<FlatSpan>& spans) {
  std::vector<double> lengths;
  for (const FlatSpan& s : spans) lengths.push_back(static_cast<double>(s.size()));
  const auto at = lengths.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(lengths.size() - 1));
  std::nth_element(lengths.begin(), at, lengths.end());
  return *at;
}

/// Least change of a channel from row to row.
double resolution(const Eigen::Ref<const VectorXd>& x) {
  double out = std::numeric_limits<double>::infinity();
  for (Index i = 1; i < x.size(); ++i)
    if (x[i] != x[i - 1]) out = std::min(out, std::abs(x[i] - x[i - 1]));
  return out;
}

/// Whether a span is flat because a channel of coarse resolution turns there: it then stays near for longer by two
/// fifths at least, while a clipped one leaves at once.
bool turns_at(const Eigen::Ref<const VectorXd>& x, const FlatSpan& s, double step) {
  constexpr double longer = 1.25;
  const auto near = [&](Index i) { return std::abs(x[i] - x[s.first]) <= 1.01 * step; };
  Index first = s.first, last = s.last;
  while (first > 0 && near(first - 1)) --first;
  while (last + 1 < x.size() && near(last + 1)) ++last;
  return static_cast<double>(last - first + 1) > longer * static_cast<double>(s.size());
}

double moved_within(const MatrixXd& q, const FlatSpan& s) {
  double out = 0.0;
  for (Index j = 0; j < q.cols(); ++j) {
    const auto part = q.col(j).segment(s.first, s.size());
    out = std::max(out, part.maxCoeff() - part.minCoeff());
  }
  return out;
}

/// Whether a position that stood in a span jumps at its end, where those that follow move on smoothly.
bool jumps_after(const Eigen::Ref<const VectorXd>& q, const FlatSpan& s) {
  const Index next = s.last + 1, beyond = std::min<Index>(q.size() - 1, next + 6);
  if (beyond <= next + 1) return false;
  double usual = 0.0;
  for (Index i = next; i < beyond; ++i) usual = std::max(usual, std::abs(q[i + 1] - q[i]));
  const double jump = std::abs(q[next] - q[s.last]);
  return jump > 1e-3 && jump > 6 * usual;
}

void report_flat(OrderedLog& data, LogFault fault, const std::string& name, Index joint,
                 const std::vector<FlatSpan>& spans, const std::string& what, std::vector<LogFinding>& out) {
  if (spans.empty()) return;
  const FlatSpan longest =
      *std::max_element(spans.begin(), spans.end(), [](auto& a, auto& b) { return a.size() < b.size(); });
  for (const FlatSpan& s : spans) std::fill(data.faulty.begin() + s.first, data.faulty.begin() + s.last + 1, char{1});
  LogFinding f = finding_at(data, fault, LogSeverity::Error, name, joint, longest.first, longest.last);
  f.value = static_cast<double>(spans.size());
  f.text = name + ": " + what + " from " + short_number(f.begin) + " to " + short_number(f.end) + " s" +
           (spans.size() > 1 ? " and in " + std::to_string(spans.size() - 1) + " other spans" : "") +
           "; leave these out (leave_out_faulty)";
  out.push_back(f);
}

void check_torque_channel(OrderedLog& data, Index j, std::vector<LogFinding>& out) {
  const auto x = data.log.tau.col(j);
  const double low = x.minCoeff(), high = x.maxCoeff();
  if (low == high) {
    if (moved_within(data.log.q, {0, data.rows() - 1}) > standing_range)
      report_flat(data, LogFault::Frozen, data.log.tau_name(j), j, {{0, data.rows() - 1}},
                  "always " + short_number(low) + " although the arm moves", out);
    return;
  }
  const double step = resolution(x);
  const std::vector<FlatSpan> spans = flat_spans(x);
  const double usual = usual_length(spans);
  std::vector<FlatSpan> saturated, frozen;
  for (const FlatSpan& s : spans) {
    const double length = static_cast<double>(s.size()), value = x[s.first];
    const bool extreme = (value == low || value == high) && value != 0.0;
    const bool moving = moved_within(data.log.q, s) > standing_range;
    if (!moving || turns_at(x, s, step)) continue;  // at rest a torque without noise is constant
    if (extreme && length >= 5 * std::max(usual, 1.0))
      saturated.push_back(s);
    else if (length >= 10 * std::max(usual, 1.0) && length * data.step > 0.05)
      frozen.push_back(s);
  }
  report_flat(data, LogFault::Saturated, data.log.tau_name(j), j, saturated,
              "flat at its extreme" + (saturated.empty() ? "" : ", " + short_number(x[saturated[0].first]) + ","), out);
  report_flat(data, LogFault::Frozen, data.log.tau_name(j), j, frozen, "does not change although the arm moves", out);
}

void check_position_channel(OrderedLog& data, Index j, std::vector<LogFinding>& out) {
  const auto x = data.log.q.col(j);
  if (x.maxCoeff() == x.minCoeff()) return;  // never_moved
  std::vector<FlatSpan> frozen;
  for (const FlatSpan& s : flat_spans(x)) {
    const double length = static_cast<double>(s.size());
    if (length < 10) continue;
    double travelled = 0.0;
    const Index late = static_cast<Index>(max_delay / data.step);  // logged speeds may be late
    if (data.log.qd.size() > 0 && s.size() > late)
      travelled = std::abs(data.log.qd.col(j).segment(s.first + late, s.size() - late).sum()) * data.step;
    if (jumps_after(x, s) || travelled > 0.01) frozen.push_back(s);
  }
  report_flat(data, LogFault::Frozen, data.log.q_name(j), j, frozen, "does not change although the joint moves", out);
}

// Smoothing

/// The sound runs of a log at even steps, one after the other.
struct EvenLog {
  OrderedLog data;
  std::vector<RowRange> runs;
};

EvenLog even_log(const OrderedLog& data, const ConditioningOptions& options) {
  EvenLog out;
  std::vector<EvenRun> parts;
  Index rows = 0;
  bool even_clock = false;
  for (const RowRange& run : log_runs(data, longest_step(data, options), min_rows)) {
    parts.push_back(even_run(data, run, options.clock, even_clock));
    out.runs.push_back({rows, rows + parts.back().t.size()});
    rows = out.runs.back().last;
  }
  out.data.step = parts.empty() ? data.step : parts.front().step;
  out.data.faulty.assign(static_cast<std::size_t>(rows), 0);
  JointLog& log = out.data.log;
  log.q_names = data.log.q_names, log.qd_names = data.log.qd_names, log.tau_names = data.log.tau_names;
  log.t.resize(rows);
  log.q.resize(rows, data.log.q.cols());
  log.tau.resize(rows, data.log.q.cols());
  if (data.log.qd.size() > 0) log.qd.resize(rows, data.log.q.cols());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const Index first = out.runs[k].first, size = out.runs[k].size();
    log.t.segment(first, size) = parts[k].t;
    log.q.middleRows(first, size) = parts[k].q;
    log.tau.middleRows(first, size) = parts[k].tau;
    if (log.qd.size() > 0) log.qd.middleRows(first, size) = parts[k].qd;
  }
  return out;
}

SmoothedLog smoothed(const EvenLog& even, const ConditioningOptions& options) {
  const JointLog& log = even.data.log;
  const double step = even.data.step;
  SmoothedLog out;
  out.q = out.qd = out.qdd = out.tau = MatrixXd::Zero(log.t.size(), log.q.cols());
  out.run.assign(static_cast<std::size_t>(log.t.size()), -1);
  for (const RowRange& r : even.runs)
    if (r.size() > out.longest.size()) out.longest = r;
  const MatrixXd longest = log.q.middleRows(out.longest.first, out.longest.size());
  // Never above what the motion needs: in accelerations that are noise any delay seems to fit.
  const double bandwidth = 5 * motion_bandwidth(longest, step);
  out.cutoff = std::min({options.cutoff > 0 ? options.cutoff : bandwidth, bandwidth, 0.4 / step});
  for (std::size_t k = 0; k < even.runs.size(); ++k) {
    const Index first = even.runs[k].first, size = even.runs[k].size();
    const MatrixXd q = zero_phase_low_pass(log.q.middleRows(first, size), step, out.cutoff);
    out.q.middleRows(first, size) = q;
    out.qd.middleRows(first, size) = central_differences(q, step);
    out.qdd.middleRows(first, size) = second_differences(q, step);
    out.tau.middleRows(first, size) = zero_phase_low_pass(log.tau.middleRows(first, size), step, out.cutoff);
    std::fill(out.run.begin() + first, out.run.begin() + first + size, static_cast<int>(k));
  }
  return out;
}

void check_temperatures(const OrderedLog& data, std::vector<LogFinding>& out) {
  const MatrixXd& all = data.log.temperature;
  for (Index j = 0; j < all.cols(); ++j) {
    Index coldest_row = 0, hottest_row = 0;
    const double low = all.col(j).minCoeff(&coldest_row), high = all.col(j).maxCoeff(&hottest_row);
    if (low >= coldest && high <= hottest) continue;
    const Index at = high > hottest ? hottest_row : coldest_row;
    const bool kelvin = low - zero_celsius >= coldest && high - zero_celsius <= hottest;
    LogFinding f =
        finding_at(data, LogFault::TemperatureRange, LogSeverity::Error, data.log.temperature_name(j), j, at, at);
    f.value = all(at, j);
    f.text = f.column + ": " + short_number(low) + " to " + short_number(high) + ", expected " + short_number(coldest) +
             " to " + short_number(hottest) + " deg C" +
             (kelvin ? "; kelvins for degrees Celsius? state the unit" : "; check unit and column");
    out.push_back(f);
  }
}

/// Spans that the checks of torques found faulty, in the rows of the log.
void mark_faulty(const EvenLog& even, OrderedLog& data) {
  Index k = 0;
  for (Index i = 0; i < data.rows() && k < even.data.rows(); ++i) {
    while (k + 1 < even.data.rows() && even.data.log.t[k + 1] <= data.log.t[i]) ++k;
    if (even.data.faulty[static_cast<std::size_t>(k)]) data.faulty[static_cast<std::size_t>(i)] = 1;
  }
}

}  // namespace

double longest_step(const OrderedLog& data, const ConditioningOptions& options) {
  return std::max(options.max_gap * data.step, bridged_gap);
}

std::vector<RowRange> log_runs(const OrderedLog& data, double longest_step, Index least) {
  std::vector<RowRange> out;
  const VectorXd& t = data.log.t;
  const auto faulty = [&](Index i) { return data.faulty[static_cast<std::size_t>(i)] != 0; };
  Index first = 0;
  for (Index i = 1; i <= t.size(); ++i) {
    if (i < t.size() && t[i] - t[i - 1] <= longest_step && faulty(i) == faulty(i - 1)) continue;
    if (i - first >= least && !faulty(first)) out.push_back({first, i});
    first = i;
  }
  return out;
}

bool SmoothedLog::inside(Index row, Index margin) const {
  if (row < margin || row + margin >= q.rows()) return false;
  const auto at = [&](Index i) { return run[static_cast<std::size_t>(i)]; };
  return at(row) >= 0 && at(row - margin) == at(row) && at(row + margin) == at(row);
}

LogFinding finding_at(const OrderedLog& data, LogFault fault, LogSeverity severity, const std::string& column,
                      Index joint, Index first, Index last) {
  return {fault, severity, column, static_cast<int>(joint + 1), data.log.t[first], data.log.t[last], 0.0, ""};
}

bool OrderedLog::slide(Index joint, const ConditioningOptions& options) const {
  return std::find(options.slides.begin(), options.slides.end(), static_cast<int>(joint + 1)) != options.slides.end();
}

void check_positions(const OrderedLog& data, const ConditioningOptions& options, std::vector<LogFinding>& out) {
  const bool limited = options.lower.size() > 0;
  const double turn = 2 * std::numbers::pi;
  for (Index j = 0; j < data.log.q.cols(); ++j) {
    const auto x = data.log.q.col(j);
    Index at = 0, other = 0;
    const double high = x.maxCoeff(&at), low = x.minCoeff(&other);
    const std::string name = data.log.q_name(j);
    if (high - low < standing_range) {
      LogFinding f = finding_at(data, LogFault::NeverMoved, LogSeverity::Warning, name, j, 0, data.rows() - 1);
      f.value = high - low;
      f.text = name + ": never moved (" + short_number(high - low) +
               "); its friction, rotor and part of its inertia cannot be identified";
      out.push_back(f);
    }
    if (!limited && data.slide(j, options)) continue;
    const double lower = limited ? options.lower[j] : -turn, upper = limited ? options.upper[j] : turn;
    const double room = limited && std::isfinite(upper - lower) ? 0.05 * (upper - lower) + 0.01 : 0.1;
    if (low >= lower - room && high <= upper + room) continue;
    if (high - upper < lower - low) at = other;
    const bool degrees = !data.slide(j, options) && low / degrees_per_radian >= lower - room &&
                         high / degrees_per_radian <= upper + room;
    const bool sure = limited || std::max(std::abs(low), std::abs(high)) > 3 * turn;
    LogFinding f = finding_at(data, degrees ? LogFault::Degrees : LogFault::PositionRange,
                              sure ? LogSeverity::Error : LogSeverity::Warning, name, j, at, at);
    f.value = x[at];
    f.text = name + ": " + short_number(low) + " to " + short_number(high) + ", expected " + short_number(lower) +
             " to " + short_number(upper) + (data.slide(j, options) ? " m" : " rad") +
             (degrees ? "; degrees for radians? state the unit" : "; check unit, column and limits");
    out.push_back(f);
  }
}

void check_speeds(const OrderedLog& data, const SmoothedLog& smooth, const ConditioningOptions& options,
                  std::vector<LogFinding>& out) {
  if (data.log.qd.size() == 0 || smooth.longest.size() < min_rows) return;
  const MatrixXd logged = zero_phase_low_pass(data.log.qd.middleRows(smooth.longest.first, smooth.longest.size()),
                                              data.step, smooth.cutoff);
  const MatrixXd derivative = smooth.qd.middleRows(smooth.longest.first, smooth.longest.size());
  for (Index j = 0; j < data.log.q.cols(); ++j) {
    const auto x = data.log.q.col(j);
    const bool stands = x.maxCoeff() - x.minCoeff() < standing_range;
    const double travel = standard_deviation(logged.col(j)) * (data.log.t[data.rows() - 1] - data.log.t[0]);
    if (stands && travel > 10 * standing_range && standard_deviation(logged.col(j)) > 1e-2) {
      LogFinding f = finding_at(data, LogFault::Frozen, LogSeverity::Error, data.log.q_name(j), j, 0, data.rows() - 1);
      f.text = data.log.q_name(j) + ": stands although " + data.log.qd_name(j) + " shows motion; it is frozen";
      out.push_back(f);
    }
    if (!stands) check_speed_of(data, derivative, logged, j, options, out);
  }
}

void check_flat_channels(OrderedLog& data, std::vector<LogFinding>& out) {
  for (Index j = 0; j < data.log.q.cols(); ++j) {
    check_position_channel(data, j, out);
    check_torque_channel(data, j, out);
  }
}

LogScan scan_log(const JointLog& log, const ConditioningOptions& options) {
  require(options.lower.size() == 0 || options.lower.size() == log.joints(), "lower, upper: one limit a joint");
  require(options.expected_torque.size() == 0 || options.expected_torque.size() == log.joints(),
          "expected_torque: one number a joint");
  LogScan out;
  std::vector<char> keep(static_cast<std::size_t>(log.t.size()), 1);
  name_missing(log, keep, out.findings);
  OrderedLog& data = out.ordered;
  data.log = log.with_rows(ordered_rows(log, keep, out.findings));
  data.faulty.assign(static_cast<std::size_t>(data.rows()), 0);
  if (data.rows() < min_rows) return out;
  std::vector<double> steps;
  for (Index i = 1; i < data.rows(); ++i) steps.push_back(data.log.t[i] - data.log.t[i - 1]);
  data.step = median(steps);
  check_steps(data, options, out.findings);
  check_positions(data, options, out.findings);
  check_temperatures(data, out.findings);
  check_flat_channels(data, out.findings);

  EvenLog even = even_log(data, options);
  if (even.runs.empty()) return out;
  const SmoothedLog smooth = smoothed(even, options);
  check_speeds(even.data, smooth, options, out.findings);
  check_torques(even.data, smooth, options, out.findings);
  mark_faulty(even, data);
  return out;
}

}  // namespace kr5::identification

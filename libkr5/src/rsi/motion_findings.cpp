// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/motion_findings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "rsi/tool_correction.hpp"
#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

constexpr double least_correction = 2e-5;  // that is a test [rad or m]
constexpr double settling = 0.4;           // after a correction [s]
constexpr double certain = 5.0;            // standard deviations of noise beyond which something moved
constexpr std::size_t least_rest = 10;     // telegrams before a correction by which the noise is judged

/// Corrections and the motions that they made, a row a telegram.
struct CorrectionSeries {
  bool joints = true;
  std::vector<double> time;          ///< [s]
  std::vector<Vector6> corrections;  ///< Beside the first one, which may hold from before [rad or m].
  std::vector<Vector6> motions;      ///< Beside the programmed path, or the first telegram [rad or m].
};

Vector6 motion_of(const ControllerState& state, const ControllerState& first, const CorrectionSeries& series,
                  robot::CommandFrame frame) {
  if (!series.joints) return tool_correction(state.tool_setpoint.value_or(*first.tool), *state.tool, frame);
  const robot::JointVector& path = state.joint_setpoints.size() >= 6 ? state.joint_setpoints : first.joints;
  return state.joints.head(6) - path.head(6);
}

CorrectionSeries correction_series(const ReadObservations& read) {
  const TelegramUnits units(read.layout);
  CorrectionSeries out{.joints = units.corrects_joints()};
  const ControllerState* first = nullptr;
  Vector6 whole = Vector6::Zero();
  std::optional<Vector6> before;
  for (const ReadTelegram& t : read.telegrams) {
    const ControllerState& state = t.state;
    if (!t.complete || (out.joints ? state.joints.size() < 6 : !state.tool)) continue;
    if (!first) first = &state;
    if (t.correction) {
      const Vector6 told = out.joints ? Vector6(t.correction->joints.head(6)) : to_vector(*t.correction->tool);
      whole = read.options.mode == robot::CommandMode::Relative ? Vector6(whole + told) : told;
      if (!before) before = whole;
    }
    out.time.push_back(t.exchange->time);
    out.corrections.push_back(before ? Vector6(whole - *before) : Vector6(Vector6::Zero()));
    out.motions.push_back(motion_of(state, *first, out, read.options.frame));
  }
  return out;
}

/// Where one component alone is corrected, with what follows until the arm is at rest; the rows before are its rest.
struct TestSpan {
  int component = 0;
  std::size_t rest = 0, begin = 0, end = 0;
};

/// The component that is corrected; -1: none, -2: several.
int corrected_component(const Vector6& correction) {
  const auto moved = correction.array().abs() > 0.01 * least_correction;
  if (moved.count() == 0) return -1;
  Eigen::Index component = 0;
  correction.cwiseAbs().maxCoeff(&component);
  return moved.count() == 1 ? static_cast<int>(component) : -2;
}

std::vector<TestSpan> test_spans(const CorrectionSeries& series) {
  std::vector<TestSpan> out;
  const std::size_t n = series.time.size();
  for (std::size_t i = 0; i < n;) {
    const std::size_t rest = i;
    while (i < n && corrected_component(series.corrections[i]) == -1) ++i;
    TestSpan span{.rest = rest, .begin = i};
    if (i == n) break;
    span.component = corrected_component(series.corrections[i]);
    double most = 0.0;
    while (i < n && corrected_component(series.corrections[i]) == span.component) {
      if (span.component >= 0) most = std::max(most, std::abs(series.corrections[i][span.component]));
      ++i;
    }
    const double over = i < n ? series.time[i] + settling : 0.0;
    while (i < n && series.time[i] < over && corrected_component(series.corrections[i]) == -1) ++i;
    span.end = i;
    if (span.component >= 0 && most >= least_correction && span.begin - span.rest >= least_rest) out.push_back(span);
  }
  return out;
}

/// Motion of each component over the correction of one: by their sums, which no lag of the arm changes.
struct ComponentGains {
  Vector6 gain;
  std::array<bool, 6> moved{};
};

double wire_step(const CorrectionSeries& series, int component, int decimals) {
  return std::pow(10.0, -decimals) * (series.joints || component >= 3 ? degree : millimetre);
}

ComponentGains gains_of(const CorrectionSeries& series, const TestSpan& span, int decimals) {
  const auto rest = static_cast<double>(span.begin - span.rest), rows = static_cast<double>(span.end - span.begin);
  Vector6 mean = Vector6::Zero(), square = Vector6::Zero(), sum = Vector6::Zero();
  for (std::size_t i = span.rest; i < span.begin; ++i) mean += series.motions[i] / rest;
  for (std::size_t i = span.rest; i < span.begin; ++i) square += (series.motions[i] - mean).cwiseAbs2() / (rest - 1);
  double correction = 0.0;
  for (std::size_t i = span.begin; i < span.end; ++i) {
    sum += series.motions[i] - mean;
    correction += series.corrections[i][span.component];
  }
  ComponentGains out{.gain = sum / correction};
  for (int k = 0; k < 6; ++k) {
    const double noise = std::max(std::sqrt(square[k]), wire_step(series, k, decimals));
    out.moved[static_cast<std::size_t>(k)] =
        std::abs(sum[k]) > certain * noise * (std::sqrt(rows) + rows / std::sqrt(rest));
  }
  return out;
}

std::string component_name(const CorrectionSeries& series, int component) {
  constexpr std::array<const char*, 6> axes = {"A1", "A2", "A3", "A4", "A5", "A6"};
  constexpr std::array<const char*, 6> tool = {"X", "Y", "Z", "A", "B", "C"};
  if (series.joints) return axes[static_cast<std::size_t>(component)];
  return tool[static_cast<std::size_t>(component < 3 ? component : 8 - component)];  // about x, y, z: C, B, A
}

bool is_near(double gain, double expected, double tolerance) { return std::abs(gain / expected - 1.0) <= tolerance; }

/// What one test says; nothing where the arm did as corrected.
std::optional<LinkFinding> judged(const CorrectionSeries& series, const TestSpan& span, const ComponentGains& gains,
                                  double tolerance) {
  const int tested = span.component;
  const double own = gains.gain[tested];
  LinkFinding out{.kind = LinkFindingKind::CorrectionIgnored, .count = 1, .first = series.time[span.begin]};
  out.names = {component_name(series, tested)};
  if (std::ranges::none_of(gains.moved, [](bool moved) { return moved; })) return out;
  Eigen::Index most = 0;
  Vector6 size = gains.gain.cwiseAbs();
  for (int k = 0; k < 6; ++k) size[k] *= gains.moved[static_cast<std::size_t>(k)] ? 1.0 : 0.0;
  size.maxCoeff(&most);
  out.gain = own;
  const double unit = series.joints || tested >= 3 ? 1.0 / degree : 1.0 / millimetre;
  if (most != tested && size[tested] < 0.5 * size[most]) {
    out.kind = LinkFindingKind::CorrectionAxis;
    out.gain = gains.gain[most];
    out.names.push_back(component_name(series, static_cast<int>(most)));
  } else if (is_near(own, 1.0, tolerance)) {
    return std::nullopt;
  } else if (is_near(own, -1.0, tolerance)) {
    out.kind = LinkFindingKind::CorrectionSign;
  } else {
    const bool other_unit = is_near(own, unit, tolerance) || is_near(own, 1.0 / unit, tolerance);
    out.kind = other_unit ? LinkFindingKind::CorrectionUnit : LinkFindingKind::CorrectionScale;
  }
  return out;
}

/// Components with the same fault are one finding, unless each has another component to name.
void add_judged(const LinkFinding& finding, Findings& to) {
  const auto same = std::ranges::find(to, finding.kind, &LinkFinding::kind);
  if (same == to.end() || finding.kind == LinkFindingKind::CorrectionAxis ||
      finding.kind == LinkFindingKind::CorrectionScale)
    return to.push_back(finding);
  same->names.push_back(finding.names.front());
  ++same->count;
}

}  // namespace

Findings motion_findings(const ReadObservations& read, bool& compared) {
  const TelegramUnits units(read.layout);
  if (!units.corrects_joints() && !units.corrects_tool()) return {};
  const CorrectionSeries series = correction_series(read);
  Findings out;
  for (const TestSpan& span : test_spans(series)) {
    compared = true;
    const ComponentGains gains = gains_of(series, span, read.layout.decimals);
    if (const auto finding = judged(series, span, gains, read.options.gain_tolerance)) add_judged(*finding, out);
  }
  return out;
}

}  // namespace kr5::rsi

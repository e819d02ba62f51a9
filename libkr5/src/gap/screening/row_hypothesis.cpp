// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/row_hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <kr5/cell/cell.hpp>

namespace kr5::gap {
namespace {

using cell::CoordinateKind;
using cell::EffectParameter;
using cell::EffectSite;
using cell::EffectValue;
using Point = Eigen::VectorXd;

/// Least first coordinate of an effect that is linear in products with it, by which one divides.
constexpr double min_factor = 1e-3;
/// Coordinate beyond which a reciprocal is taken for nothing: a thousand usual sizes.
constexpr double max_reciprocal = 1e3;
/// Coordinate of a ratio at which it has changed by more than any plausible factor.
constexpr double max_ratio = 20.0;
/// More cycles of delay than any controller has.
constexpr double most_delay_cycles = 40.0;
/// Step of finite differences of a logarithm.
constexpr double logarithm_step = 0.05;

/// A parameter in the coordinates of one hypothesis.
struct SearchedParameter {
  std::string name;
  CoordinateKind coordinate = CoordinateKind::None;
  bool vector = false;
  Eigen::Index first = 0;  ///< Its first coordinate.
  Eigen::Index count = 0;  ///< Number of its coordinates.
  double off = 0.0;
  double size = 1.0;
  double whole = 0.0;  ///< Value of a choice, or of cycles.
  cell::ValueRange range = {};
  Pose nominal = Pose::Identity();
  Eigen::VectorXd nominal_vector;  ///< Of a vector that replaces one of the cell; otherwise zero.
};

Eigen::Index components(const EffectParameter& p) {
  using enum CoordinateKind;
  switch (p.coordinate) {
    case Linear:
    case Quotient:
      return p.kind == cell::EffectValueKind::Vector3 ? 3 : p.kind == cell::EffectValueKind::Vector2 ? 2 : 1;
    case Ratio:
    case Reciprocal:
    case WholeCycles:
    case Logarithmic:
      return 1;
    case Mount:
      return 6;
    case Amplitude:
      return 2;
    case Phase:
    case Cycles:
    case Choice:
    case None:
      return 0;
  }
  return 0;
}

/// Value of a parameter at x; nothing where that switches it off.
std::optional<EffectValue> value_at(const SearchedParameter& p, const Point& x) {
  using enum CoordinateKind;
  const double first = p.count > 0 ? x(p.first) : 0.0;
  switch (p.coordinate) {
    case Linear:
      if (p.vector) return EffectValue(Eigen::VectorXd(p.nominal_vector + p.size * x.segment(p.first, p.count)));
      return p.off + p.size * first;
    case Ratio:
      return p.off * std::exp(p.size * first);
    case Reciprocal:
      if (!(first > 0)) return std::nullopt;
      return 1 / (p.size * first);
    case WholeCycles:
      return std::max(p.off + p.size * std::round(first), p.range.lower);
    case Logarithmic:
      return std::exp(first);
    case Quotient: {
      const Eigen::VectorXd quotient = (p.size * x.segment(p.first, p.count) / std::max(x(0), min_factor))
                                           .cwiseMax(p.range.lower)
                                           .cwiseMin(p.range.upper);
      if (p.vector) return EffectValue(quotient);
      return quotient(0);
    }
    case Mount: {
      const Vector6 d = p.size * x.segment<6>(p.first);
      return EffectValue(Pose(p.nominal * to_pose(d)));
    }
    case Amplitude:
      return p.size * x.segment<2>(p.first).norm();
    case Phase:
      return std::atan2(x(1), x(0));
    case Cycles:
    case Choice:
      return p.whole;
    case None:
      return std::nullopt;
  }
  return std::nullopt;
}

/// Coordinates of a parameter, with their bounds.
std::vector<Coordinate> coordinates_of(const SearchedParameter& s, const EffectParameter& p) {
  using enum CoordinateKind;
  switch (p.coordinate) {
    case Linear: {
      std::vector<Coordinate> out;
      for (Eigen::Index i = 0; i < s.count; ++i) {
        const double off = s.vector ? s.nominal_vector(i) : s.off;
        out.push_back(
            {.lower = (s.range.lower - off) / s.size, .upper = (s.range.upper - off) / s.size, .step = p.step});
      }
      return out;
    }
    case Ratio: {  // within the range, and 0, where the effect is off
      const auto x_at = [&](double value) { return value > 0 && s.off > 0 ? std::log(value / s.off) / s.size : -1e9; };
      return {{.lower = std::min(std::max(-max_ratio, x_at(s.range.lower)), 0.0),
               .upper = s.off > 0 ? std::max(std::min(max_ratio, x_at(s.range.upper)), 0.0) : max_ratio,
               .step = p.step}};
    }
    case Reciprocal:
      return {{.lower = 0.0,
               .upper = s.range.lower > 0 ? std::min(max_reciprocal, 1 / (s.size * s.range.lower)) : max_reciprocal,
               .step = p.step}};
    case Amplitude: {
      const double most = s.range.upper / (std::sqrt(2.0) * s.size);  // sine and cosine together within the bound
      return std::vector<Coordinate>(static_cast<std::size_t>(s.count),
                                     {.lower = -most, .upper = most, .step = p.step});
    }
    case WholeCycles:
      return {{.lower = -std::round(s.off / s.size), .upper = most_delay_cycles, .step = 1.0, .whole = true}};
    case Logarithmic:
      return {
          {.lower = std::log(s.range.lower), .upper = std::log(s.range.upper), .step = logarithm_step, .shape = true}};
    default:
      return std::vector<Coordinate>(static_cast<std::size_t>(s.count), {.step = p.step});
  }
}

/// Builds one hypothesis of a row.
class RowHypothesis {
 public:
  RowHypothesis(const cell::Effect& effect, const EffectSite& site, const std::string& target)
      : effect_(effect), site_(site) {
    out_.effect = effect.id;
    out_.target = target;
    out_.inaccuracy = effect.inaccuracy;
  }

  void add(const EffectParameter& p, double whole) {
    SearchedParameter s{.name = p.name, .coordinate = p.coordinate};
    s.vector = p.kind == cell::EffectValueKind::Vector2 || p.kind == cell::EffectValueKind::Vector3;
    s.first = out_.size();
    s.count = components(p);
    s.whole = whole;
    if (p.size) s.size = p.size(site_);
    s.nominal_vector = Eigen::VectorXd::Zero(s.count);
    s.range = p.range ? p.range(site_) : cell::ValueRange{p.lower, p.upper};
    if (!p.nominal) {
      s.off = p.off.front();
    } else if (const auto nominal = p.nominal(site_)) {
      if (const auto* T = std::get_if<Pose>(&*nominal)) s.nominal = *T;
      if (const auto* vector = std::get_if<Eigen::VectorXd>(&*nominal)) s.nominal_vector = *vector;
      if (const auto* number = std::get_if<double>(&*nominal)) s.off = *number;
    }
    for (const Coordinate& c : coordinates_of(s, p)) out_.coordinates.push_back(c);
    searched_.push_back(std::move(s));
    rows_.push_back(&p);
  }

  /// Switches a parameter off in the cell of the hypothesis.
  void leave_out(const EffectParameter& p) {
    searched_.push_back({.name = p.name});
    rows_.push_back(&p);
  }

  Hypothesis take() && {
    if (has(CoordinateKind::Quotient)) out_.coordinates.front().lower = min_factor;
    out_.probes = probes();
    out_.apply = [id = effect_.id, target = out_.target, searched = searched_](cell::Cell& c, const Point& x) {
      for (const SearchedParameter& p : searched) cell::set_effect(c, id, target, p.name, value_at(p, x));
    };
    return std::move(out_);
  }

  void choose(const std::string& text, double log_prior) {
    out_.choice = text;
    out_.log_prior = log_prior;
  }

 private:
  bool has(CoordinateKind kind) const {
    return std::any_of(searched_.begin(), searched_.end(),
                       [&](const SearchedParameter& p) { return p.coordinate == kind; });
  }

  /// One point with x of the first coordinate.
  Point point(double first) const {
    Point x = Point::Zero(out_.size());
    x(0) = first;
    return x;
  }

  std::vector<Probe> probes() const {
    for (std::size_t k = 1; k < rows_.size(); ++k) {
      if (rows_[k]->coordinate == CoordinateKind::Logarithmic) return shape_probes(searched_[k], *rows_[k]);
      if (rows_[k]->coordinate == CoordinateKind::Quotient) return quotient_probe(searched_[k], *rows_[k]);
    }
    const Eigen::Index n = out_.size();
    std::vector<double> at = first_points();
    std::vector<Probe> out;
    if (n == 1)
      for (const double first : at) out.push_back({{point(first)}});
    if (!out.empty()) return out;
    Probe linear;
    linear.indivisible = has(CoordinateKind::Amplitude);
    for (Eigen::Index i = 0; i < n; ++i) linear.points.emplace_back(Point::Unit(n, i));
    return {linear};
  }

  /// Where the signature of a single coordinate is taken; empty: at 1.
  std::vector<double> first_points() const {
    for (const EffectParameter* p : rows_) {
      if (p->signature_at) return p->signature_at(site_);
      if (p->coordinate == CoordinateKind::Ratio) return {1.0, -1.0};
      if (p->coordinate == CoordinateKind::Reciprocal) return {0.3, 3.0};
      if (p->coordinate == CoordinateKind::WholeCycles) return {1.0, 4.0};
    }
    return {};
  }

  /// An amplitude with a shape that is no size: the signature is taken at several shapes.
  std::vector<Probe> shape_probes(const SearchedParameter& s, const EffectParameter& p) const {
    std::vector<Probe> out;
    for (const double value : shape_values(s, p)) {
      Point x = point(1.0);
      x(s.first) = std::log(value);
      out.push_back({{x}});
    }
    return out;
  }

  std::vector<double> shape_values(const SearchedParameter& s, const EffectParameter& p) const {
    if (p.signature_at) return p.signature_at(site_);
    constexpr int count = 4;  // spread over the range, where the row names none
    std::vector<double> out;
    for (int i = 0; i < count; ++i)
      out.push_back(s.range.lower * std::pow(s.range.upper / s.range.lower, (i + 0.5) / count));
    return out;
  }

  /// The factor alone and with each component of the quotient, or with values of it that the row names; and with each
  /// coordinate behind it.
  std::vector<Probe> quotient_probe(const SearchedParameter& s, const EffectParameter& p) const {
    Probe out;
    out.indivisible = static_cast<bool>(p.signature_at);
    if (!p.signature_at) out.points.push_back(point(1.0));
    const std::vector<double> values =
        p.signature_at ? p.signature_at(site_) : std::vector<double>(static_cast<std::size_t>(s.count), 1.0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      Point x = point(1.0);
      x(s.first + (p.signature_at ? 0 : static_cast<Eigen::Index>(i))) = values[i] / (p.signature_at ? s.size : 1.0);
      out.points.push_back(x);
    }
    for (Eigen::Index k = s.first + s.count; k < out_.size(); ++k) {
      Point x = point(1.0);
      x(k) = 1.0;
      out.points.push_back(x);
    }
    return {out};
  }

  const cell::Effect& effect_;
  EffectSite site_;
  Hypothesis out_;
  std::vector<SearchedParameter> searched_;
  std::vector<const EffectParameter*> rows_;
};

/// The parameter whose values are hypotheses of their own, or null.
const EffectParameter* choice_of(const cell::Effect& effect) {
  const auto found = std::find_if(effect.parameters.begin(), effect.parameters.end(),
                                  [](const EffectParameter& p) { return p.coordinate == CoordinateKind::Choice; });
  return found == effect.parameters.end() ? nullptr : &*found;
}

/// The parameter without which the effect is a hypothesis, too, or null.
const EffectParameter* addition_of(const cell::Effect& effect) {
  const auto found = std::ranges::find_if(effect.parameters, &EffectParameter::with_and_without);
  return found == effect.parameters.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Hypothesis> row_hypotheses(const cell::Effect& effect, const EffectSite& site, const std::string& target,
                                       int cycles) {
  std::vector<Hypothesis> out;
  if (effect.one_at_a_time) {
    for (const EffectParameter& p : effect.parameters) {
      RowHypothesis h(effect, site, target);
      h.add(p, 0.0);
      h.choose(p.name, -std::log(static_cast<double>(effect.parameters.size())));
      out.push_back(std::move(h).take());
    }
    return out;
  }
  if (const EffectParameter* addition = addition_of(effect)) {
    for (const bool with : {false, true}) {
      RowHypothesis h(effect, site, target);
      for (const EffectParameter& p : effect.parameters)
        if (with || &p != addition)
          h.add(p, 0.0);
        else
          h.leave_out(p);
      h.choose(with ? "with " + addition->name : "", -std::log(2.0));
      out.push_back(std::move(h).take());
    }
    return out;
  }
  std::vector<cell::EffectChoice> choices = {{cycles, ""}};
  const EffectParameter* choice = choice_of(effect);
  if (choice) choices = choice->choices(site);
  for (const cell::EffectChoice& c : choices) {
    EffectSite at = site;
    at.choice = c.value;
    RowHypothesis h(effect, at, target);
    for (const EffectParameter& p : effect.parameters) h.add(p, c.value);
    if (choice) h.choose(c.text, -std::log(static_cast<double>(choices.size())));
    if (effect.periodic()) h.choose(std::to_string(cycles) + (cycles == 1 ? " cycle" : " cycles"), 0.0);
    out.push_back(std::move(h).take());
  }
  return out;
}

}  // namespace kr5::gap

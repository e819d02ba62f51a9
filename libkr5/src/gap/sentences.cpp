// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/sentences.hpp>

#include <algorithm>
#include <functional>
#include <set>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/notes.hpp>
#include <kr5/gap/words.hpp>

#include "gap/wording/number_text.hpp"

namespace kr5::gap {
namespace {

constexpr double noticeable = 1.25;       // times the noise, from which a gap is told although no cause need be found
constexpr double near_noise = 2.0;        // times the noise, up to which a gap is that of noise and small errors
constexpr std::size_t with_value = 2;     // causes whose values stand in the verdict; of more the names alone
constexpr std::ptrdiff_t max_words = 40;  // of a sentence with values, and of a headline
constexpr std::size_t most_named = 3;     // names in a sentence

std::string group_of(const ColumnExcess& p) { return p.experiment + "." + p.column; }

std::string plural(std::size_t count, const std::string& one, const std::string& several) {
  return count == 1 ? one : several;
}

/// A list of which a sentence names the first three.
std::string join_first(std::vector<std::string> items, const std::string& last = "and") {
  const std::size_t count = items.size();
  if (count > most_named) {
    items.resize(most_named);
    items.push_back(std::to_string(count - most_named) + " more (listed below)");
  }
  return join_list(items, last);
}

/// Effects, one text for all targets of each.
std::vector<std::string> grouped_effects(const std::vector<EffectName>& names) {
  std::vector<std::pair<std::string, std::vector<std::string>>> targets;
  for (const EffectName& name : names) {
    auto entry = std::ranges::find_if(targets, [&](const auto& e) { return e.first == name.effect; });
    if (entry == targets.end()) entry = targets.insert(targets.end(), {name.effect, {}});
    if (std::ranges::find(entry->second, name.target) == entry->second.end()) entry->second.push_back(name.target);
  }
  std::vector<std::string> out;
  for (const auto& [effect, of_effect] : targets) out.push_back(effects_text(effect, of_effect));
  return out;
}

/// A part of the cell in a kind of experiment that holds a share of the excess.
struct Place {
  double share = 0.0;
  std::string text;
  double gap = 0.0;  ///< Of its one column; 0: of several.
};

/// One component of the wrench that alone is off, wherever it is recorded; of no share where it is not so.
Place wrench_place(const std::vector<ColumnExcess>& where) {
  Place out;
  std::vector<std::string> kinds;
  for (const ColumnExcess& p : where) {
    if (part_of(group_of(p)) != "sensor" || p.column != where.front().column) return {};
    out.share += p.share;
    for (const auto& [kind, name] : enum_names(cell::Kind{}))
      if (name == p.experiment) kinds.push_back(kind_text(kind));
  }
  if (where.size() < 2) return {};
  out.text = "the " + column_text("motion." + where.front().column) + ", in " + join_list(kinds);
  return out;
}

/// By kind and part, largest share first: a column where one holds most of it.
std::vector<Place> main_places(const std::vector<ColumnExcess>& where) {
  constexpr double most_of_it = 0.75;
  if (const Place wrench = wrench_place(where); wrench.share > 0) return {wrench};
  std::vector<std::pair<std::string, std::vector<const ColumnExcess*>>> parts;
  for (const ColumnExcess& p : where) {
    const std::string key = p.experiment + " " + part_of(group_of(p));
    auto entry = std::ranges::find_if(parts, [&](const auto& e) { return e.first == key; });
    if (entry == parts.end()) entry = parts.insert(parts.end(), {key, {}});
    entry->second.push_back(&p);
  }
  std::vector<Place> out;
  for (const auto& [key, columns] : parts) {
    Place place;
    std::vector<std::string> names;
    const ColumnExcess* top = *std::ranges::max_element(columns, {}, [](const ColumnExcess* p) { return p->share; });
    for (const ColumnExcess* p : columns) {
      place.share += p->share;
      names.push_back(p->column);
    }
    if (top->share > most_of_it * place.share) {
      place.text = "the " + column_text(group_of(*top));
      place.gap = top->gap;
    } else {
      std::string kind = top->experiment;
      for (const auto& [value, name] : enum_names(cell::Kind{}))
        if (name == kind) kind = kind_text(value);
      place.text = "the " + part_text(part_of(group_of(*top))) + " in " + kind + " (" + join_list(names) + ")";
    }
    out.push_back(std::move(place));
  }
  std::ranges::stable_sort(out, std::greater<>(), [](const Place& p) { return p.share; });
  return out;
}

std::string ties_text(const Diagnosis& d) {
  std::set<std::string> ties;
  for (const Cause& cause : d.causes)
    for (const EffectName& tied : cause.tied_with) ties.insert(effect_text(tied));
  if (ties.empty()) return "";
  return "This recording cannot distinguish " + plural(d.causes.size(), "it", "them") + " from " +
         join_first({ties.begin(), ties.end()}, "or") + ".";
}

/// What stays unexplained with the causes, and its pattern.
std::string rest_text(const std::vector<ColumnExcess>& unexplained) {
  std::vector<std::string> names;
  for (const ColumnExcess& p : unexplained) names.push_back(column_text(group_of(p)));
  const std::size_t count = names.size();
  if (count > most_named) {
    names.resize(most_named);
    names.push_back(std::to_string(count - most_named) + " more columns");
  }
  std::string out = "the " + join_list(names);
  if (const ColumnExcess& top = unexplained.front(); !top.depends_on.empty())
    out += std::string("; ") + (count == 1 ? "it " : "the first of them ") +
           dependence_text(top.depends_on.front(), top.experiment);
  return out;
}

/// How far the gap falls with the causes, and what is left.
std::string reduction_text(const Diagnosis& d) {
  std::string out = "With " + plural(d.causes.size(), "it", "them") + " the gap falls from " +
                    gap_text(d.reduction.before) + " to " + format("%.2f", d.reduction.after) +
                    " times the noise on experiments not used to fit; ";
  if (d.verdict != Verdict::Explained && !d.unexplained.empty())
    return out + "structure remains in the residuals of " + rest_text(d.unexplained) + ".";
  return out + (d.reduction.after < near_noise ? "no structure is left in the residuals."
                                               : "what is left is within the accuracy of a simulation.");
}

std::string no_gap_text(const Diagnosis& d) {
  if (d.reduction.before > noticeable)
    return "Simulation and recording agree within " + format("%.1f", d.reduction.before) + " times the noise" +
           (d.excused.empty() ? "." : ", which even a freely fitted arm leaves.");
  if (!d.scope.empty())
    return "Within what the recording can show there is no gap: simulation and recording agree within noise. The rest "
           "of the cell was not tested.";
  return "There is no gap: simulation and recording agree within noise. No correction is needed.";
}

/// Faults of clocks, a sentence each.
std::vector<std::string> faults_texts(const Diagnosis& d) {
  std::vector<std::string> out;
  for (const ClockFault& fault : d.clock_faults) out.push_back(capitalised(fault_text(fault)) + ".");
  return out;
}

/// What the verdict says, in the order in which one needs it: sentences, and those that belong together as one.
std::vector<std::string> verdict_parts(const Diagnosis& d) {
  std::vector<std::string> out;
  const std::vector<std::string> faults = faults_texts(d);
  if (d.verdict == Verdict::NoGap || (d.where.empty() && d.causes.empty())) {
    out.push_back(no_gap_text(d));
  } else if (!d.causes.empty()) {
    out.push_back(causes_text(d));
    out.insert(out.end(), faults.begin(), faults.end());
    out.push_back(reduction_text(d));
    out.push_back(ties_text(d));
    out.push_back(location_text(d.where));
  } else {
    out = faults;
    out.push_back("No effect of the catalogue explains the gap of " + gap_text(d.reduction.before) +
                  " times the noise" + (faults.empty() ? "" : " with these times as they are") +
                  ", so no cause is named.");
    out.push_back(location_text(d.where));
  }
  for (const ScopeLimit& limit : d.scope) out.push_back(capitalised(limit_text(limit)) + ".");
  std::erase(out, "");
  return out;
}

std::ptrdiff_t words_of(const std::string& text) { return 1 + std::ranges::count(text, ' '); }

/// Parts of a verdict that are its headline: the first, and those after it that leave it short.
std::size_t headline_parts(const std::vector<std::string>& parts) {
  std::size_t count = 0;
  for (std::ptrdiff_t words = 0; count < parts.size(); ++count) {
    words += words_of(parts[count]);
    if (count > 0 && words > max_words) break;
  }
  return count;
}

std::string joined(const std::vector<std::string>& parts, std::size_t begin, std::size_t end) {
  std::string out;
  for (std::size_t k = begin; k < end; ++k) out += (out.empty() ? "" : " ") + parts[k];
  return out;
}

/// Where a range of a variable lies.
std::string range_text(const Dependence& d) {
  constexpr const char* either = " or ";  // of revolute and prismatic joints
  const std::string unit = d.unit.substr(0, d.unit.find(either));
  const auto text = [&](double value) { return format("%.3g", value) + (unit.empty() ? "" : " " + unit); };
  if (d.lower && d.upper) return "between " + text(*d.lower) + " and " + text(*d.upper);
  if (d.lower) return "above " + text(*d.lower);
  return d.upper ? "below " + text(*d.upper) : "";
}

std::string differs_text(const Dependence& d, const std::string& name) {
  const std::string effect = "suggests that " + effect_text(d.effect) + " differs ";
  switch (d.variable.kind) {
    case VariableKind::None:
      return effect + "between columns or experiments";
    case VariableKind::Experiment:
      return effect + "between experiments";
    case VariableKind::ExperimentKind:
      return effect + "between kinds of experiments";
    case VariableKind::WhichColumn:
      return effect + "between columns";
    default:
      return effect + "with the " + name;
  }
}

}  // namespace

std::string cause_text(const Cause& cause, const std::vector<std::string>& joint_names) {
  constexpr std::size_t pose = 16;
  std::vector<std::string> said;
  if (std::string joint = joint_name(joint_names, cause.target); !joint.empty()) said.push_back(joint + ";");
  // A choice, as the number of cycles, has no uncertainty.
  const auto known = std::ranges::find_if(cause.parameters, [](const ParameterEstimate& p) {
    return std::ranges::any_of(p.std, [](double s) { return s != 0.0; });
  });
  if (known != cause.parameters.end() && known->value.size() != pose)
    said.push_back(value_text(*known, cause.target) + ",");
  std::string out = effect_text(cause) + " (";
  for (const std::string& part : said) out += part + " ";
  return out + percent_text(cause.probability) + " probable)";
}

std::string causes_text(const Diagnosis& d) {
  if (d.causes.empty()) return "";
  if (d.causes.size() <= with_value) {
    std::vector<std::string> items;
    for (const Cause& cause : d.causes) items.push_back(cause_text(cause, d.joint_names));
    std::string out = plural(items.size(), "Cause: ", "Causes: ") + join_list(items) + ".";
    if (words_of(out) <= max_words) return out;
  }
  std::vector<EffectName> names;
  double least = 1.0;
  for (const Cause& cause : d.causes) {
    names.push_back(cause);
    least = std::min(least, cause.probability);
  }
  return plural(names.size(), "Cause: ", "Causes: ") + join_first(grouped_effects(names)) +
         plural(names.size(), ", ", ", each ") + min_percent_text(least) + " probable.";
}

std::string location_text(const std::vector<ColumnExcess>& where) {
  constexpr double enough = 0.8, alone = 0.95;
  if (where.empty()) return "";
  const std::vector<Place> places = main_places(where);
  const std::vector<Dependence>& depends = where.front().depends_on;
  const auto pattern = [&](const std::string& its) {
    return depends.empty() ? "" : "; " + its + dependence_text(depends.front(), where.front().experiment);
  };
  if (places.front().gap > 0 && (places.front().share > alone || where.size() == 1))
    return "Only " + places.front().text + " disagrees clearly: " + gap_text(places.front().gap) + " times the noise" +
           pattern("its gap ") + ".";
  std::vector<std::string> said;
  double held = 0.0;
  for (std::size_t k = 0; k < std::min(places.size(), most_named) && held <= enough; ++k) {
    const Place& place = places[k];
    said.push_back(percent_text(place.share) + (k == 0 ? " of the excess sits in " : " in ") + place.text +
                   (place.gap > 0 ? " (" + gap_text(place.gap) + " times the noise)" : ""));
    held += place.share;
  }
  return capitalised(join_list(said)) + (said.size() == 1 ? pattern("it ") : "") + ".";
}

std::string headline_text(const Diagnosis& d) {
  const std::vector<std::string> parts = verdict_parts(d);
  return joined(parts, 0, headline_parts(parts));
}

std::string details_text(const Diagnosis& d) {
  const std::vector<std::string> parts = verdict_parts(d);
  return joined(parts, headline_parts(parts), parts.size());
}

std::string verdict_text(const Diagnosis& d) {
  const std::vector<std::string> parts = verdict_parts(d);
  return joined(parts, 0, parts.size());
}

std::string dependence_text(const Dependence& d, const std::string& kind) {
  const std::string name = variable_text(d.variable, d.variable.experiment.empty() ? kind : d.variable.experiment);
  const std::string turn = d.sign_joint > 0 ? "changes sign with the direction of motion and " : "";
  switch (d.shape) {
    case Shape::EffectDiffers:
      return differs_text(d, name);
    case Shape::Described:
      return "depends on the " + name + (d.note.empty() ? "" : " (" + d.note + ")");
    case Shape::Offset:
      return d.sign_joint > 0 ? "changes sign with the direction of motion, and is of the same size at any " + name
                              : "is a constant offset";
    case Shape::Drifts:
      return turn + "drifts slowly";
    case Shape::Oscillates:
      return turn + "oscillates with a period of " + format("%.3g", d.period) + " s";
    case Shape::Below:
    case Shape::Above:
    case Shape::Between:
      return turn + "is largest where the " + name + " is " + range_text(d);
    case Shape::Grows:
      return turn + "grows with the " + name;
    case Shape::Falls:
      return turn + "falls with the " + name;
    case Shape::Varies:
      return turn + "varies with the " + name;
  }
  return "";
}

std::string reason_text(const NearestEffect& nearest) {
  switch (nearest.reason) {
    case NotBlamed::FitsCheckWorse:
      return "it fits the check experiments worse";
    case NotBlamed::WithinSimulatorError:
      return "it explains no more than the simulator may be off";
    case NotBlamed::LessLikely:
      return "other sets of effects are more likely";
    case NotBlamed::StructureRemains: {
      const std::string name = variable_text(nearest.variable, split_group(nearest.column).first);
      return "structure remains in the " + column_text(nearest.column) +
             (name.empty() ? "" : ", which depends on the " + name);
    }
    case NotBlamed::Described:
      return nearest.note;
  }
  return "";
}

std::string reason_text(const UntriedEffect& untried) {
  switch (untried.reason) {
    case NotTried::PartMissing:
      return "the cell has no " + untried.part;
    case NotTried::NotRecorded:
      try {
        return "no recorded column shows it; it shows in " + cell::find_effect(untried.effect).shows_in;
      } catch (const InvalidArgument&) {
        return "no recorded column shows it";
      }
    case NotTried::Described:
      return untried.note;
  }
  return "";
}

std::string experiment_text(const NextExperiment& next) {
  if (next.what.empty())
    return next.separates.empty() ? "" : "kr5 gap plan searches for the experiment that distinguishes them";
  if (!next.kind) return next.what;
  return next.what + " (" + format("%.1f", next.separation) + " standard deviations expected" +
         (next.repeat ? ", repeat it" : "") + "; kr5 gap plan writes its protocol)";
}

}  // namespace kr5::gap

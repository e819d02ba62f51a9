// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/explanation_text.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include <kr5/core/error.hpp>
#include <kr5/gap/sentences.hpp>
#include <kr5/gap/words.hpp>

#include "gap/wording/number_text.hpp"

namespace kr5::gap {
namespace {

using Texts = std::vector<std::string>;

constexpr double told_share = 0.01;       // of the excess, from which a part of it is told [-]
constexpr double told_change = 0.02;      // of the gap of a column [-]
constexpr double clearly_above = 1.02;    // times the floor, or times the gap before [-]
constexpr double mostly = 0.5;            // of an excess [-]
constexpr double sure = 0.99;             // probability from which no other explanation is told
constexpr double sure_deviations = 3.0;   // from zero, from which a size is told as one
constexpr double most_deviations = 1000;  // that are told as a number
constexpr std::size_t most_listed = 4, most_worse = 3;

double limit_of(const DiagnosisEvidence& evidence, const std::string& column) {
  const auto at = std::ranges::find(evidence.columns, column, &JudgedColumn::column);
  return at == evidence.columns.end() ? std::numeric_limits<double>::infinity() : at->limit;
}

std::string change_text(const std::string& column, double before, double after) {
  return "the " + column_text(column) + " (" + format("%.2f", before) + " → " + format("%.2f", after) + ")";
}

/// The columns that a cause explains best; empty where none stands out without it.
std::string explained_columns_text(const CauseEvidence& evidence) {
  Texts top;
  for (const ColumnEvidence& c : evidence.columns)
    if (c.share > told_share && c.without > c.limit && top.size() < most_listed)
      top.push_back(change_text(c.column, c.without, c.with_all));
  if (top.empty()) return "";
  return "It explains " + join_list(top) + (top.size() > 1 ? ", all with the same values." : ".");
}

std::string consistency_text(const CauseEvidence& evidence) {
  if (evidence.experiments.size() < 2) return "";
  const double worst = std::ranges::min_element(evidence.experiments, {}, &ExperimentEvidence::closed)->closed;
  if (!(worst > mostly)) return "";
  return "It is consistent in each of the " + std::to_string(evidence.experiments.size()) +
         " experiments in which it stands out: in the worst " + percent_text(worst) + " of its excess goes.";
}

Texts texts_for(const Diagnosis& found, const Cause& cause, const CauseEvidence* evidence, bool held_out) {
  Texts out = {"It explains " + percent_text(cause.explained_fraction) + " of the excess" +
               (found.causes.size() > 1 ? " not explained by the other causes" : "") +
               (held_out ? ", on experiments that were not used for the fit." : ".")};
  if (!evidence) return out;
  for (const std::string& text : {explained_columns_text(*evidence), consistency_text(*evidence)})
    if (!text.empty()) out.push_back(text);
  if (const double off = evidence->deviations.value_or(0.0); off >= sure_deviations)
    out.push_back("Its size differs from zero by " +
                  (off < most_deviations ? format("%.0f", off) : "more than " + format("%.0f", most_deviations)) +
                  " standard deviations.");
  return out;
}

/// Structure that stays in the columns that a cause explains.
Texts texts_of_rest(const Diagnosis& found, const CauseEvidence& evidence) {
  std::set<std::string> explained;
  for (const ColumnEvidence& c : evidence.columns)
    if (c.share > told_share) explained.insert(c.column);
  Texts out;
  for (const ColumnExcess& place : found.unexplained) {
    const std::string group = place.experiment + "." + place.column;
    if (!explained.contains(group)) continue;
    const std::string depends =
        place.depends_on.empty() ? "" : ", and " + dependence_text(place.depends_on.front(), place.experiment);
    out.push_back("In the " + column_text(group) + " a gap of " + format("%.2f", place.gap) + " stays" + depends + ".");
  }
  return out;
}

/// Columns and experiments that a cause makes worse, or explains badly.
Texts texts_of_harm(const CauseEvidence& evidence) {
  Texts out;
  for (const ColumnEvidence& c : evidence.columns)
    if (c.with_all > c.limit && c.with_all > clearly_above * c.without && out.size() < most_worse)
      out.push_back("It makes the " + column_text(c.column) + " worse (" + format("%.2f", c.without) + " → " +
                    format("%.2f", c.with_all) + ").");
  for (const ExperimentEvidence& e : evidence.experiments)
    if (e.closed <= mostly)
      out.push_back("In " + e.experiment + " it explains " + percent_text(e.closed) + " of the excess.");
  return out;
}

Texts texts_against(const Diagnosis& found, const Cause& cause, const CauseEvidence* evidence) {
  Texts out;
  for (const EffectName& tied : cause.tied_with)
    out.push_back(capitalised(effect_text(tied)) + " would look the same in this recording.");
  if (cause.probability < sure)
    out.push_back(percent_text(1 - cause.probability) + " of the probability lies with other explanations.");
  if (evidence) {
    for (const Texts& texts : {texts_of_rest(found, *evidence), texts_of_harm(*evidence)})
      out.insert(out.end(), texts.begin(), texts.end());
    if (evidence->deviations && *evidence->deviations < sure_deviations)
      out.push_back("Its size differs from zero by only " + format("%.1f", *evidence->deviations) +
                    " standard deviations.");
  }
  if (out.empty())
    out.push_back(evidence ? "No evidence against it: no column gets worse, and no structure remains in those that it "
                             "explains."
                           : "The file contains no evidence against it.");
  return out;
}

void append(Reasons& to, const Reasons& more) {
  to.in_favour.insert(to.in_favour.end(), more.in_favour.begin(), more.in_favour.end());
  to.against.insert(to.against.end(), more.against.begin(), more.against.end());
}

/// How much of the excess an effect explains.
Reasons reasons_of_excess(const EffectTrial& trial, const DiagnosisEvidence& evidence) {
  if (std::ranges::none_of(trial.fit->columns,
                           [&](const ColumnReduction& c) { return c.before > limit_of(evidence, c.column); }))
    return {{}, {"There is no gap to explain."}};
  const std::string place = trial.replaced ? " in place of " + effect_text(*trial.replaced) : "";
  if (trial.fit->explained_fraction <= told_share)
    return {{}, {"Fitted" + place + " at its best values, it explains less than 1 % of the excess."}};
  return {{"Fitted" + place + ", it explains " + percent_text(trial.fit->explained_fraction) + " of the excess" +
           (evidence.held_out ? ", on experiments not used for the fit." : ".")},
          {}};
}

/// The gaps that stay with an effect, the largest first; empty where none does.
std::string remaining_text(const std::vector<ColumnReduction>& columns, const DiagnosisEvidence& evidence) {
  std::vector<ColumnReduction> left;
  for (const ColumnReduction& c : columns)
    if (const double limit = limit_of(evidence, c.column); c.before > limit && c.after > clearly_above * limit)
      left.push_back(c);
  if (left.empty()) return "";
  std::ranges::stable_sort(left, std::greater<>(), &ColumnReduction::after);
  Texts listed;
  for (const ColumnReduction& c : left)
    if (listed.size() < most_listed)
      listed.push_back("the " + column_text(c.column) + " at " + format("%.2f", c.after));
  const std::string more = left.size() > most_listed
                               ? " and " + std::to_string(left.size() - most_listed) + " more columns above the floor"
                               : "";
  return "Remaining gap: " + join_list(listed) + more + "; 1 is the floor.";
}

/// In which columns the gap falls, stays and grows.
Reasons reasons_of_columns(const std::vector<ColumnReduction>& columns, const DiagnosisEvidence& evidence) {
  Reasons out;
  Texts better;
  for (const ColumnReduction& c : columns)
    if (c.after < c.before - told_change && better.size() < most_listed)
      better.push_back(change_text(c.column, c.before, c.after));
  if (!better.empty()) out.in_favour.push_back("Better with it: " + join_list(better) + ".");
  if (std::string left = remaining_text(columns, evidence); !left.empty()) out.against.push_back(std::move(left));
  std::size_t worse = 0;
  for (const ColumnReduction& c : columns)
    if (c.after > c.before + told_change && c.after > limit_of(evidence, c.column) && worse++ < most_worse)
      out.against.push_back("Worse with it: " + change_text(c.column, c.before, c.after) + ".");
  return out;
}

/// What the diagnosis says of an effect.
Reasons reasons_of_diagnosis(const EffectName& name, const std::vector<Cause>& causes) {
  if (const auto cause = std::ranges::find(causes, name); cause != causes.end())
    return {{"The diagnosis names it as a cause, with a probability of " + percent_text(cause->probability) + "."}, {}};
  Texts others;
  for (const Cause& cause : causes) others.push_back(effect_text(cause));
  if (others.empty()) return {};
  return {{}, {"The diagnosis names " + join_list(others) + ", not this."}};
}

/// What of a cause is far from the model's value.
std::string far_text(const ModelWarning& warning, const std::string& joint) {
  const std::string begin = effect_text(warning) + " (" + (joint.empty() ? "" : joint + "; ");
  if (warning.kind == ModelWarningKind::Mass)
    return begin + format("%.2g", warning.value) + " times that of the model)";
  const bool angle = warning.unit == "rad";
  const double factor = angle ? 180 / std::numbers::pi : 1e3;
  return begin + number_text(factor * warning.value, factor * warning.std) + (angle ? " degrees" : " mm") +
         " from that of the model)";
}

}  // namespace

Reasons cause_reasons(const Diagnosis& found, std::size_t cause, const DiagnosisEvidence* evidence) {
  require(cause < found.causes.size(), "cause: the diagnosis has " + std::to_string(found.causes.size()) +
                                           " causes, none of number " + std::to_string(cause));
  const CauseEvidence* own = evidence && cause < evidence->causes.size() ? &evidence->causes[cause] : nullptr;
  return {texts_for(found, found.causes[cause], own, !evidence || evidence->held_out),
          texts_against(found, found.causes[cause], own)};
}

Texts rival_texts(const std::vector<EffectFit>& rivals, const DiagnosisEvidence& evidence) {
  Texts out;
  for (const EffectFit& rival : rivals) {
    if (rival.explained_fraction < told_share) continue;
    const ColumnReduction* worst = nullptr;
    for (const ColumnReduction& c : rival.columns)
      if (c.after > clearly_above * limit_of(evidence, c.column) && (!worst || c.after > worst->after)) worst = &c;
    out.push_back(capitalised(effect_text(rival)) + " explains " + percent_text(rival.explained_fraction) + " and " +
                  (worst ? "leaves the " + column_text(worst->column) + " at " + format("%.2f", worst->after)
                         : "leaves no column above the floor") +
                  ".");
  }
  if (out.empty()) out.push_back("No other effect explains more than 1 % of the part that it explains.");
  return out;
}

Reasons trial_reasons(const EffectTrial& trial, const Diagnosis& found, const DiagnosisEvidence& evidence) {
  if (!trial.fit) return {{}, {"It changes no recorded column; this recording contains no evidence about it."}};
  Reasons out = reasons_of_excess(trial, evidence);
  append(out, reasons_of_columns(trial.fit->columns, evidence));
  append(out, reasons_of_diagnosis(trial, found.causes));
  return out;
}

std::string floor_text(const std::vector<JudgedColumn>& columns) {
  if (columns.empty()) return "";
  double squares = 0.0;
  for (const JudgedColumn& c : columns) squares += c.gap * c.gap;
  return "Over its " + std::to_string(columns.size()) + " columns the gap is " +
         format("%.2f", std::sqrt(squares / static_cast<double>(columns.size()))) +
         " times the noise, and 1 is the floor.";
}

Texts model_warning_texts(const std::vector<ModelWarning>& warnings, const Texts& joint_names,
                          const std::string& described) {
  Texts far, joints, sizes, out;
  for (const ModelWarning& warning : warnings) {
    const std::string joint = joint_name(joint_names, warning.target);
    if (warning.kind != ModelWarningKind::Zero) {
      far.push_back(far_text(warning, joint));
    } else {
      joints.push_back(joint.empty() ? warning.target : joint);
      sizes.push_back(format("%+.3g", warning.value) + " rad");
    }
  }
  if (!far.empty())
    out.push_back("Does " + described + " describe this robot and its payload? " + capitalised(join_list(far)) +
                  (far.size() > 1 ? " differ" : " differs") + " by more than is usual.");
  if (!joints.empty())
    out.push_back("Does the log measure " + join_list(joints) +
                  " from the same zero as the model? An encoder offset of this size is unusual; columns.q.offset "
                  "corrects the log, by " +
                  join_list(sizes) + ".");
  return out;
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/comparison_text.hpp>

#include <cctype>
#include <cmath>
#include <cstdio>

#include <kr5/gap/sentences.hpp>
#include <kr5/gap/words.hpp>

namespace kr5::arm_log {

namespace {

std::string gap_text(double gap) {
  char out[32];
  std::snprintf(out, sizeof out, gap < 100 ? "%.2f" : "%.0f", gap);
  return out;
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string number_text(double value) {
  char out[32];
  std::snprintf(out, sizeof out, "%.4g", value);
  return out;
}

/// Values in the first recording, with the factor and without the unit of the others.
std::string first_text(const ParameterChange& p, double factor) {
  std::string out;
  for (const double value : p.first) out += (out.empty() ? "" : ", ") + number_text(factor * value);
  return out;
}

/// From what to what; where one recording gives no value, that of the other alone.
std::string values_text(const ParameterChange& p, const std::string& target) {
  const auto with_std = [&](const std::vector<double>& value) {
    return gap::value_text({p.name, value, p.std, p.unit}, target);
  };
  if (p.second.empty()) return with_std(p.first) + " in the first recording alone";
  if (p.first.empty()) return with_std(p.second) + " in the second recording";
  return "from " + first_text(p, gap::display_unit(p.unit, p.second, target).first) + " to " + with_std(p.second);
}

std::string rest_text(const RecordingComparison& c) {
  const gap::Diagnosis& d = c.difference;
  const std::string out = std::string("With ") + (c.changes.size() == 1 ? "it" : "them") +
                          " the difference falls from " + gap_text(d.reduction.before) + " to " +
                          gap_text(d.reduction.after) + " times the noise";
  return out + (d.verdict == gap::Verdict::Explained ? "." : ", and the rest is not explained.");
}

/// What cannot be told from the changes that are named.
std::string ties_text(const RecordingComparison& c) {
  std::string out;
  for (const EffectChange& change : c.changes)
    for (const gap::EffectName& tied : change.tied_with) out += (out.empty() ? "" : ", ") + gap::effect_text(tied);
  return out.empty() ? "" : " These recordings cannot distinguish that from: " + out + ".";
}

std::string clocks_text(const RecordingComparison& c) {
  std::string out;
  for (const gap::ClockFault& fault : c.difference.clock_faults) {
    const bool late = (fault.delay > 0) != c.reversed;
    out += " The " + gap::clock_text(fault) + " of the second recording are " +
           gap::value_text({"", {std::abs(fault.delay)}, {fault.std}, "s"}, "") + (late ? " later" : " earlier") +
           " than in the first.";
  }
  return out;
}

std::string difference_text(const RecordingComparison& c) {
  if (c.difference.verdict == gap::Verdict::NoGap)
    return c.difference.excused.empty()
               ? "The recordings do not differ by more than noise."
               : "The recordings do not differ by more than noise and what the first leaves undetermined.";
  if (c.changes.empty())
    return "The recordings differ by " + gap_text(c.difference.reduction.before) +
           " times the noise, and no effect of the catalogue explains it.";
  std::string out = change_text(c.changes[0]);
  if (c.changes.size() == 2) out += " " + capitalised(gap::effect_text(c.changes[1])) + " differs, too.";
  if (c.changes.size() > 2) out += " " + std::to_string(c.changes.size() - 1) + " more effects differ.";
  return out + " " + rest_text(c) + ties_text(c);
}

/// What the second recording has of the causes of the first, where they are its causes, too.
std::string common_text(const RecordingComparison& c) {
  const bool known = c.difference.verdict == gap::Verdict::NoGap || c.difference.verdict == gap::Verdict::Explained;
  if (c.common.empty() || !known) return "";
  return " Both differ from the model by " + std::to_string(c.common.size()) +
         (c.common.size() == 1 ? " effect." : " effects.");
}

}  // namespace

std::string change_text(const EffectChange& change) {
  const std::string name = capitalised(gap::effect_text(change));
  if (change.parameters.size() == 1 && !change.parameters[0].first.empty() && !change.parameters[0].second.empty())
    return name + " changed " + values_text(change.parameters[0], change.target) + ".";
  std::string out;
  for (const ParameterChange& p : change.parameters)
    out += (out.empty() ? "" : "; ") + p.name + " " + values_text(p, change.target);
  return name + ": " + out + ".";
}

std::string text(const RecordingComparison& c) {
  const std::string reference =
      c.by_arm ? "" : " Neither recording determines the arm: errors of the model may be told as changes.";
  return difference_text(c) + clocks_text(c) + common_text(c) + reference;
}

}  // namespace kr5::arm_log

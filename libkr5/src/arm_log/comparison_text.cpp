// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/comparison_text.hpp>

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

/// Of a parameter that one recording does not state, the value in the other alone.
std::string values_text(const ParameterChange& p, const std::string& target) {
  const auto at = [&](const std::vector<double>& value) {
    return gap::value_text({p.name, value, std::vector<double>(value.size(), 0.0), p.unit}, target);
  };
  if (p.second.empty()) return at(p.first) + " in the first recording alone";
  const std::string now = gap::value_text({p.name, p.second, p.std, p.unit}, target) + " in the second recording";
  return p.first.empty() ? now : now + ", " + at(p.first) + " in the first";
}

std::string rest_text(const RecordingComparison& c) {
  const gap::Diagnosis& d = c.difference;
  const std::string gaps = gap_text(d.reduction.before) + " to " + gap_text(d.reduction.after) + " times the noise";
  const std::string out =
      std::string("With ") + (c.changes.size() == 1 ? "it" : "them") + " the difference falls from " + gaps;
  return out + (d.verdict == gap::Verdict::Explained ? "." : ", and the rest is not explained.");
}

std::string difference_text(const RecordingComparison& c) {
  if (c.difference.verdict == gap::Verdict::NoGap) return "The recordings do not differ by more than noise.";
  if (c.changes.empty())
    return "The recordings differ by " + gap_text(c.difference.reduction.before) +
           " times the noise, and no effect of the catalogue explains it.";
  std::string out = change_text(c.changes[0]);
  if (c.changes.size() == 2) out += " " + capitalised(gap::effect_text(c.changes[1])) + " differs, too.";
  if (c.changes.size() > 2) out += " " + std::to_string(c.changes.size() - 1) + " more effects differ.";
  return out + " " + rest_text(c);
}

}  // namespace

std::string change_text(const EffectChange& change) {
  std::string out = capitalised(gap::effect_text(change)) + ": ";
  for (std::size_t k = 0; k < change.parameters.size(); ++k) {
    const ParameterChange& p = change.parameters[k];
    out += (k ? "; " : "") + (change.parameters.size() > 1 ? p.name + " " : "") + values_text(p, change.target);
  }
  return out + ".";
}

std::string text(const RecordingComparison& c) {
  if (c.common.empty()) return difference_text(c);
  const std::string count = std::to_string(c.common.size()) + (c.common.size() == 1 ? " effect" : " effects");
  return difference_text(c) + " Both differ from the model by " + count + ".";
}

}  // namespace kr5::arm_log

// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/notes.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/gap/words.hpp>

#include "gap/wording/number_text.hpp"

namespace kr5::gap {
namespace {

std::string compared_text(const LeftOut& left_out) {
  constexpr std::size_t most = 3;
  const std::size_t count = left_out.columns.size();
  if (count == 0) return left_out.experiment + " was not compared";
  const std::string of = left_out.experiment.empty() ? std::string(kr5::name_of(left_out.kind)) : left_out.experiment;
  std::string out = of + "." + left_out.columns.front();
  if (count > most) out += " to " + left_out.columns.back() + " (" + std::to_string(count) + " columns)";
  for (std::size_t k = 1; k < count && count <= most; ++k) out += ", " + left_out.columns[k];
  return out + (count > 1 ? " were" : " was") + " not compared";
}

std::string split_text(const MissingSplit& missing) {
  return std::string(kr5::name_of(missing.kind)) +
         (missing.split == cell::Split::Check
              ? ": no check experiment; the gap is taken from the fit experiments."
              : ": no fit experiment; effects that show only there cannot be identified.");
}

/// What of the recording was not compared, or not as it stands.
void add_left_out(const Diagnosis& d, std::vector<Note>& out) {
  if (d.clock_reset) out.push_back({"t has a different epoch: it is counted from the first row of each kind.", ""});
  for (const LeftOut& part : d.left_out) out.push_back({left_out_text(part) + ".", ""});
  for (const MissingSplit& missing : d.missing_splits) out.push_back({split_text(missing), ""});
  for (const std::string& note : d.notes) out.push_back({note + ".", ""});
}

void add_spikes(const Diagnosis& d, std::vector<Note>& out) {
  const auto number = [](int count) { return std::to_string(count); };
  if (d.spikes > 0)
    out.push_back({number(d.spikes) + (d.spikes == 1 ? " sample is a spike and was" : " samples are spikes and were") +
                       " left out.",
                   "Single outliers, as from a disturbed signal line, would outweigh thousands of good samples; the "
                   "diagnosis leaves them out. If there are many, check cables and logging."});
  if (d.outliers > 0)
    out.push_back(
        {number(d.outliers) + (d.outliers == 1 ? " more sample deviates from the fitted model and was left out."
                                               : " more samples deviate from the fitted model and were left out."),
         ""});
}

/// How far the search went.
void add_limits(const Diagnosis& d, std::vector<Note>& out) {
  if (d.sets_limit > 0)
    out.push_back({"More than " + std::to_string(d.sets_limit) +
                       " sets of effects are about equally likely, and the rest were not examined; a longer or richer "
                       "recording tells them apart.",
                   ""});
  if (d.effects_limit > 0)
    out.push_back({"As many causes were found as are searched for (max_effects: " + std::to_string(d.effects_limit) +
                       "); a search for more takes longer.",
                   ""});
}

void add_noise(const Diagnosis& d, bool declared, std::vector<Note>& out) {
  if (d.noise.empty()) return;
  std::vector<std::string> each;
  for (const NoiseRatio& noise : d.noise) {
    std::string key = noise.key + (noise.kind ? " in " + std::string(kr5::name_of(*noise.kind)) : "");
    std::ranges::replace(key, '_', ' ');
    each.push_back(key + " " + format("%.2f", noise.ratio) + " ± " + format("%.2f", noise.std));
  }
  if (declared)
    out.push_back({"The measured noise differs from the declared one by these factors: " + join_list(each) + ".",
                   "Gaps are given in units of the measured noise. Correct the noise in the cell: a declared value "
                   "that is too small makes every recording look bad, and one that is too large hides real gaps."});
  else
    out.push_back(
        {"The noise is this many times that of neighbouring rows, and is taken so: " + join_list(each) + ".", ""});
}

/// Small errors of the nominal parameters, and how to read percentages.
void add_reading(const Diagnosis& d, std::vector<Note>& out) {
  constexpr double overlap = 1.05;  // sum of what the causes explain, above which they share parts of the gap
  if (d.nuisance_std > 0)
    out.push_back({"Masses and torque constants are uncertain by about " + format("%.1f", 100 * d.nuisance_std) +
                       " %, friction by " + format("%.1f", 200 * d.nuisance_std) + " %.",
                   "Such small errors are usual and not a cause; curves still contain them."});
  double sum = 0.0;
  for (const Cause& cause : d.causes) sum += cause.explained_fraction;
  if (sum > overlap)
    out.push_back(
        {"Each percentage refers to the gap that remains when all other causes are applied; the percentages "
         "may therefore add up to more than 100 %.",
         ""});
}

/// What was found about the recording and the search, late columns apart.
std::vector<Note> notes_of_recording(const Diagnosis& d, bool noise_declared) {
  std::vector<Note> out;
  add_left_out(d, out);
  for (const ColumnName& name : d.coarse)
    out.push_back({name.experiment + "." + name.column +
                       " shows almost no noise, as with a coarse resolution or a dead sensor; the declared noise is "
                       "used.",
                   ""});
  if (!d.excused.empty())
    out.push_back({"Even a freely fitted arm leaves an error in " + std::to_string(d.excused.size()) +
                       (d.excused.size() == 1 ? " column" : " columns") +
                       "; that part is not attributed to a cause, and gaps are relative to the sensor noise alone.",
                   ""});
  add_spikes(d, out);
  add_limits(d, out);
  add_noise(d, noise_declared, out);
  return out;
}

}  // namespace

std::string left_out_text(const LeftOut& left_out) {
  const std::string what = compared_text(left_out) + ": ";
  switch (left_out.reason) {
    case LeftOutReason::NoiseNotStated:
      return what + "the cell does not state noise." + left_out.detail;
    case LeftOutReason::NotPredicted:
      return what + "the simulator does not predict it";
    case LeftOutReason::NotFinite:
      return what + "the simulation gives no finite value to compare";
    case LeftOutReason::Refused:
      return what + left_out.detail;
  }
  return what;
}

std::string limit_text(const ScopeLimit& limit) {
  switch (limit.reason) {
    case ScopeReason::FewRows:
      return limit.experiment + " has " + std::to_string(limit.rows) + (limit.rows == 1 ? " row" : " rows") +
             ": it can show neither a gap nor its absence";
    case ScopeReason::AtRest:
      return limit.experiment + " commands no motion: it cannot show friction, inertia and servos";
    case ScopeReason::OneKind:
      return "the recording has experiments of the kind " + std::string(kr5::name_of(limit.kind)) + " only: it shows " +
             shown_by(limit.kind) + ", not the rest of the cell";
    case ScopeReason::Described:
      return limit.note;
  }
  return "";
}

std::string fault_text(const ClockFault& fault) {
  const double delay = 1e3 * std::abs(fault.delay), std = 1e3 * fault.std;
  return "the " + clock_text(fault) + (fault.group == "wrench" ? " was" : " were") + " logged " +
         number_text(delay, std) + " ± " + number_text(std, std) + " ms " + (fault.delay > 0 ? "late" : "early") +
         " relative to the other columns";
}

std::vector<Note> notes(const Diagnosis& d, bool noise_declared) {
  std::vector<Note> out = notes_of_recording(d, noise_declared);
  add_reading(d, out);
  return out;
}

std::vector<std::string> warnings(const Diagnosis& d) {
  std::vector<std::string> out;
  for (const ClockFault& fault : d.clock_faults) out.push_back(capitalised(fault_text(fault)) + ".");
  for (const Note& note : notes_of_recording(d, true)) out.push_back(note.text);
  return out;
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// What a diagnosis found about the recording itself, in sentences. @see findings.hpp, sentences.hpp

namespace kr5::gap {

/// A sentence, and what it means for the reader; the latter may be empty.
struct Note {
  std::string text;
  std::string meaning;

  static void each_field(auto& self, auto&& visit) {
    visit("text", self.text, "What was found.");
    visit("meaning", self.meaning, "What it means; may be empty.");
  }
};

/// Part of a sentence: `motion.i1 to i6 (6 columns) were not compared: ...`
std::string left_out_text(const LeftOut& left_out);
/// A limit of what a recording can show, as part of a sentence.
std::string limit_text(const ScopeLimit& limit);
/// Which columns were logged late or early, as part of a sentence.
std::string fault_text(const ClockFault& fault);

/// What else was found about the recording, beside late columns: noise, spikes, parts that were not compared, known
/// errors, small errors of the nominal parameters.
/// @param noise_declared Whether the model declares the noise of its sensors; the description of a robot does not.
std::vector<Note> notes(const Diagnosis& diagnosis, bool noise_declared = true);
/// All that was found about the recording, late columns included, a text each.
std::vector<std::string> warnings(const Diagnosis& diagnosis);

}  // namespace kr5::gap

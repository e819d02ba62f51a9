#pragma once

#include <algorithm>
#include <string>

#include <kr5/gap/diagnosis.hpp>

/// @file
/// What a diagnosis told.

namespace told {

using namespace kr5;

/// Named first, or tied with what is named.
inline bool blames(const gap::Diagnosis& d, const std::string& effect, const std::string& target) {
  const gap::EffectName name{effect, target};
  return std::any_of(d.causes.begin(), d.causes.end(), [&](const gap::Cause& c) {
    return (c.effect == effect && c.target == target) ||
           std::find(c.tied_with.begin(), c.tied_with.end(), name) != c.tied_with.end();
  });
}

inline std::string text(const gap::Diagnosis& d) {
  std::string out(kr5::name_of(d.verdict));
  for (const gap::Cause& c : d.causes) out += " " + c.effect + "." + c.target + " " + std::to_string(c.probability);
  for (const std::string& w : d.warnings) out += " (" + w + ")";
  for (const gap::Place& p : d.unexplained) out += " rest " + p.experiment + "." + p.column;
  return out;
}

inline bool warns(const gap::Diagnosis& d, const std::string& words) {
  return std::any_of(d.warnings.begin(), d.warnings.end(),
                     [&](const std::string& w) { return w.find(words) != std::string::npos; });
}

}  // namespace told

#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/notes.hpp>

/// @file
/// What a diagnosis named, for assertions.

namespace kr5::test {

inline bool cause_matches(const gap::Cause& cause, const gap::EffectName& effect) {
  return (cause.effect == effect.effect && cause.target == effect.target) ||
         std::find(cause.tied_with.begin(), cause.tied_with.end(), effect) != cause.tied_with.end();
}

/// Whether an effect is named, or tied with what is named; false causes beside it do not count.
inline bool names_cause(const gap::Diagnosis& d, const std::string& effect, const std::string& target) {
  return std::any_of(d.causes.begin(), d.causes.end(), [&](const auto& c) {
    return cause_matches(c, {effect, target});
  });
}

/// Whether these effects are named, each by a cause of its own, and nothing else is.
inline bool names_only(const gap::Diagnosis& d, const std::vector<gap::EffectName>& effects) {
  std::vector<const gap::Cause*> left;
  for (const gap::Cause& c : d.causes) left.push_back(&c);
  for (const gap::EffectName& effect : effects) {
    // The cause that is called so before one that is tied with it.
    auto found = std::find_if(left.begin(), left.end(),
                              [&](const auto* c) { return c->effect == effect.effect && c->target == effect.target; });
    if (found == left.end())
      found = std::find_if(left.begin(), left.end(), [&](const auto* c) { return cause_matches(*c, effect); });
    if (found == left.end()) return false;
    left.erase(found);
  }
  return left.empty();
}

inline std::string text(const gap::Diagnosis& d) {
  std::string out(kr5::name_of(d.verdict));
  for (const gap::Cause& c : d.causes) out += " " + c.effect + "." + c.target + " " + std::to_string(c.probability);
  for (const std::string& w : gap::warnings(d)) out += " (" + w + ")";
  for (const gap::ColumnExcess& p : d.unexplained) out += " rest " + p.experiment + "." + p.column;
  return out;
}

inline bool limits(const gap::Diagnosis& d, const std::string& words) {
  return std::any_of(d.scope.begin(), d.scope.end(), [&](const gap::ScopeLimit& limit) {
    return gap::limit_text(limit).find(words) != std::string::npos;
  });
}

inline bool warns(const gap::Diagnosis& d, const std::string& words) {
  const std::vector<std::string> all = gap::warnings(d);
  return std::any_of(all.begin(), all.end(), [&](const std::string& w) { return w.find(words) != std::string::npos; });
}

}  // namespace kr5::test

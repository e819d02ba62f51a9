// SPDX-License-Identifier: BSD-3-Clause
#include "gap/wording/number_text.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace kr5::gap {
namespace {

/// Unit in SI, and what a sentence shows in its place.
struct ShownUnit {
  const char* unit;
  double factor;
  const char* shown;
};
constexpr ShownUnit shown_units[] = {{"m", 1e3, "mm"},
                                     {"rad", 180 / std::numbers::pi, "°"},
                                     {"s", 1e3, "ms"},
                                     {"kg m^2", 1e6, "kg mm²"},
                                     {"-", 1.0, ""}};

constexpr double nearly_all = 0.995;  // a share that is rounded to all

void replace_all(std::string& text, const std::string& old, const std::string& by) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + by.size()))
    text.replace(at, old.size(), by);
}

}  // namespace

std::string format(const char* form, double value) {
  char out[64];
  std::snprintf(out, sizeof out, form, value);
  return out;
}

std::string number_text(double value, double std) {
  if (!std::isfinite(value)) return "–";
  if (!(std > 0) || !std::isfinite(std)) return format("%.4g", value);
  const int digits = std::clamp(1 - static_cast<int>(std::floor(std::log10(std))), 0, 9);
  char out[400];  // of the largest number without exponent
  std::snprintf(out, sizeof out, "%.*f", digits, value);
  return out;
}

std::string percent_text(double share) {
  if (share >= nearly_all) return share > 0.9995 ? "more than 99.9 %" : "more than 99 %";
  return share < 0.005 ? "less than 1 %" : format("%.0f %%", 100 * share);
}

std::string min_percent_text(double share) { return (share >= nearly_all ? "" : "at least ") + percent_text(share); }

std::string gap_text(double gap) { return format(gap >= 10 ? "%.1f" : "%.2f", gap); }

std::pair<double, std::string> text_unit(const std::string& unit, double largest) {
  if (unit == "s" && largest >= 1) return {1.0, "s"};
  for (const ShownUnit& shown : shown_units)
    if (unit == shown.unit) return {shown.factor, shown.shown};
  std::string out = unit;
  replace_all(out, "N.m", "N m");
  replace_all(out, ".", " ");
  replace_all(out, "^2", "²");
  return {1.0, out};
}

std::string join_list(const std::vector<std::string>& items, const std::string& last) {
  std::string out;
  for (std::size_t k = 0; k < items.size(); ++k)
    out += (k == 0 ? "" : k + 1 == items.size() ? " " + last + " " : ", ") + items[k];
  return out;
}

std::string capitalised(std::string text) {
  if (!text.empty()) text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::pair<std::string, int> split_number(const std::string& name) {
  constexpr std::size_t most_digits = 6;
  const std::size_t last = name.find_last_not_of("0123456789"), at = last == std::string::npos ? 0 : last + 1;
  if (at == name.size() || name.size() - at > most_digits) return {name, 0};
  return {name.substr(0, at), std::stoi(name.substr(at))};
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

/// @file
/// Numbers and lists as people read them.

namespace kr5::gap {

/// A number in the form of printf.
std::string format(const char* form, double value);
/// A number with as many digits as its standard deviation allows (two digits of it), else four.
std::string number_text(double value, double std = 0.0);
/// A share that says neither 0 nor 100 %, which no measurement does; what is below 0 is less than 1 %.
std::string percent_text(double share);
/// The same of a share that others exceed: `at least 62 %`.
std::string min_percent_text(double share);
/// A gap: two digits behind the point, of large ones one.
std::string gap_text(double gap);
/// Factor from SI, and unit, of numbers in a sentence; long times stay in seconds.
std::pair<double, std::string> text_unit(const std::string& unit, double largest);
/// `a, b and c`
std::string join_list(const std::vector<std::string>& items, const std::string& last = "and");
std::string capitalised(std::string text);
/// A name and the number at its end, 0 without: `joint` and 3.
std::pair<std::string, int> split_number(const std::string& name);

}  // namespace kr5::gap

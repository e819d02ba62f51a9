// SPDX-License-Identifier: BSD-3-Clause
// core is made of inline code; this file proves that its headers compile and gives the library a symbol.
#include <kr5/core/error.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/core/random.hpp>

namespace kr5 {
static_assert(HasFields<FitReport> && HasNames<FitStatus>);
}  // namespace kr5

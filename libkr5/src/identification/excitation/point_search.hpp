// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "identification/excitation/fourier_search.hpp"

namespace kr5::identification {

/// Exchanges one point at a time, with the strokes to it and from it.
ExcitationSearch search_points(ExcitationProblem& problem, const ExcitationOptions& options);

}  // namespace kr5::identification

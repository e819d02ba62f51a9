// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/geometry/view.hpp>

namespace kr5::vision::detail {

/// @throws InvalidArgument for views that no calibration can use.
void check_views(std::span<const View> views, int width, int height);

}  // namespace kr5::vision::detail

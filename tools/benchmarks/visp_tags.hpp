// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

/// ViSP's tag detector for 36h11 with its defaults, on an image copied beforehand; gives the number of each tag found.
std::function<std::vector<int>()> visp_tags(const unsigned char* pixels, int width, int height);

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/gap/diagnosis.hpp>
#include <kr5/io/node.hpp>

namespace kr5::gap {

/// The diagnosis in a document of format `kr5-gap/2` or `kr5-gap/1`.
/// @throws IoError naming `source`, line and field of all that is wrong with it.
Diagnosis read_diagnosis(const io::Node& document, const std::string& source);

}  // namespace kr5::gap

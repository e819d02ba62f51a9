// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace kr5::io {

/// The text is UTF-8 throughout; control characters are allowed.
bool is_utf8(std::string_view text);
/// Throws IoError, naming source and line, unless the text is UTF-8 and made of the characters that YAML allows.
void require_utf8(std::string_view text, const std::string& source);

}  // namespace kr5::io

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// The sensor configuration of the controller (`..._ethernet.xml`, `RSIEthernet.xml`), read with pugixml and written.

namespace kr5::rsi {

/// The layout of a configuration. One that names a PROTOCOL is that of a KR C2, any other that of a KR C4 or C5, whose
/// files are alike: the layout says krc4. What a configuration does not hold keeps its default.
/// @throws IoError naming source, line and element.
TelegramLayout parse_layout(std::string_view xml, const std::string& source);
/// @throws IoError also when the file cannot be read.
TelegramLayout load_layout(const std::filesystem::path& file);

/// The configuration of a layout, for the controller. `parse_layout` gives the same elements back.
/// @throws InvalidArgument as TelegramLayout::validate.
std::string layout_xml(const TelegramLayout& layout);

}  // namespace kr5::rsi

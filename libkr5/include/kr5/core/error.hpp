// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

/// @file
/// The exceptions of kr5. Data that do not suffice are no exception: they are a status in a result.

namespace kr5 {

/// Base of every exception thrown by kr5.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The caller broke a documented precondition; nothing was computed.
struct InvalidArgument : Error {
  using Error::Error;
};

/// A file is missing, unreadable or not of the documented form. The text names file, line, field and remedy.
struct IoError : Error {
  using Error::Error;
};

/// Throws InvalidArgument with `message` unless `condition` holds. A literal costs nothing while it does.
inline void require(bool condition, const char* message) {
  if (!condition) throw InvalidArgument(message);
}
inline void require(bool condition, const std::string& message) {
  if (!condition) throw InvalidArgument(message);
}

}  // namespace kr5

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::cell {

/// Reads a document, checks it in full, and collects every diagnostic. The cell may only be used when there is none.
Cell read_cell(const io::Node& root, const std::string& file, std::vector<io::Diagnostic>& diagnostics);
/// Errors of form, or else of value, of a cell in memory; `root` is its document.
std::vector<io::Diagnostic> cell_errors(const Cell& cell, const io::Node& root, const std::string& file);
/// The document of a cell in the form it was read.
io::Node cell_node(const Cell& cell);

}  // namespace kr5::cell

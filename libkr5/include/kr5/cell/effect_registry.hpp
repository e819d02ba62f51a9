// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/cell/effect.hpp>

/// @file
/// Effects from outside the library: a row with its law, known from then on wherever the catalogue is.

namespace kr5::cell {

/// Adds a row to the catalogue: the effect may stand in cell files, is checked, simulated by every simulator, diagnosed
/// and explained like any other. Its parameters need a size (`size` or `usual_size`), the row a law (`change_cell` or
/// `change_columns`). Not while other threads use the catalogue.
/// @throws InvalidArgument for an id that is in the catalogue, or a row that lacks something.
void register_effect(Effect effect);

/// Takes a registered row out of the catalogue.
/// @throws InvalidArgument for an effect of the library, or none at all.
void unregister_effect(const std::string& id);

}  // namespace kr5::cell

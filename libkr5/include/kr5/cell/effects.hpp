// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include <kr5/geometry/pose.hpp>
#include <kr5/io/reader.hpp>

/// @file
/// The effects that a cell carries, by id, target and parameter of the catalogue (kr5/cell/effect.hpp), which knows
/// their units and bounds.

namespace kr5::cell {

/// A number (or whole number), a vector, or a pose.
using EffectValue = std::variant<double, Eigen::VectorXd, Pose>;

/// An effect on one target, with the parameters that were set.
struct EffectEntry {
  std::string effect;
  int index = 0;  ///< Joint, motor or wrench component, from 0; 0 for other targets.
  std::vector<std::pair<std::string, EffectValue>> values;
};

/// What a cell carries beyond its nominal model. A law reads the parameters of its own row; what is not set is off.
class Effects {
 public:
  /// Whether any parameter of the effect is set on a target.
  bool carries(std::string_view effect, int index = 0) const;

  /// Value of a parameter, or the value of its row that switches the effect off.
  /// @param index Joint, motor or wrench component, from 0; 0 for other targets.
  /// @throws InvalidArgument for a parameter that the catalogue has not, or that is not one number, or of which off
  /// means:
  ///         as in the cell.
  double number(std::string_view effect, std::string_view parameter, int index = 0) const;
  /// The same of a vector.
  Eigen::VectorXd vector(std::string_view effect, std::string_view parameter, int index = 0) const;

  /// Value that replaces one of the cell; nothing: as in the cell.
  std::optional<double> replaced_number(std::string_view effect, std::string_view parameter, int index = 0) const;
  std::optional<Eigen::VectorXd> replaced_vector(std::string_view effect, std::string_view parameter,
                                                 int index = 0) const;
  std::optional<Pose> replaced_pose(std::string_view effect, std::string_view parameter, int index = 0) const;

  /// Value that was set, or null.
  const EffectValue* find(std::string_view effect, std::string_view parameter, int index = 0) const;

  /// Sets a parameter by the names of the catalogue, without a check against the cell; an empty value switches it off.
  /// @throws InvalidArgument for an unknown effect, target or parameter, naming what there is, and for a value of the
  ///         wrong form.
  void set(const std::string& effect, const std::string& target, const std::string& parameter,
           const std::optional<EffectValue>& value);

  const std::vector<EffectEntry>& entries() const { return entries_; }
  /// Switches an effect off on all its targets.
  void remove(std::string_view effect);

  /// In a file: `<id>.<target>.<parameter>`; what is off is not written.
  bool from_node(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node to_node() const;

 private:
  std::vector<EffectEntry> entries_;
};

}  // namespace kr5::cell

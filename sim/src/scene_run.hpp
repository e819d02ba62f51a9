// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/sim/scene.hpp>

namespace kr5::sim {

/// Rows of named values, one at a time.
class Rows {
 public:
  explicit Rows(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void add(std::vector<double> row) { rows_.push_back(std::move(row)); }
  io::Table table() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<double>> rows_;
};

/// Period of the rows of a scene.
double scene_cycle(const cell::Cell& cell);

/// Fill rows, steps, pictures and profiles.
void run_arm(const Scene& scene, const cell::Cell& cell, SceneResult& out);
void run_push(const Scene& scene, const cell::Cell& cell, SceneResult& out);

}  // namespace kr5::sim

// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/model_pool.hpp"

#include <algorithm>

namespace kr5::gap {

std::vector<Model>::iterator ModelPool::find(const std::vector<Part>& parts) {
  return std::find_if(models_.begin(), models_.end(), [&](const Model& m) { return same_effects(m.parts, parts); });
}

Model ModelPool::insert(Model model) {
  const auto place =
      std::find_if(models_.begin(), models_.end(), [&](const Model& m) { return m.log_evidence < model.log_evidence; });
  return *models_.insert(place, std::move(model));
}

Model ModelPool::without(const Model& model, std::size_t part) {
  std::vector<Part> parts = gap::without(model.parts, part);
  if (parts.empty()) return nominal();
  const auto found = find(parts);
  return found != models_.end() ? *found : insert(fit(problem_, nominal(), std::move(parts)));
}

void ModelPool::extend(const Model& from, std::vector<Part> parts) {
  const bool dropped = std::any_of(dropped_.begin(), dropped_.end(),
                                   [&](const std::vector<Part>& other) { return same_effects(other, parts); });
  if (!dropped && find(parts) == models_.end()) insert(fit(problem_, from, std::move(parts)));
}

void ModelPool::drop(const std::vector<Part>& parts) {
  std::erase_if(models_, [&](const Model& m) { return same_effects(m.parts, parts); });
  dropped_.push_back(parts);
}

}  // namespace kr5::gap

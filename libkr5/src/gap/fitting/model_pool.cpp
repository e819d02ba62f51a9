// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/model_pool.hpp"

#include <algorithm>

namespace kr5::gap {

Model ModelPool::fitted(std::vector<Part> parts) {
  const auto found =
      std::find_if(models_.begin(), models_.end(), [&](const Model& m) { return same_effects(m.parts, parts); });
  if (found != models_.end()) return *found;
  Model model = fit(problem_, nominal(), std::move(parts));
  const auto place =
      std::find_if(models_.begin(), models_.end(), [&](const Model& m) { return m.log_evidence < model.log_evidence; });
  return *models_.insert(place, std::move(model));
}

Model ModelPool::without(const Model& model, std::size_t part) {
  std::vector<Part> parts = gap::without(model.parts, part);
  return parts.empty() ? nominal() : fitted(std::move(parts));
}

void ModelPool::drop(const std::vector<Part>& parts) {
  std::erase_if(models_, [&](const Model& m) { return same_effects(m.parts, parts); });
}

}  // namespace kr5::gap

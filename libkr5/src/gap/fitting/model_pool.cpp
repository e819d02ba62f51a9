// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/model_pool.hpp"

#include <algorithm>
#include <optional>

#include "gap/parallel.hpp"

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

bool ModelPool::is_dropped(const std::vector<Part>& parts) const {
  return std::ranges::any_of(dropped_, [&](const std::vector<Part>& other) { return same_effects(other, parts); });
}

void ModelPool::extend(const Model& from, std::vector<std::vector<Part>> sets, int threads) {
  std::erase_if(sets, [&](const std::vector<Part>& s) { return is_dropped(s) || find(s) != models_.end(); });
  std::vector<std::optional<Model>> fitted(sets.size());
  parallel_for(static_cast<int>(sets.size()), threads,
               [&](int i) { fitted[i] = fit(problem_, from, std::move(sets[i])); });
  for (std::optional<Model>& model : fitted) insert(std::move(*model));
}

void ModelPool::drop(const std::vector<Part>& parts) {
  std::erase_if(models_, [&](const Model& m) { return same_effects(m.parts, parts); });
  dropped_.push_back(parts);
}

}  // namespace kr5::gap

// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/model_pool.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

#include <kr5/core/parallel.hpp>

#include "gap/fitting/start.hpp"

namespace kr5::gap {

const Model* ModelPool::find(const std::vector<Part>& parts) const {
  const auto has_them = [&](const Model& m) { return same_effects(m.parts, parts); };
  for (const std::vector<Model>* models : {&models_, &dropped_})
    if (const auto found = std::ranges::find_if(*models, has_them); found != models->end()) return &*found;
  return nullptr;
}

const Model& ModelPool::insert(Model model) {
  const auto place =
      std::find_if(models_.begin(), models_.end(), [&](const Model& m) { return m.log_evidence < model.log_evidence; });
  return *models_.insert(place, std::move(model));
}

Model ModelPool::without(const Model& model, std::size_t part) {
  std::vector<Part> parts = gap::without(model.parts, part);
  if (parts.empty()) return nominal();
  if (const Model* found = find(parts)) return *found;
  return insert(fit(problem_, nominal(), std::move(parts), {.near = &model}));
}

void ModelPool::fit_without_each(const Model& model, int threads) {
  std::vector<std::vector<Part>> sets;
  for (std::size_t k = 0; k < model.parts.size() && model.parts.size() > 1; ++k) {
    std::vector<Part> parts = gap::without(model.parts, k);
    if (find(parts)) continue;
    if (problem_.far) {
      Model linear = linear_without(problem_, model, k);
      if (surely_worse(linear, model)) {
        insert(std::move(linear));
        continue;
      }
    }
    sets.push_back(std::move(parts));
  }
  extend(nominal(), model, std::move(sets), threads);
}

void ModelPool::extend(const Model& from, std::vector<std::vector<Part>> sets, int threads) {
  extend(from, from, std::move(sets), threads);
}

void ModelPool::extend(const Model& from, const Model& near, std::vector<std::vector<Part>> sets, int threads) {
  std::erase_if(sets, [&](const std::vector<Part>& s) { return find(s) != nullptr; });
  std::vector<std::optional<Model>> fitted(sets.size());
  parallel_for(static_cast<int>(sets.size()), threads,
               [&](int i) { fitted[i] = fit(problem_, from, std::move(sets[i]), {.near = &near}); });
  for (std::optional<Model>& model : fitted) insert(std::move(*model));
}

Model ModelPool::refit(const Model& model, int threads) {
  if (model.parts.empty()) return model;
  Model out = fit(problem_, nominal(), model.parts, {.threads = threads});
  for (std::vector<Model>* models : {&models_, &dropped_})
    std::erase_if(*models, [&](const Model& m) { return same_effects(m.parts, out.parts); });
  return insert(std::move(out));
}

void ModelPool::drop(const std::vector<Part>& parts) {
  const auto first = std::stable_partition(models_.begin(), models_.end(),
                                           [&](const Model& m) { return !same_effects(m.parts, parts); });
  dropped_.insert(dropped_.end(), std::make_move_iterator(first), std::make_move_iterator(models_.end()));
  models_.erase(first, models_.end());
}

void ModelPool::admit(const std::vector<Part>& parts) {
  const auto found = std::ranges::find_if(dropped_, [&](const Model& m) { return same_effects(m.parts, parts); });
  if (found == dropped_.end()) return;
  insert(std::move(*found));
  dropped_.erase(found);
}

}  // namespace kr5::gap

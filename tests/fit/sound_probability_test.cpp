#include <kr5/fit/pipeline/sound_probability.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

namespace sound_probability_test {

using kr5::fit::pipeline::settle_outliers;

namespace {

int left_out(const std::vector<double>& weights) {
  return static_cast<int>(std::count(weights.begin(), weights.end(), 0.0));
}

}  // namespace

TEST_CASE("all of many outliers leave, the worst first, and sound measurements come back") {
  std::vector<double> weights(100, 1.0);
  weights[99] = 0.0;  // sound, and left out by whatever came before
  std::vector<std::size_t> order;
  const auto probabilities = [&] {
    std::vector<double> out(100, 0.5);
    for (std::size_t i = 0; i < 30; ++i) out[i] = 1e-9 * static_cast<double>(i + 1);
    return out;
  };
  const auto refit = [&] {
    for (std::size_t i = 0; i < 30; ++i)
      if (weights[i] == 0 && std::find(order.begin(), order.end(), i) == order.end()) order.push_back(i);
  };
  settle_outliers(weights, 0.05, 40, probabilities, refit);
  CHECK(left_out(weights) == 30);
  CHECK(weights[99] == 1.0);
  CHECK(order.size() == 30);
  CHECK(std::is_sorted(order.begin(), order.end()));  // one a round
}

TEST_CASE("as many measurements stay in as must, however unsound") {
  std::vector<double> weights(10, 1.0);
  settle_outliers(
      weights, 0.05, 6, [] { return std::vector<double>(10, 0.0); }, [] {});
  CHECK(left_out(weights) == 4);
}

TEST_CASE("a measurement that is sound only while it is left out comes back twice, not for ever") {
  std::vector<double> weights(10, 1.0);
  int refits = 0;
  const auto probabilities = [&] {
    std::vector<double> out(10, 0.5);
    if (weights[3] == 1) out[3] = 0.0;
    return out;
  };
  settle_outliers(weights, 0.05, 4, probabilities, [&] { ++refits; });
  CHECK(weights[3] == 0.0);
  CHECK(refits == 5);  // out, in, out, in, out
}

}  // namespace sound_probability_test

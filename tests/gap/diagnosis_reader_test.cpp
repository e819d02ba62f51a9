#include "gap/diagnosis_reader.hpp"

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

/// @file
/// Documents of a diagnosis.

namespace diagnosis_reader_test {

using namespace kr5;

namespace {

gap::Diagnosis read(const std::string& fields) {
  return gap::read_diagnosis(io::parse_yaml("{" + fields + "}", "file"), "file");
}

const std::string least = "format: kr5-gap/2, verdict: unknown, where: [], causes: [], unexplained: []";

}  // namespace

TEST_CASE("what a document does not state is as in a diagnosis that found nothing") {
  const gap::Diagnosis d = read(least);
  CHECK(d.verdict == gap::Verdict::Unknown);
  CHECK(d.reduction.before == 1.0);
  CHECK(d.noise.empty());
  CHECK(d.spikes == 0);
  CHECK_FALSE(d.clock_reset);
}

TEST_CASE("findings are read into their fields, sentences and names of joints are passed over") {
  const gap::Diagnosis d =
      read(least +
           ", spikes: 3, scatter: 0.004, clock_reset: true, text: {verdict: all is well}"
           ", noise: [{key: current, kind: motion, ratio: 1.5, std: 0.1}]"
           ", nearest: [{effect: backlash, target: joint2, joint: elbow, gap: 2.5, reason: fits_check_worse}]");
  CHECK(d.spikes == 3);
  CHECK(d.nuisance_std == 0.004);
  CHECK(d.clock_reset);
  REQUIRE(d.noise.size() == 1);
  CHECK(d.noise[0].ratio == 1.5);
  CHECK(d.noise[0].kind == cell::Kind::Motion);
  REQUIRE(d.nearest.size() == 1);
  CHECK(d.nearest[0].gap == 2.5);
  CHECK(d.nearest[0].reason == gap::NotBlamed::FitsCheckWorse);
}

TEST_CASE("the target of a column is that of its table, where the document has none") {
  const gap::Diagnosis d = read(
      "format: kr5-gap/2, verdict: unknown, causes: [], unexplained: [], where: [{experiment: motion, column: i4, gap: "
      "2, share: 1}]");
  REQUIRE(d.where.size() == 1);
  CHECK(d.where[0].target == "joint4");
}

TEST_CASE("all that is wrong is told with its field") {
  const auto refused = [](const std::string& fields, const std::string& field) {
    CHECK_THROWS_WITH(read(fields), Catch::StartsWith("file") && Catch::Contains(field));
  };
  refused("format: other/1", "format");
  refused("format: kr5-gap/2, verdict: unknown, where: [], causes: []", "unexplained");
  refused(least + ", spikes: many", "spikes");
  refused(least + ", nearest: [[1]]", "nearest[0]");
  refused(
      "format: kr5-gap/2, verdict: explained, where: [], unexplained: [], causes: [{effect: backlash, target: joint1, "
      "parameters: {gap: {value: 1}}}]",
      "causes[0].parameters.gap.std");
}

}  // namespace diagnosis_reader_test

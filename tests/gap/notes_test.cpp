#include <kr5/gap/notes.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

/// @file
/// What was noticed beside the causes, in words.

namespace notes_test {

using namespace kr5;

namespace {

std::string joined(const gap::Diagnosis& d, bool declared = true) {
  std::string out;
  for (const gap::Note& note : gap::notes(d, declared)) out += note.text + "\n";
  return out;
}

}  // namespace

TEST_CASE("a quiet diagnosis has no notes, and every finding has one") {
  CHECK(gap::notes({}).empty());
  gap::Diagnosis d;
  std::size_t count = 0;
  const auto says = [&](const std::string& words) {
    CHECK(joined(d).find(words) != std::string::npos);
    CHECK(gap::notes(d).size() == ++count);
  };
  d.clock_reset = true;
  says("t has a different epoch");
  d.left_out = {{cell::Kind::Motion, "", {"i1", "i2"}, gap::LeftOutReason::NoiseNotStated, "current"}};
  says("motion.i1, i2 were not compared: the cell does not state noise.current.");
  d.missing_splits = {{cell::Kind::Poses, cell::Split::Fit}};
  says("poses: no fit experiment");
  d.coarse = {{"motion-1", "i3"}};
  says("motion-1.i3 shows almost no noise");
  d.excused = {{"motion.i1", 0.1}, {"motion.i2", 0.1}};
  says("2 columns");
  d.spikes = 1;
  says("1 sample is a spike and was left out.");
  d.outliers = 3;
  says("3 more samples deviate");
  d.sets_limit = 20;
  says("More than 20 sets");
  d.effects_limit = 6;
  says("max_effects: 6");
  d.noise = {{"pose_position", cell::Kind::Poses, 1.234, 0.056}};
  says("pose position in poses 1.23 ± 0.06");
  d.nuisance_std = 0.004;
  says("by about 0.4 %, friction by 0.8 %");
  CHECK(joined(d, false).find("that of neighbouring rows") != std::string::npos);
}

TEST_CASE("a clock is late or early by a number and its uncertainty, before all other warnings") {
  gap::Diagnosis d;
  d.spikes = 2;
  d.clock_faults = {{"wrench", {cell::Kind::Motion}, -0.01234, 0.00056}};
  const std::vector<std::string> found = gap::warnings(d);
  REQUIRE(found.size() == 2);
  CHECK(found[0] == "The wrench of motion was logged 12.34 ± 0.56 ms early relative to the other columns.");
  d.clock_faults[0].delay = 0.001;
  CHECK(gap::warnings(d)[0].find("late") != std::string::npos);
}

TEST_CASE("of many columns the first and the last are named, and limits have their reason") {
  CHECK(gap::left_out_text({cell::Kind::Motion, "", {"i1", "i2", "i3", "i4"}, gap::LeftOutReason::NotPredicted, ""}) ==
        "motion.i1 to i4 (4 columns) were not compared: the simulator does not predict it");
  CHECK(gap::left_out_text({cell::Kind::Scan, "scan-1", {}, gap::LeftOutReason::Refused, "there is no laser"}) ==
        "scan-1 was not compared: there is no laser");
  CHECK(gap::limit_text({gap::ScopeReason::FewRows, cell::Kind::Poses, "poses-1", 1}) ==
        "poses-1 has 1 row: it can show neither a gap nor its absence");
  CHECK(gap::limit_text({gap::ScopeReason::OneKind, cell::Kind::Step}).find("it shows the path correction") !=
        std::string::npos);
}

}  // namespace notes_test

#include <kr5/rsi/late_answers.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace late_answers_test {

TEST_CASE("cycles without an answer in succession stop at exactly the limit, and an answer begins anew") {
  LateAnswers late(usual_rules(Controller::Krc4));
  for (int round = 0; round < 3; ++round) {
    for (int i = 1; i < 100; ++i) REQUIRE(late.count(false) == ProgramStopReason::None);
    CHECK(late.in_succession() == 99);
    CHECK(late.count(true) == ProgramStopReason::None);
    CHECK(late.in_succession() == 0);
  }
  for (int i = 1; i < 100; ++i) REQUIRE(late.count(false) == ProgramStopReason::None);
  CHECK(late.count(false) == ProgramStopReason::LateAnswers);
  CHECK((late.total() == 397 && late.max_in_succession() == 100));
}

TEST_CASE("a share of late answers stops a KR C2 that no succession of them stops, and no other controller") {
  ControllerRules rules = usual_rules(Controller::Krc2);
  CHECK((rules.max_late == 10 && rules.max_late_share == 0.1 && rules.late_window == 1000));
  LateAnswers late(rules), other(usual_rules(Controller::Krc5));
  for (int i = 0; i < 99; ++i) {
    REQUIRE(late.count(false) == ProgramStopReason::None);
    REQUIRE(late.count(true) == ProgramStopReason::None);
  }
  CHECK(late.share() == Approx(0.099));
  CHECK(late.count(false) == ProgramStopReason::LateShare);
  for (int i = 0; i < 5000; ++i) REQUIRE(other.count(i % 2 == 0) == ProgramStopReason::None);
}

TEST_CASE("what left the window no longer counts") {
  ControllerRules rules;
  rules.max_late_share = 0.5;
  rules.late_window = 10;
  LateAnswers late(rules);
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i < 4; ++i) REQUIRE(late.count(false) == ProgramStopReason::None);
    for (int i = 0; i < 6; ++i) REQUIRE(late.count(true) == ProgramStopReason::None);
  }
  CHECK(late.share() == Approx(0.4));
  late.restart();
  CHECK((late.share() == 0.0 && late.in_succession() == 0 && late.total() == 80));
}

TEST_CASE("rules that no controller has are refused with their field") {
  const auto refused = [](auto change, const char* field) {
    ControllerRules rules;
    change(rules);
    CHECK_THROWS_WITH(rules.validate(), Catch::StartsWith(field));
  };
  refused([](ControllerRules& r) { r.cycle = 4.0; }, "cycle");
  refused([](ControllerRules& r) { r.answer_time = 0.005; }, "answer_time");
  refused([](ControllerRules& r) { r.max_late = 0; }, "max_late");
  refused([](ControllerRules& r) { r.max_late_share = 1.5; }, "max_late_share");
  refused([](ControllerRules& r) { r.late_window = 0; }, "late_window");
  refused([](ControllerRules& r) { r.axis_limit = -1; }, "axis_limit");
  refused([](ControllerRules& r) { r.idle_limit = 0; }, "idle_limit");
}

}  // namespace late_answers_test

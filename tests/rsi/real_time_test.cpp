#include <kr5/rsi/real_time.hpp>

#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace real_time_test {

RealTimeStatus asked(const RealTimeOptions& options) {
  RealTimeStatus out;
  std::thread([&] { out = request_real_time(options); }).join();
  return out;
}

TEST_CASE("what is not asked for is not touched") {
  const RealTimeStatus status = asked({.priority = 0, .lock_memory = false});
  CHECK(
      (status.priority == Grant::NotAsked && status.locked_memory == Grant::NotAsked && status.cpu == Grant::NotAsked));
  CHECK(real_time_remedies(status).empty());
}

TEST_CASE("what is asked for is given or denied, with a word for each denial") {
  const RealTimeStatus status = asked({.priority = 1, .lock_memory = false, .cpu = 1000});
  CHECK(status.priority != Grant::NotAsked);
  CHECK(status.cpu == Grant::Denied);
  CHECK(real_time_remedies(status).size() == 1 + (status.priority == Grant::Denied));
  const auto words = real_time_remedies({Grant::Denied, Grant::Denied, Grant::NotAsked});
  REQUIRE(words.size() == 2);
  CHECK_THAT(words[0], Catch::Contains("rtprio"));
  CHECK_THAT(words[1], Catch::Contains("memlock"));
}

TEST_CASE("options that no kernel knows are refused") {
  CHECK_THROWS_WITH(RealTimeOptions{.priority = 100}.validate(), Catch::StartsWith("priority"));
  CHECK_THROWS_WITH(RealTimeOptions{.priority = -1}.validate(), Catch::StartsWith("priority"));
  CHECK_THROWS_WITH(RealTimeOptions{.cpu = -1}.validate(), Catch::StartsWith("cpu"));
}

}  // namespace real_time_test

#include <kr5/job/record_ring.hpp>

#include <memory>
#include <thread>

#include <catch2/catch.hpp>

namespace record_ring_test {

using namespace kr5::job;

TEST_CASE("records come out as they went in, numbered behind those of the program before") {
  const auto ring = std::make_unique<RecordRing>();
  ring->begin_after(41);
  CHECK(ring->after(41) == nullptr);
  JobRecord record;
  record.pellet = 7;
  CHECK(ring->push(record) == 42);
  REQUIRE(ring->after(41) != nullptr);
  CHECK(ring->after(41)->number == 42);
  CHECK(ring->after(41)->pellet == 7);
  CHECK(ring->after(42) == nullptr);
}

TEST_CASE("a full ring takes nothing, and loses nothing") {
  const auto ring = std::make_unique<RecordRing>();
  for (std::size_t k = 1; k <= RecordRing::capacity; ++k) REQUIRE(ring->push({}) == k);
  CHECK(ring->push({}) == 0);
  CHECK(ring->after(0)->number == 1);
  ring->note_written(1);
  CHECK(ring->push({}) == RecordRing::capacity + 1);
  CHECK(ring->push({}) == 0);
}

TEST_CASE("a failure is told until something is written") {
  const auto ring = std::make_unique<RecordRing>();
  ring->push({});
  CHECK_FALSE(ring->failed());
  ring->note_failure();
  CHECK(ring->failed());
  CHECK(ring->written() == 0);
  ring->note_written(1);
  CHECK_FALSE(ring->failed());
}

TEST_CASE("one thread pushes while another takes") {
  constexpr int all = 200000;
  const auto ring = std::make_unique<RecordRing>();
  std::thread pushing([&] {
    for (int k = 1; k <= all;) {
      JobRecord record;
      record.pellet = record.attempt = k;
      if (ring->push(record) != 0)
        ++k;
      else
        std::this_thread::yield();
    }
  });
  int wrong = 0;
  for (std::uint64_t taken = 0; taken < all;) {
    const JobRecord* next = ring->after(taken);
    if (!next) {
      std::this_thread::yield();
      continue;
    }
    wrong += next->number != taken + 1 || next->pellet != static_cast<int>(taken + 1) || next->attempt != next->pellet;
    ring->note_written(++taken);
  }
  pushing.join();
  CHECK(wrong == 0);
}

}  // namespace record_ring_test

// SPDX-License-Identifier: BSD-3-Clause
// A link over loopback at a controller's pace: a plain client of its own sends a telegram a cycle and waits for the
// answer until the next one, beside threads that do nothing but take processor time.
//
//   build/tools/benchmarks/rsi_link CYCLE_MS SECONDS [HOGS]
//
// The last line is the figures as JSON. A cycle is missed when its answer is not there before the next telegram.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <thread>
#include <vector>

#include <kr5/rsi/link.hpp>

namespace {

using namespace kr5;
using namespace kr5::rsi;

constexpr long nanoseconds = 1'000'000'000;

robot::RobotCommand stand(const robot::RobotReading& reading) noexcept {
  robot::RobotCommand out;
  out.space = robot::CommandSpace::Joints;
  out.joints = reading.joints;
  return out;
}

/// A UDP socket that speaks to a port of this computer.
int client_of(int port) {
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  if (connect(out, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) std::perror("connect"), std::exit(1);
  return out;
}

std::string telegram(long long ipoc) {
  return "<Rob TYPE=\"KUKA\"><RIst X=\"445.0\" Y=\"0.0\" Z=\"790.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\" />"
         "<RSol X=\"445.0\" Y=\"0.0\" Z=\"790.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\" />"
         "<AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\" />"
         "<ASPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\" />"
         "<MACur A1=\"0.0\" A2=\"0.0\" A3=\"0.0\" A4=\"0.0\" A5=\"0.0\" A6=\"0.0\" />"
         "<Delay D=\"0\" /><IPOC>" +
         std::to_string(ipoc) + "</IPOC></Rob>";
}

/// Sleeps a cycle on. A client that slept for half a cycle too long begins a new rhythm, so that an answer has its
/// whole cycle: how late the client is says nothing of the link.
void sleep_on(timespec& when, long cycle) {
  when.tv_nsec += cycle;
  when.tv_sec += when.tv_nsec / nanoseconds;
  when.tv_nsec %= nanoseconds;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) != 0) continue;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (nanoseconds * (now.tv_sec - when.tv_sec) + now.tv_nsec - when.tv_nsec > cycle / 2) when = now;
}

/// Whether the answer to an IPOC is there.
bool is_answered(int socket, long long ipoc) {
  std::array<char, 4096> bytes;
  const std::string wanted = "<IPOC>" + std::to_string(ipoc) + "</IPOC>";
  for (ssize_t size; (size = recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
    if (std::string_view(bytes.data(), static_cast<std::size_t>(size)).find(wanted) != std::string_view::npos)
      return true;
  return false;
}

long missed_cycles(int port, long cycle, long cycles) {
  const int socket = client_of(port);
  request_real_time({.priority = 70, .lock_memory = false});
  timespec when{};
  clock_gettime(CLOCK_MONOTONIC, &when);
  long missed = 0;
  long long ipoc = 1000;
  for (long i = 0; i < cycles; ++i, ipoc += cycle / 1'000'000) {
    const std::string bytes = telegram(ipoc);
    if (send(socket, bytes.data(), bytes.size(), 0) < 0) std::perror("send"), std::exit(1);
    sleep_on(when, cycle);
    missed += !is_answered(socket, ipoc);
  }
  close(socket);
  return missed;
}

}  // namespace

int main(int argc, char** argv) {
  const int milliseconds = argc > 1 ? std::atoi(argv[1]) : 4, seconds = argc > 2 ? std::atoi(argv[2]) : 10;
  if (milliseconds < 1 || seconds < 1) return std::fprintf(stderr, "usage: rsi_link CYCLE_MS SECONDS [HOGS]\n"), 2;
  std::atomic<bool> over{false};
  std::vector<std::thread> hogs(static_cast<std::size_t>(argc > 3 ? std::max(0, std::atoi(argv[3])) : 0));
  for (std::thread& hog : hogs)
    hog = std::thread([&over] {
      while (!over.load(std::memory_order_relaxed)) continue;
    });
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.port = 49153;
  LinkOptions options;
  options.cycle = 1e-3 * milliseconds;
  options.listen = "127.0.0.1";
  const Link link(layout, {}, options, stand);
  const long missed = missed_cycles(link.port(), 1'000'000L * milliseconds, 1000L * seconds / milliseconds);
  over = true;
  for (std::thread& hog : hogs) hog.join();
  for (const std::string& remedy : real_time_remedies(link.real_time())) std::printf("%s\n", remedy.c_str());
  const LinkStatistics s = link.statistics();
  std::printf(
      R"({"cycle_ms": %d, "seconds": %d, "hogs": %zu, "priority": "%s", "missed": %ld, "late": %llu, "lost": %llu, )"
      R"("p50": %.6f, "p99": %.6f, "p999": %.6f, "max": %.6f})"
      "\n",
      milliseconds, seconds, hogs.size(), std::string(name_of(link.real_time().priority)).c_str(), missed,
      static_cast<unsigned long long>(s.late), static_cast<unsigned long long>(s.lost), s.answer.p50, s.answer.p99,
      s.answer.p999, s.answer.max);
}

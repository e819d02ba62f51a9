#include <kr5/rsi/link_rows.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "observed_link.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::MadeCycle;
using kr5::test::MadeLink;

namespace link_rows_test {

constexpr double deg = M_PI / 180;

TelegramLayout layout() { return test::wire_layout("krc4_ros_rsi_ethernet.xml"); }

Eigen::Index column(const LinkRowReader& reader, const std::string& name) {
  const auto at = std::ranges::find(reader.names(), name);
  REQUIRE(at != reader.names().end());
  return at - reader.names().begin();
}

bool rises(const Eigen::MatrixXd& values) {
  for (Eigen::Index i = 1; i < values.rows(); ++i)
    if (!(values(i, 0) > values(i - 1, 0))) return false;
  return true;
}

TEST_CASE("a row has what the controller told, in SI, at the time of IPOC") {
  Random random(31);
  MadeLink link(random, 200);
  link.cycles[5].answered = false;
  LinkRowReader reader(layout());
  CHECK(reader.names() == std::vector<std::string>{"t",          "ipoc", "q1",  "q2",  "q3",  "q4",  "q5",
                                                   "q6",         "qc1",  "qc2", "qc3", "qc4", "qc5", "qc6",
                                                   "x",          "y",    "z",   "rx",  "ry",  "rz",  "late_packets",
                                                   "answer_time"});
  const LinkRows rows = reader.read(link.seen());
  REQUIRE(rows.values.rows() == 200);
  CHECK(rows.faulty.empty());
  for (Eigen::Index i = 0; i < 200; ++i) {
    const MadeCycle& c = link.cycles[static_cast<std::size_t>(i)];
    CHECK(rows.values(i, 0) == Approx(link.cycles[0].time + 0.004 * static_cast<double>(i)));
    CHECK(rows.values(i, 1) == static_cast<double>(c.ipoc));
    CHECK(rows.values(i, column(reader, "q3")) == Approx(c.axes[2] * deg).margin(1e-6));
    CHECK(rows.values(i, column(reader, "z")) == Approx(0.79));
    const double answer = rows.values(i, column(reader, "answer_time"));
    CHECK((i == 5 ? std::isnan(answer) : answer == c.answer_time));
  }
}

TEST_CASE(
    "rows rise in time over losses, repeats, overtaken telegrams, restarts and jumps; other senders are left out") {
  Random random(32);
  MadeLink link(random, 400);
  for (std::size_t i = 200; i < 400; ++i) {
    link.cycles[i].time += 3.0;
    link.cycles[i].ipoc = 4 + 4 * (i - 200);  // it starts again
  }
  for (std::size_t i = 300; i < 400; ++i) link.cycles[i].ipoc += 50000;
  link.between.push_back({.time = link.cycles[50].time + 1e-3,
                          .sender = link.cycles[50].sender,
                          .telegram = MadeLink::rob(link.cycles[50])});
  link.between.push_back({.time = link.cycles[60].time + 1e-3,
                          .sender = link.cycles[60].sender,
                          .telegram = MadeLink::rob(link.cycles[58])});
  link.between.push_back(
      {.time = link.cycles[70].time + 1e-3, .sender = "10.0.0.1:1", .telegram = MadeLink::rob(link.cycles[90])});
  link.between.push_back({.time = 0.5, .sender = "10.0.0.2:1", .telegram = "hello"});
  LinkRowReader reader(layout());
  const LinkRows rows = reader.read(link.seen());
  CHECK(rises(rows.values));
  CHECK(rows.values.rows() == 400);
  CHECK(rows.values(399, 0) == Approx(link.cycles[399].time).margin(0.1));
  REQUIRE(rows.faulty.size() == 1);
  CHECK((rows.faulty[0].fault == TelegramFault::Foreign && rows.faulty[0].sender == "10.0.0.2:1"));
}

TEST_CASE("bit by bit the rows are the same as at once") {
  Random random(33);
  const MadeLink link(random, 300);
  const LinkObservations seen = link.seen();
  LinkRowReader whole(layout()), bits(layout());
  const Eigen::MatrixXd all = whole.read(seen).values;
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < seen.exchanges.size();) {
    LinkObservations part;
    for (int k = random.integer(20); k >= 0 && i < seen.exchanges.size(); --k)
      part.exchanges.push_back(seen.exchanges[i++]);
    const Eigen::MatrixXd values = bits.read(part).values;
    CHECK(values == all.middleRows(row, values.rows()));
    row += values.rows();
  }
  CHECK(row == all.rows());
}

}  // namespace link_rows_test

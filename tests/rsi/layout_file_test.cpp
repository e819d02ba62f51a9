#include <kr5/rsi/layout_file.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;

namespace layout_file_test {

bool same(const std::vector<TelegramElement>& a, const std::vector<TelegramElement>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const TelegramElement& x, const TelegramElement& y) {
    return x.tag == y.tag && x.type == y.type && x.index == y.index && x.hold == y.hold;
  });
}

void reads_back(const TelegramLayout& layout) {
  const TelegramLayout again = parse_layout(layout_xml(layout), "written");
  CHECK((again.controller == Controller::Krc2) == (layout.controller == Controller::Krc2));
  CHECK((again.address == layout.address && again.port == layout.port && again.transport == layout.transport));
  CHECK((again.sensor_type == layout.sensor_type && again.only_send == layout.only_send));
  CHECK(same(again.send, layout.send));
  CHECK(same(again.receive, layout.receive));
  CHECK(layout_xml(again) == layout_xml(layout));
}

TEST_CASE("the configurations of published drivers are read, and written back") {
  const TelegramLayout c4 = load_layout(test::wire_file("krc4_ros_rsi_ethernet.xml"));
  CHECK((c4.controller == Controller::Krc4 && c4.port == 49152 && c4.sensor_type == "ImFree" && !c4.only_send));
  CHECK((c4.send.size() == 5 && c4.receive.size() == 6));
  CHECK((c4.receive[2].tag == "AK.A3" && c4.receive[2].index == 3 && c4.receive[2].hold == true));
  const TelegramLayout c2 = load_layout(test::wire_file("krc2_ros_rsi_ethernet.xml"));
  CHECK((c2.controller == Controller::Krc2 && c2.transport == Transport::Udp && c2.send[0].unit == "0"));
  const TelegramLayout fzi = load_layout(test::wire_file("fzi_ros_rsi_ethernet.xml"));
  CHECK((fzi.address == "192.168.3.20" && fzi.sensor_type == "KukaRsiDriver" && fzi.send.size() == 13));
  CHECK((fzi.send[11].tag == "ProgStatus.R" && fzi.send[11].type == ValueType::Long && fzi.send[11].index == 7));
  for (const TelegramLayout& layout : {c4, c2, fzi}) reads_back(layout);
}

TEST_CASE("every layout of ours reads back") {
  for (const Controller c : {Controller::Krc2, Controller::Krc4, Controller::Krc5}) reads_back(usual_layout(c));
  reads_back(book_layout());
  for (const Controller c : {Controller::Krc2, Controller::Krc4, Controller::Krc5}) reads_back(job_layout(c));
  TelegramLayout silent = usual_layout(Controller::Krc4);
  silent.only_send = true;
  silent.receive.clear();
  reads_back(silent);
}

TEST_CASE("a configuration that is none is refused with its line") {
  const std::string good = layout_xml(usual_layout(Controller::Krc2));
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& word) {
    std::string bad = good;
    bad.replace(bad.find(from), from.size(), to);
    CHECK_THROWS_WITH(parse_layout(bad, "f"), Catch::Contains(word));
  };
  refused("<PORT>49152", "<PORT>many", "f:4: <PORT>: found \"many\"");
  refused("<PORT>49152", "<PORT>0", "port");
  refused("<PROTOCOL>UDP", "<PROTOCOL>SCTP", "f:5");
  refused("LENGTH>Off", "LENGTH>On", "f:7");
  refused("ONLYSEND>FALSE", "ONLYSEND>NO", "f:8");
  refused("TYPE=\"DOUBLE\"", "TYPE=\"COMPLEX\"", "f:12");
  refused("INDX=\"INTERNAL\"", "INDX=\"x\"", "f:12");
  refused("TAG=\"DEF_RIst\"", "", "has no TAG");
  refused("DEF_RIst", "DEF_Color", "DEF_Color");
  refused("<SEND>", "<SENT>", "f:");
  CHECK_THROWS_WITH(parse_layout("", "f"), Catch::Contains("f:1"));
  CHECK_THROWS_WITH(parse_layout("<a>", "f"), Catch::Contains("no XML"));
  CHECK_THROWS_WITH(parse_layout("<ROOT/>", "f"), Catch::Contains("CONFIG"));
  CHECK_THROWS_WITH(load_layout(test::wire_file("krc4_ros_rsi.rsi.xml")), Catch::Contains("signal flow"));
  CHECK_THROWS_AS(load_layout(test::wire_file("not_there.xml")), IoError);
}

TEST_CASE("texts that XML does not bear are not written") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.address = "<evil>";
  CHECK_THROWS_AS(layout_xml(layout), InvalidArgument);
}

}  // namespace layout_file_test

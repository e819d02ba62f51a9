#include <kr5/rsi/telegram_layout.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace telegram_layout_test {

std::string names(const std::vector<TelegramElement>& elements) {
  std::string out;
  for (const TelegramField& f : telegram_fields(elements))
    out += (out.empty() ? "" : " ") + f.element + (f.attribute.empty() ? "" : "." + f.attribute);
  return out;
}

TelegramElement channel(const std::string& tag, int index) { return {.tag = tag, .index = index}; }

TEST_CASE("internal elements have the attributes of the controller") {
  CHECK(names({{"DEF_RIst"}}) == "RIst.X RIst.Y RIst.Z RIst.A RIst.B RIst.C");
  CHECK(names({{"DEF_AIPos"}}) == "AIPos.A1 AIPos.A2 AIPos.A3 AIPos.A4 AIPos.A5 AIPos.A6");
  CHECK(names({{"DEF_MECur"}}) == "MECur.E1 MECur.E2 MECur.E3 MECur.E4 MECur.E5 MECur.E6");
  CHECK(names({{"DEF_Delay"}, {"DEF_EStr"}}) == "Delay.D EStr");
  CHECK(names({{"DEF_Tech.C1"}}) ==
        "Tech.C11 Tech.C12 Tech.C13 Tech.C14 Tech.C15 Tech.C16 Tech.C17 Tech.C18 Tech.C19 Tech.C110");
}

TEST_CASE("tags with a dot are attributes of one element, which stands where the first of them does") {
  CHECK(names({channel("Digout.o1", 2), channel("DiL", 1), channel("Digout.o2", 3)}) == "Digout.o1 Digout.o2 DiL");
}

TEST_CASE("names tell what is meant and which component, and a meaning that is stated counts more") {
  const auto fields = telegram_fields({channel("AKorr.A3", 1),
                                       channel("RKorr.C", 2),
                                       channel("AK.A6", 3),
                                       {.tag = "Mine.q2", .index = 4, .meaning = Meaning::AxisCorrection},
                                       channel("Source1", 5)});
  CHECK((fields[0].meaning == Meaning::AxisCorrection && fields[0].component == 2));
  CHECK((fields[1].meaning == Meaning::CartesianCorrection && fields[1].component == 5));
  CHECK((fields[2].meaning == Meaning::AxisCorrection && fields[2].component == 5));
  CHECK((fields[3].meaning == Meaning::AxisCorrection && fields[3].component == 1));
  CHECK((fields[4].meaning == Meaning::Other && fields[4].attribute.empty()));
  const auto wrench = telegram_fields(
      {channel("FT.Tz", 1), channel("FT.Fx", 2), {.tag = "Wrist.Fz", .index = 3, .meaning = Meaning::SensorWrench}});
  CHECK((wrench[0].meaning == Meaning::SensorWrench && wrench[0].component == 5));
  CHECK((wrench[1].component == 0 && wrench[2].component == 2));
}

TEST_CASE("elements that are no telegram's are refused") {
  const auto refused = [](const std::vector<TelegramElement>& elements, const std::string& word) {
    CHECK_THROWS_WITH(telegram_fields(elements), Catch::Contains(word));
  };
  refused({{"DEF_Torque"}}, "DEF_Torque");
  refused({{"DEF_Tech.X1"}}, "DEF_Tech.C1");
  refused({{"DEF_Tech.C7"}}, "DEF_Tech.C1");
  refused({channel("AK.A1", 1), channel("AK.A1", 2)}, "twice");
  refused({channel("DiO", 1), channel("DiO.a", 2)}, "not both");
  refused({channel("a b", 1)}, "no name");
  refused({channel("a.b.c", 1)}, "no name");
  refused({channel("", 1)}, "no name");
  refused({channel("1st", 1)}, "no name");
  refused({channel(std::string(32, 'x'), 1)}, "31");
  refused({channel("IPOC", 1)}, "IPOC");
  refused({channel("AKorr.A7", 1)}, "1 to 6");
  refused({channel("RKorr.D", 1)}, "X, Y, Z");
  refused({channel("FT.F7", 1)}, "Fx, Fy, Fz");
  refused({channel("FT", 1)}, "Fx, Fy, Fz");
  std::vector<TelegramElement> many;
  for (int i = 0; i <= max_values; ++i) many.push_back(channel("V" + std::to_string(i), 1));
  refused(many, "160");
}

TEST_CASE("a layout is checked field by field") {
  for (const Controller c :
       {Controller::Krc2, Controller::Krc4Rsi3, Controller::Krc4, Controller::Krc5, Controller::Iiqka})
    for (const CorrectionSpace space : {CorrectionSpace::Axes, CorrectionSpace::Cartesian})
      CHECK_NOTHROW(usual_layout(c, space).validate());
  CHECK_NOTHROW(book_layout().validate());
  const auto refused = [](auto change, const std::string& word) {
    TelegramLayout layout = usual_layout(Controller::Krc4);
    change(layout);
    CHECK_THROWS_WITH(layout.validate(), Catch::StartsWith(word));
  };
  refused([](auto& l) { l.address = ""; }, "address");
  refused([](auto& l) { l.port = 0; }, "port");
  refused([](auto& l) { l.port = 65536; }, "port");
  refused([](auto& l) { l.transport = Transport::Tcp; }, "transport");
  refused([](auto& l) { l.sensor_type = "a\"b"; }, "sensor_type");
  refused([](auto& l) { l.decimals = 0; }, "decimals");
  refused([](auto& l) { l.externals = 7; }, "externals");
  refused([](auto& l) { l.linear_externals = {7}; }, "linear_externals");
  refused([](auto& l) { l.current_units = {NAN}; }, "current_units");
  refused([](auto& l) { l.gripper.air = 32; }, "gripper");
  refused([](auto& l) { l.gripper.fingers = -1; }, "gripper");
  refused([](auto& l) { l.receive[0].index = 2; }, "receive: AKorr.A2");
  refused([](auto& l) { l.receive[0].index = 65; }, "receive: AKorr.A1");
  refused([](auto& l) { l.receive[0].index.reset(); }, "receive: AKorr.A1");
  refused([](auto& l) { l.send[0].index = 1; }, "send: DEF_RIst");
}

TEST_CASE("motor angles are handed on under their names") {
  TelegramLayout layout = usual_layout(Controller::Krc4);
  layout.send.push_back({.tag = "DEF_MAPos"});
  CHECK(names(layout.send).ends_with("MAPos.A1 MAPos.A2 MAPos.A3 MAPos.A4 MAPos.A5 MAPos.A6"));
  CHECK(telegram_fields(layout.send).back().meaning == Meaning::Other);
}

TEST_CASE("the layout of a job has the wrench, the inputs, the state of the program, and a stop") {
  for (const Controller c :
       {Controller::Krc2, Controller::Krc4Rsi3, Controller::Krc4, Controller::Krc5, Controller::Iiqka}) {
    const TelegramLayout job = job_layout(c);
    CHECK_NOTHROW(job.validate());
    CHECK(names(job.send).ends_with("Delay.D FT.Fx FT.Fy FT.Fz FT.Tx FT.Ty FT.Tz DiL ProgStatus"));
    CHECK(names(job.receive) == "RKorr.X RKorr.Y RKorr.Z RKorr.A RKorr.B RKorr.C DiO Stop");
    CHECK((job.gripper.gripped && job.gripper.fingers));
  }
}

TEST_CASE("the book's layout is that of its appendix") {
  const TelegramLayout book = book_layout();
  CHECK((book.port == 6008 && book.transport == Transport::Tcp && book.sensor_type == "ImFree"));
  CHECK(telegram_fields(book.send).size() == 6 * 8 + 1 + 10 + 1 + 3 + 1);
  CHECK(telegram_fields(book.receive).size() == 1 + 6 + 6 + 10 + 1);
}

}  // namespace telegram_layout_test

#include <kr5/rsi/controller_files.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/layout_file.hpp>

#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using Catch::Contains;

namespace controller_files_test {

std::string text_of(const ControllerFiles& files, const std::string& name) {
  for (const ControllerFile& f : files.files)
    if (f.name == name) return f.text;
  FAIL("no file " + name);
  return {};
}

int count(const std::string& text, const std::string& what) {
  int out = 0;
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++out;
  return out;
}

TEST_CASE("the files of a KR C4 with RSI 3 have the numbers of a published driver") {
  TelegramLayout layout = test::wire_layout("krc4_ros_rsi_ethernet.xml");
  layout.controller = Controller::Krc4Rsi3;
  const ControllerFiles files = controller_files(layout, {.name = "ros_rsi", .axis_limit = M_PI / 2});
  CHECK((files.unwired.empty() && files.unconfirmed.empty()));
  const std::string flow = text_of(files, "ros_rsi.rsi.xml");
  for (const char* line :
       {"<RSIObject ObjType=\"AXISCORR\" ObjTypeID=\"33\" ObjID=\"AXISCORR1\">",
        "<Input InIdx=\"6\" OutObjID=\"ETHERNET1\" OutIdx=\"6\" />",
        "<Parameter Name=\"LowerLimA6\" ParamID=\"6\" ParamValue=\"-90\" />",
        "<Parameter Name=\"UpperLimA1\" ParamID=\"13\" ParamValue=\"90\" />",
        "<RSIObject ObjType=\"ETHERNET\" ObjTypeID=\"64\" ObjID=\"ETHERNET1\">",
        "<Parameter Name=\"ConfigFile\" ParamID=\"1\" ParamValue=\"ros_rsi_ethernet.xml\" IsRuntime=\"false\" />",
        "<Parameter Name=\"Timeout\" ParamID=\"1\" ParamValue=\"100\" />",
        "<Parameter Name=\"Flag\" ParamID=\"4\" ParamValue=\"1\" />",
        "<Parameter Name=\"Precision\" ParamID=\"8\" ParamValue=\"4\" />",
        "<RSIObject ObjType=\"AXISCORRMON\" ObjTypeID=\"82\" ObjID=\"AXISCORRMON1\">",
        "<Parameter Name=\"MaxE6\" ParamID=\"12\" ParamValue=\"6\" />"})
    CHECK_THAT(flow, Contains(line));
  const std::string program = text_of(files, "ros_rsi.src");
  for (const char* line : {"DEF ros_rsi( )", "RSI_CREATE(\"ros_rsi.rsi\",CONTID,TRUE)", "RSI_ON(#ABSOLUTE)",
                           "RSI_MOVECORR()", "RSI_OFF()"})
    CHECK_THAT(program, Contains(line));
}

TEST_CASE("RSI 4, 5 and 6 count from 0, each in its own form") {
  const auto flow_of = [](Controller c, CorrectionSpace space) {
    return text_of(controller_files(usual_layout(c, space)), "kr5_rsi.rsix");
  };
  CHECK_THAT(flow_of(Controller::Krc4, CorrectionSpace::Axes), Contains("Version=\"0.1.0\""));
  for (const Controller c : {Controller::Krc4, Controller::Krc5, Controller::Iiqka}) {
    const std::string axes = flow_of(c, CorrectionSpace::Axes);
    CHECK_THAT(axes, Contains("<Parameter Name=\"UpperLimA1\" ParamId=\"6\""));
    CHECK_THAT(axes, Contains("<Input InIdx=\"5\" OutObjId=\"ETHERNET1\" OutIdx=\"5\" />"));
    CHECK_THAT(axes, Contains("<Parameter Name=\"Precision\" ParamId=\"7\""));
    const std::string cartesian = flow_of(c, CorrectionSpace::Cartesian);
    CHECK_THAT(cartesian, Contains("ObjTypeId=\"27\" ObjType=\"PosCorr\""));
    CHECK_THAT(cartesian,
               Contains("<Parameter IsRuntime=\"false\" Name=\"RefCorrSys\" ParamId=\"0\" ParamValue=\"1\" />"));
    CHECK_THAT(cartesian, Contains("ObjTypeId=\"81\" ObjType=\"PosCorrMon\""));
    CHECK_THAT(cartesian, Contains("<Input InIdx=\"0\" OutObjId=\"ETHERNET1\" OutIdx=\"6\" />"));  // the gripper
  }
  CHECK_THAT(flow_of(Controller::Krc5, CorrectionSpace::Axes), Contains("SchemaVersion=\"2.0.0\""));
  const std::string iiqka = text_of(controller_files(usual_layout(Controller::Iiqka)), "kr5_rsi.src");
  for (const char* call :
       {"RSI_LOAD(\"kr5_rsi\")", "RSI_ACTIVATE(\"kr5_rsi\")", "RSI_PROCESS_ON(#ABSOLUTE)", "RSI_PROCESS_OFF()"})
    CHECK_THAT(iiqka, Contains(call));
}

TEST_CASE("modes, frames, starts and cycles reach the program") {
  ProgramOptions options;
  options.mode = robot::CommandMode::Relative;
  options.frame = robot::CommandFrame::Tool;
  options.cycle = 0.012;
  options.start = {0.0, -M_PI / 2, M_PI / 2, 0.0, M_PI / 4, 0.0};
  const ControllerFiles files = controller_files(usual_layout(Controller::Krc4, CorrectionSpace::Cartesian), options);
  CHECK_THAT(text_of(files, "kr5_rsi.src"), Contains("RSI_ON(#RELATIVE,#IPO)"));
  CHECK_THAT(text_of(files, "kr5_rsi.src"), Contains("PTP {A1 0, A2 -90, A3 90, A4 0, A5 45, A6 0}"));
  CHECK_THAT(text_of(files, "kr5_rsi.rsix"), Contains("Name=\"RefCorrSys\" ParamId=\"0\" ParamValue=\"3\""));
}

TEST_CASE("a KR C2 wires its objects in the program") {
  TelegramLayout layout = test::wire_layout("krc2_ros_rsi_ethernet.xml");
  const ControllerFiles files = controller_files(layout, {.axis_limit = M_PI * 100 / 180});
  CHECK((files.files.size() == 2 && files.unwired.empty() && files.unconfirmed.empty()));
  const std::string program = text_of(files, "kr5_rsi.src");
  CHECK(count(program, "ST_NEWLINK(hEthernet") == 6);
  for (const char* call : {"CHAR file[12]", "ST_ETHERNET(hEthernet,container,file[])", "ST_AXISCORR(hAxis,container)",
                           "ST_NEWLINK(hEthernet,6,hAxis,6)", "ST_SETPARAM(hAxis,1,0)", "ST_SETPARAM(hAxis,2,-100)",
                           "ST_SETPARAM(hAxis,19,100)", "ST_ON()", "ST_SKIPSENS()", "ST_OFF()"})
    CHECK_THAT(program, Contains(call));
  const ControllerFiles book = controller_files(book_layout());
  CHECK(book.unconfirmed == std::vector<std::string>{"ST_PATHCORR", "ST_ON1"});
  CHECK(book.unwired == std::vector<std::string>{"DiL", "Digout.o1", "Digout.o2", "Digout.o3", "ST_Source", "DiO"});
}

TEST_CASE("what cannot be wired is told, and readings have their sources") {
  TelegramLayout layout = test::wire_layout("fzi_ros_rsi_ethernet.xml");
  ControllerFiles files = controller_files(layout);
  CHECK(files.unwired.empty());
  CHECK_THAT(text_of(files, "kr5_rsi.rsix"), Contains("<Input InIdx=\"5\" OutObjId=\"GEARTORQUE1\" OutIdx=\"5\" />"));
  CHECK_THAT(text_of(files, "kr5_rsi.rsix"), Contains("<Input InIdx=\"7\" OutObjId=\"OV_PRO1\" OutIdx=\"0\" />"));
  layout.send.push_back({.tag = "Source1", .index = 9});
  layout.receive.push_back({.tag = "FREE", .type = ValueType::Long, .index = 7});
  files = controller_files(layout);
  CHECK(files.unwired == std::vector<std::string>{"Source1", "FREE"});
  layout = usual_layout(Controller::Krc4Rsi3, CorrectionSpace::Cartesian);
  CHECK(controller_files(layout).unconfirmed == std::vector<std::string>{"POSCORR1", "POSCORRMON1"});
}

TEST_CASE("the files of a job stop the motion, tell state and inputs, and name the sensor as to be wired") {
  const std::vector<std::string> sensor = {"FT.Fx", "FT.Fy", "FT.Fz", "FT.Tx", "FT.Ty", "FT.Tz"};
  const ControllerFiles files = controller_files(job_layout(Controller::Krc4), {.timeout = 10});
  CHECK(files.unwired == sensor);
  const std::string flow = text_of(files, "kr5_rsi.rsix");
  for (const char* line :
       {"ObjType=\"Stop\" ObjId=\"STOP1\"", "<Input InIdx=\"0\" OutObjId=\"ETHERNET1\" OutIdx=\"7\" />",
        "<Input InIdx=\"6\" OutObjId=\"DIGIN1\" OutIdx=\"0\" />",
        "<Input InIdx=\"7\" OutObjId=\"STATUS1\" OutIdx=\"0\" />",
        "<Parameter Name=\"Timeout\" ParamId=\"0\" ParamValue=\"10\" />"})
    CHECK_THAT(flow, Contains(line));
  CHECK_THAT(text_of(files, "kr5_rsi_ethernet.xml"), Contains("TAG=\"FT.Fx\" TYPE=\"DOUBLE\" INDX=\"1\""));
}

TEST_CASE("options that no controller takes are refused") {
  const TelegramLayout layout = usual_layout(Controller::Krc2);
  const auto refused = [&](const ProgramOptions& options, const std::string& field) {
    CHECK_THROWS_WITH(controller_files(layout, options), Catch::StartsWith(field));
  };
  refused({.name = "1a"}, "name");
  refused({.name = std::string(25, 'a')}, "name");
  refused({.cycle = 0.004}, "cycle");
  refused({.cycle = NAN}, "cycle");
  refused({.start = {0.0}}, "start");
  refused({.start = std::vector<double>(6, 90.0)}, "start");
  refused({.timeout = 0}, "timeout");
  refused({.flag = -1}, "flag");
  refused({.axis_limit = NAN}, "axis_limit");
  refused({.translation_limit = 5.0}, "translation_limit");
  refused({.rotation_limit = 0.0}, "rotation_limit");
  refused({.external_limit = -1.0}, "external_limit");
}

}  // namespace controller_files_test

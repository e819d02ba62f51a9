// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <filesystem>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/rsi/axis_mapping.hpp>
#include <kr5/rsi/controller_files.hpp>
#include <kr5/rsi/emulator.hpp>
#include <kr5/rsi/kuka_pose.hpp>
#include <kr5/rsi/layout_file.hpp>
#include <kr5/rsi/layout_settings.hpp>
#include <kr5/rsi/link.hpp>
#include <kr5/rsi/link_diagnosis.hpp>
#include <kr5/rsi/link_recorder.hpp>
#include <kr5/rsi/link_rows.hpp>
#include <kr5/rsi/side_channel.hpp>
#include <kr5/rsi/telegram_codec.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::rsi;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_layout(py::module_& m) {
  bind_enum<Controller>(m, "Controller", "Controller: krc2 | krc4_rsi3 | krc4 | krc5 | iiqka.");
  bind_enum<Transport>(m, "Transport", "Transport: udp | tcp.");
  bind_enum<ValueType>(m, "ValueType", "Type of a value: bool | long | float | double | string.");
  bind_enum<Meaning>(m, "Meaning", "What an element of a telegram means.");
  bind_enum<CorrectionSpace>(m, "CorrectionSpace", "What corrections move: axes | cartesian.");
  bind_struct<TelegramElement>(m, "TelegramElement", "One element of the controller's sensor configuration.");
  bind_struct<GripperBits>(m, "GripperBits", "Bits of the gripper in the digital inputs and outputs.");
  bind_struct<TelegramField>(m, "TelegramField", "One value of a telegram.");
  bind_struct<ControllerAxes>(m, "ControllerAxes", "How a controller counts the joints of the arm.")
      .def("axes", &ControllerAxes::axes, py::arg("q"), "Values of the controller's axes, of joint values [rad or m].")
      .def("joints", &ControllerAxes::joints, py::arg("axes"), "Joint values, of the controller's axes [rad or m].");
  bind_struct<TelegramLayout>(m, "TelegramLayout", "Both telegrams between controller and computer, and their socket.");
  m.def("usual_layout", &usual_layout, py::arg("controller"), py::arg("space") = CorrectionSpace::Axes,
        "Layout of poses, axes, motor currents and late packets in, corrections and the bits of a gripper out.");
  m.def("job_layout", &job_layout, py::arg("controller"),
        "Layout of a job from bin to tube: Cartesian corrections, force/torque sensor, gripper, state, and a stop.");
  bind_struct<LayoutSettings>(m, "LayoutSettings",
                              "What the sensor configuration of a controller does not hold (kr5-rsi-settings/1).");
  m.def("load_layout_settings", &load_layout_settings, py::arg("file"),
        "Settings of a YAML file. IoError names file, line and field.");
  m.def("with_settings", &with_settings, py::arg("layout"), py::arg("settings"),
        "The layout with these settings; what they do not hold stays. InvalidArgument names the field.");
  m.def("book_layout", &book_layout, "Layout of the KR C2 of the book, over TCP.");
  m.def("telegram_fields", &telegram_fields, py::arg("elements"),
        "Values of a telegram in the order in which they stand.");
  m.def("parse_layout", &parse_layout, py::arg("xml"), py::arg("source"),
        "Layout of a sensor configuration; raises IoError with line and element.");
  m.def(
      "load_layout", [](const std::filesystem::path& file) { return load_layout(file); }, py::arg("file"),
      "Layout of the sensor configuration in a file.");
  m.def("layout_xml", &layout_xml, py::arg("layout"), "Sensor configuration of a layout, for the controller.");
}

void bind_files(py::module_& m) {
  bind_struct<ProgramOptions>(m, "ProgramOptions", "Options of controller_files.");
  bind_struct<ControllerFile>(m, "ControllerFile", "A file for a controller.");
  bind_struct<ControllerFiles>(m, "ControllerFiles", "Files for a controller, and what is left to do by hand.");
  m.def("controller_files", &controller_files, py::arg("layout"), py::arg("options") = ProgramOptions{},
        "Sensor configuration, signal flow and KRL program for the controller of a layout.");
  m.def("from_kuka", &from_kuka, py::arg("xyzabc"), "Pose of X Y Z A B C in mm and degrees [m].");
  m.def("to_kuka", &to_kuka, py::arg("T"), "X Y Z A B C of a pose [mm, deg].");
}

py::dict plain_values(const TelegramCodec& codec, const Telegram& t) {
  py::dict out;
  for (std::size_t i = 0; i < codec.fields().size(); ++i) {
    const TelegramField& f = codec.fields()[i];
    if (!t.present[i]) continue;
    const std::string name = f.attribute.empty() ? f.element : f.element + "." + f.attribute;
    if (f.type == ValueType::String)
      out[py::str(name)] = py::bytes(std::string(t.message.text())).attr("decode")("utf-8", "replace");
    else
      out[py::str(name)] = t.values[i];
  }
  return out;
}

/// Telegram of values by their names; those that are not named are 0.
Telegram telegram_of(const TelegramCodec& codec, const py::dict& values, std::uint64_t ipoc) {
  Telegram out;
  out.ipoc = Ipoc(ipoc);
  for (const auto& [key, value] : values) {
    const auto name = key.cast<std::string>();
    bool known = false;
    for (std::size_t i = 0; i < codec.fields().size(); ++i) {
      const TelegramField& f = codec.fields()[i];
      if (name != (f.attribute.empty() ? f.element : f.element + "." + f.attribute)) continue;
      known = true;
      if (f.type == ValueType::String)
        out.message = MessageText(value.cast<std::string>());
      else
        out.values[i] = value.cast<double>();
    }
    kr5::require(known, name + ": no value of the telegram has this name");
  }
  return out;
}

void bind_codec(py::module_& m) {
  bind_enum<Sender>(m, "Sender", "Who writes a telegram: controller | computer.");
  bind_enum<TelegramFault>(m, "TelegramFault", "What is wrong with a telegram; none: nothing.");
  bind_struct<TelegramCounts>(m, "TelegramCounts", "Telegrams by what was wrong with them.")
      .def("faulty", &TelegramCounts::faulty, "Number of all but the good ones.");
  py::class_<TelegramCodec>(m, "TelegramCodec", "Codec of the telegrams of one sender, in the units of the wire.")
      .def(py::init<const TelegramLayout&, Sender>(), py::arg("layout"), py::arg("sender"))
      .def(
          "decode",
          [](const TelegramCodec& self, const py::bytes& bytes) {
            Telegram t;
            const TelegramFault fault = self.decode(static_cast<std::string_view>(bytes), t);
            return py::make_tuple(fault, plain_values(self, t), std::string(t.ipoc.text()));
          },
          py::arg("bytes"), "Fault, values by their names, and IPOC as it came.")
      .def(
          "encode",
          [](const TelegramCodec& self, const py::dict& values, std::uint64_t ipoc) {
            std::array<char, max_telegram> bytes;
            const std::size_t size = self.encode(telegram_of(self, values, ipoc), bytes);
            kr5::require(size > 0, "the telegram cannot be written: values must be finite and at most 1e9");
            return py::bytes(bytes.data(), size);
          },
          py::arg("values"), py::arg("ipoc"), "Bytes of a telegram; values that are not named are 0.")
      .def_property_readonly("telegram_fields", &TelegramCodec::fields, "Values of the telegram in their order.");
}

void bind_link(py::module_& m) {
  bind_struct<MotionLimits>(m, "MotionLimits", "Limits of one coordinate of a correction.");
  bind_struct<CorrectionLimits>(m, "CorrectionLimits", "Limits of corrections, which hold whoever asks.");
  bind_struct<RealTimeOptions>(m, "RealTimeOptions", "What the thread of a link asks of the kernel.");
  bind_enum<Grant>(m, "Grant", "Whether the kernel gave what it was asked for: not_asked | given | denied.");
  bind_struct<RealTimeStatus>(m, "RealTimeStatus", "What the kernel gave.");
  bind_enum<Reconnect>(m, "Reconnect", "What follows when a controller is there again: hold | resume.");
  bind_enum<LinkState>(m, "LinkState", "State of a link: waiting | running | holding.");
  bind_struct<LinkOptions>(m, "LinkOptions", "Options of Link.");
  bind_struct<Distribution>(m, "Distribution", "Summary of durations.");
  bind_struct<LinkStatistics>(m, "LinkStatistics", "What a link has seen since it began.");
  m.def("real_time_remedies", &real_time_remedies, py::arg("status"),
        "What the kernel denied, and how it is permitted, a sentence each.");
  py::class_<Link>(m, "Link",
                   "The computer's end of the sensor interface, in a thread of its own, without commands: it answers a "
                   "controller, tells a gripper to hold, and keeps statistics. Commands are computed in C++ "
                   "(kr5/rsi/link.hpp).")
      .def(py::init([](const TelegramLayout& layout, const LinkOptions& options) {
             return std::make_unique<Link>(layout, kr5::robot::SensorModel{}, options, CycleFunction());
           }),
           py::arg("layout"), py::arg("options") = LinkOptions{})
      .def_property_readonly("port", &Link::port, "Port that it listens on.")
      .def_property_readonly("real_time", &Link::real_time, "What the kernel gave to its thread.")
      .def("statistics", &Link::statistics, "What it has seen since it began.");
}

void bind_emulation(py::module_& m) {
  bind_enum<LimitAction>(m, "LimitAction", "What a correction beyond its limit does: stop | hold.");
  bind_struct<ControllerRules>(m, "ControllerRules",
                               "Rules by which a controller judges answers and corrects its path.");
  m.def("usual_rules", &usual_rules, py::arg("controller"), "Rules of a controller as it is delivered.");
  bind_enum<ControllerPhase>(m, "ControllerPhase", "Phase: running | drives_off | emergency_stop | ended.");
  bind_enum<ProgramStopReason>(m, "ProgramStopReason", "Why a program ended; none: it has not.");
  bind_struct<ProgramStop>(m, "ProgramStop", "Why a program ended.");
  m.def("stop_message", &stop_message, py::arg("controller"), py::arg("stop"),
        "What the controller shows when the program ends.");
  bind_enum<EventKind>(m, "EventKind", "What happens to a controller.");
  bind_struct<ControllerEvent>(m, "ControllerEvent", "What happened to a controller, and when.");
  bind_enum<CountFrom>(m, "CountFrom", "From when on cycles without an answer count: telegram | answer.");
  bind_struct<EmulationOptions>(m, "EmulationOptions", "A controller and its program.");
  bind_struct<EmulationStatistics>(m, "EmulationStatistics", "What an emulated controller has seen since it began.");
  bind_enum<AnswerVerdict>(m, "AnswerVerdict", "What became of an answer: good | faulty | foreign | late | ...");
  using kr5::robot::Robot;
  using kr5::robot::SensorModel;
  py::class_<EmulatedController>(m, "EmulatedController",
                                 "A controller's end of the sensor interface without socket and clock: `cycle`, then "
                                 "`receive` for each answer.")
      .def(py::init<const TelegramLayout&, const SensorModel&, const EmulationOptions&, Robot&>(), py::arg("layout"),
           py::arg("model"), py::arg("options"), py::arg("robot"), py::keep_alive<1, 5>())
      .def(
          "cycle", [](EmulatedController& self) { return py::bytes(std::string(self.cycle())); },
          "Moves the robot for a cycle; the telegram of its end. Empty: there is none.")
      .def(
          "receive",
          [](EmulatedController& self, const py::bytes& bytes, double since) {
            return self.receive(static_cast<std::string_view>(bytes), since);
          },
          py::arg("bytes"), py::arg("since"), "An answer, some time after the telegram [s]; what became of it.")
      .def("set_drives", &EmulatedController::set_drives, py::arg("on"), "Drives on or off.")
      .def("emergency_stop", &EmulatedController::emergency_stop, "The arm brakes; drives on end it.")
      .def("set_override", &EmulatedController::set_override, py::arg("share"), "Override of the path, 0 to 1 [-].")
      .def("reset_program", &EmulatedController::reset_program, "The program is reset and started again.")
      .def_property_readonly("statistics", &EmulatedController::statistics, py::return_value_policy::copy,
                             "What it has seen since it began (a copy).")
      .def_property_readonly("events", &EmulatedController::events, py::return_value_policy::copy,
                             "What happened so far (copies).")
      .def_property_readonly("reading", &EmulatedController::reading, py::return_value_policy::copy,
                             "Last reading of the robot (a copy).");
}

/// Its thread may want to call Python before it ends.
struct WithoutPython {
  void operator()(const Emulator* emulator) const {
    const py::gil_scoped_release free;
    delete emulator;
  }
};

void bind_emulator(py::module_& m) {
  bind_enum<LinkFault>(m, "LinkFault", "Fault of a message: late | lose | double | reorder | truncate.");
  bind_struct<TimedFault>(m, "TimedFault", "A fault at a given time.");
  bind_struct<LinkFaults>(m, "LinkFaults", "Which messages of a link are faulty.");
  bind_struct<LinkFaultCounts>(m, "LinkFaultCounts", "Messages by the fault that they had.");
  py::class_<FaultyWay>(m, "FaultyWay", "A way on which messages have faults. It has no clock.")
      .def(py::init<const LinkFaults&>(), py::arg("faults"))
      .def(
          "put", [](FaultyWay& self, const py::bytes& bytes, double time) { self.pass(std::string_view(bytes), time); },
          py::arg("bytes"), py::arg("time"), "A message starts at a time [s].")
      .def(
          "take", [](FaultyWay& self, double time) { return py::bytes(std::string(self.next(time))); }, py::arg("time"),
          "A message that has arrived by a time [s], in the order of arrival; empty: none.")
      .def_property_readonly("next_time", &FaultyWay::next_time,
                             "When the next one arrives; infinite: none is on its way [s].")
      .def_property_readonly(
          "counts", [](const FaultyWay& self) { return self.counts(); }, "Messages by their faults (a copy).");
  bind_struct<EmulatorOptions>(m, "EmulatorOptions", "Options of Emulator.");
  bind_struct<EmulatorStatistics>(m, "EmulatorStatistics", "What an emulator has seen since it began.");
  using kr5::robot::Robot;
  using kr5::robot::SensorModel;
  using free_python = py::call_guard<py::gil_scoped_release>;
  py::class_<Emulator, std::unique_ptr<Emulator, WithoutPython>>(
      m, "Emulator",
      "A controller with its socket and clock, in a thread of its own: it sends to address and port of the layout, for "
      "anybody's client, and keeps the controller's rules.")
      .def(py::init<const TelegramLayout&, const SensorModel&, const EmulatorOptions&, Robot&>(), py::arg("layout"),
           py::arg("model"), py::arg("options"), py::arg("robot"), py::keep_alive<1, 5>())
      .def("set_drives", &Emulator::set_drives, py::arg("on"), free_python(), "Drives on or off.")
      .def("emergency_stop", &Emulator::emergency_stop, free_python(), "The arm brakes; drives on end it.")
      .def("set_override", &Emulator::set_override, py::arg("share"), free_python(),
           "Override of the path, 0 to 1 [-].")
      .def("reset_program", &Emulator::reset_program, free_python(),
           "Closes the connection; the program starts anew where the arm stands.")
      .def("statistics", &Emulator::statistics, free_python(), "What it has seen since it began.")
      .def("events", &Emulator::events, free_python(), "What happened so far.")
      .def("reading", &Emulator::reading, free_python(), "Last reading of the robot.")
      .def(
          "joint_correction", [](const Emulator& self) { return Eigen::VectorXd(self.joint_correction()); },
          free_python(), "Total correction of each joint [rad or m].")
      .def("tool_correction", &Emulator::tool_correction, free_python(), "Total correction of the tool [m].")
      .def_property_readonly(
          "own_port", [](const Emulator& self) { return self.own_port(); }, "UDP port that it sends from.")
      .def_property_readonly("real_time", &Emulator::real_time, "What the kernel gave to its thread.");
}

void bind_observations(py::module_& m) {
  bind_struct<TestMotionOptions>(m, "TestMotionOptions", "Options of the test motion of a LinkRecorder.")
      .def_property_readonly("total", &TestMotionOptions::total, "Time until all components were moved [s].");
  bind_struct<LinkObservations>(m, "LinkObservations", "What was seen at the port of a link for some time.")
      .def("append", &LinkObservations::append, py::arg("later"), "Adds what was seen later.")
      .def(
          "__len__", [](const LinkObservations& self) { return self.exchanges.size(); }, "Number of datagrams.");
  py::class_<LinkRecorder>(m, "LinkRecorder",
                           "A link that records what it sees: it answers without correction, or with those of a test "
                           "motion, or only listens.")
      .def(py::init<const TelegramLayout&, const LinkOptions&, const std::optional<TestMotionOptions>&>(),
           py::arg("layout"), py::arg("options") = LinkOptions{}, py::arg("motion") = std::nullopt)
      .def("take", &LinkRecorder::take, "What was seen since the last call; to be called every few seconds.")
      .def("statistics", &LinkRecorder::statistics, "What the link has seen since it began.")
      .def_property_readonly("real_time", &LinkRecorder::real_time, "What the kernel gave to its thread.")
      .def_property_readonly("aborted", &LinkRecorder::aborted, "Whether a test motion was given up.")
      .def_property_readonly("port", &LinkRecorder::port, "Port that it listens on.");
  bind_struct<FaultyTelegram>(m, "FaultyTelegram", "A telegram that could not be used.");
  bind_struct<LinkRows>(m, "LinkRows", "Telegrams as rows of numbers.");
  py::class_<LinkRowReader>(m, "LinkRowReader", "Makes rows of what was observed, bit by bit.")
      .def(py::init<const TelegramLayout&>(), py::arg("layout"))
      .def("read", &LinkRowReader::read, py::arg("observations"), "Rows of further telegrams, in SI.")
      .def_property_readonly("names", &LinkRowReader::names, "Names of the columns.");
}

void bind_diagnosis(py::module_& m) {
  bind_enum<LinkFindingKind>(m, "LinkFindingKind", "What can be wrong with a link.");
  bind_enum<FindingSeverity>(m, "FindingSeverity", "Whether a link can work with what is wrong: fault | caution.");
  bind_enum<LinkVerdict>(m, "LinkVerdict", "Verdict on a link: sound | faulty | undecided.");
  bind_struct<DiagnosisOptions>(m, "DiagnosisOptions", "Options of examine_link.")
      .def("cycle_of", &DiagnosisOptions::cycle_of, py::arg("controller"), "Cycle of a controller [s].");
  bind_struct<LinkFinding>(m, "LinkFinding", "One thing that is wrong with a link.");
  bind_struct<LinkDiagnosis>(m, "LinkDiagnosis", "What is wrong with a link.");
  m.def("examine_link", &examine_link, py::arg("observations"), py::arg("layout"),
        py::arg("options") = DiagnosisOptions{}, "What is wrong with the link of a layout, by what was observed.");
}

void bind_axis_mapping(py::module_& m) {
  bind_enum<MappingFrames>(m, "MappingFrames", "Active base and tool of the controller: known | unknown | either.");
  bind_enum<MappingStatus>(m, "MappingStatus",
                           "Status of a search: found | ambiguous | not_moved | nothing_fits | too_few_rows.");
  bind_struct<AxisPoseRow>(m, "AxisPoseRow", "Axis values and pose of one cycle, as a controller tells them.");
  bind_struct<AxisMappingOptions>(m, "AxisMappingOptions", "Options of find_axis_mapping.");
  bind_struct<AxisMapping>(m, "AxisMapping", "Directions and zeros by which an arm gives the poses told.");
  bind_struct<AxisMappingResult>(m, "AxisMappingResult", "Mappings of a controller's axes that fit what it tells.");
  m.def("axis_pose_rows", &axis_pose_rows, py::arg("observations"), py::arg("layout"),
        "Axis values and poses of the telegrams that were observed; empty where the layout lacks one of them.");
  m.def("find_axis_mapping", &find_axis_mapping, py::arg("rows"), py::arg("model"),
        py::arg("options") = AxisMappingOptions{},
        "Directions and zeros of a controller's axes, from rows that it told and the model of the arm.");
}

void bind_side_channel(py::module_& m) {
  bind_enum<SideKind>(m, "SideKind", "Kind of a result: vision | force.");
  bind_struct<VisionResult>(m, "VisionResult", "Where a camera sees something.");
  bind_struct<ForceResult>(m, "ForceResult", "Reading of a force sensor.");
  bind_struct<SideMessage>(m, "SideMessage", "A datagram of the side channel.");
  bind_struct<SideStatistics>(m, "SideStatistics", "What came over the side channel.");
  m.attr("usual_side_port") = usual_side_port;
  m.def("side_now", &side_now, "Clock of the side channel, which does not jump [ns].");
  py::class_<SideSender>(m, "SideSender", "Sends results to another computer, or to all of a network.")
      .def(py::init<const std::string&, int>(), py::arg("address"), py::arg("port") = usual_side_port)
      .def("send", py::overload_cast<const VisionResult&, std::int64_t>(&SideSender::send), py::arg("result"),
           py::arg("time"),
           "Sends a result with the time of its measurement by side_now; whether that was possible [ns].")
      .def("send", py::overload_cast<const ForceResult&, std::int64_t>(&SideSender::send), py::arg("result"),
           py::arg("time"));
  py::class_<SidePort>(m, "SidePort", "Receives results, and keeps the newest of each kind.")
      .def(py::init<int, const std::string&>(), py::arg("port") = usual_side_port, py::arg("listen") = "0.0.0.0")
      .def("receive", &SidePort::receive, "Takes what has come, without waiting; whether there is a newer result.")
      .def(
          "latest",
          [](const SidePort& self, SideKind kind) {
            const SideMessage* found = self.results().latest(kind);
            return found ? std::optional(*found) : std::nullopt;
          },
          py::arg("kind"), "The newest result of a kind.")
      .def(
          "age", [](const SidePort& self, SideKind kind) { return self.results().age(kind, side_now()); },
          py::arg("kind"), "Time since it was measured, but for the least delay of the network [s].")
      .def_property_readonly(
          "statistics", [](const SidePort& self) { return self.results().statistics(); }, "What came so far.")
      .def_property_readonly("port", &SidePort::port, "Port that it listens on.");
}

}  // namespace

void bind_rsi(py::module_& m) {
  m.doc() =
      "KUKA's RobotSensorInterface: telegrams, files for the controller, the link, an emulated "
      "controller, results between computers.";
  bind_layout(m);
  bind_files(m);
  bind_codec(m);
  bind_link(m);
  bind_emulation(m);
  bind_emulator(m);
  bind_observations(m);
  bind_diagnosis(m);
  bind_axis_mapping(m);
  bind_side_channel(m);
}

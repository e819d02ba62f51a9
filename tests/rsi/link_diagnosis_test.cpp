#include <kr5/rsi/link_diagnosis.hpp>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/layout_file.hpp>
#include <support/trials.hpp>

#include "observed_link.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::MadeCycle;
using kr5::test::MadeLink;

namespace link_diagnosis_test {

TelegramLayout layout() {
  TelegramLayout out = test::wire_layout("krc4_ros_rsi_ethernet.xml");
  out.port = 49152;
  return out;
}

std::set<std::string> kinds(const LinkDiagnosis& diagnosis) {
  std::set<std::string> out;
  for (const LinkFinding& f : diagnosis.findings) out.emplace(name_of(f.kind));
  return out;
}

const LinkFinding& finding(const LinkDiagnosis& diagnosis, LinkFindingKind kind) {
  const auto at = std::ranges::find(diagnosis.findings, kind, &LinkFinding::kind);
  if (at == diagnosis.findings.end()) throw std::runtime_error("not found: " + std::string(name_of(kind)));
  return *at;
}

/// A cycle that is neither the first few nor the last.
std::size_t inner(Random& random, const MadeLink& link) {
  return 100 + static_cast<std::size_t>(random.integer(static_cast<int>(link.cycles.size()) - 200));
}

void delay_from(MadeLink& link, std::size_t at, double time, std::int64_t ipoc) {
  for (std::size_t i = at; i < link.cycles.size(); ++i) {
    link.cycles[i].time += time;
    link.cycles[i].ipoc = static_cast<std::uint64_t>(static_cast<std::int64_t>(link.cycles[i].ipoc) + ipoc);
  }
}

void replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == text.npos) throw std::runtime_error("no " + from);
  text.replace(at, from.size(), to);
}

/// The element with all its attributes.
std::string cut_element(std::string& text, const std::string& name) {
  const std::size_t begin = text.find("<" + name), end = text.find("/>", begin) + 2;
  std::string out = text.substr(begin, end - begin);
  text.erase(begin, end - begin);
  return out;
}

/// Of some of the cycles, not next to each other.
std::vector<std::size_t> some_of(Random& random, const MadeLink& link, int count) {
  std::set<std::size_t> out;
  while (static_cast<int>(out.size()) < count) out.insert(inner(random, link) / 8 * 8);
  return {out.begin(), out.end()};
}

struct Injection {
  std::string kind;
  void (*put)(Random& random, MadeLink& link);
};

const std::vector<Injection>& injections() {
  static const std::vector<Injection> all = {
      {"lost_telegrams",
       [](Random& random, MadeLink& link) {
         const auto lost = some_of(random, link, 5 + random.integer(30));
         for (auto at = lost.rbegin(); at != lost.rend(); ++at) {
           for (std::size_t i = *at; i < link.cycles.size(); ++i) ++link.cycles[i].delay;
           link.cycles.erase(link.cycles.begin() + static_cast<std::ptrdiff_t>(*at));
         }
       }},
      {"repeated_telegrams",
       [](Random& random, MadeLink& link) {
         for (const std::size_t at : some_of(random, link, 5 + random.integer(30))) {
           Exchange e{.time = link.cycles[at].time + random.uniform(1e-4, 3e-3), .sender = link.cycles[at].sender};
           e.telegram = MadeLink::rob(link.cycles[at]);
           e.answer = MadeLink::sen(link.cycles[at]);
           e.duration = 1e-4;
           link.between.push_back(e);
         }
       }},
      {"reordered_telegrams",
       [](Random& random, MadeLink& link) {
         for (const std::size_t at : some_of(random, link, 5)) {
           std::swap(link.cycles[at].ipoc, link.cycles[at + 1].ipoc);
           link.cycles[at].time = link.cycles[at + 1].time - 1e-4;  // the later one was not held up
         }
       }},
      {"jitter",
       [](Random& random, MadeLink& link) {
         const double size = random.uniform(1.5e-3, 3e-3);
         for (MadeCycle& c : link.cycles) c.time += random.uniform(0, size);
       }},
      {"interrupted",
       [](Random& random, MadeLink& link) {
         const double pause = random.uniform(0.7, 3.0);
         delay_from(link, inner(random, link), pause, random.integer(2) == 0 ? std::lround(250 * pause) * 4 : 0);
       }},
      {"controller_restarted",
       [](Random& random, MadeLink& link) {
         const std::size_t at = inner(random, link);
         delay_from(link, at, random.uniform(2, 30), 500 - static_cast<std::int64_t>(link.cycles[at].ipoc));
         if (random.integer(2) == 0)
           for (std::size_t i = at; i < link.cycles.size(); ++i) link.cycles[i].sender = "192.168.1.20:49153";
       }},
      {"controller_clock_jump",
       [](Random& random, MadeLink& link) {
         const std::int64_t jump = 200 + random.integer(100000);
         delay_from(link, inner(random, link), 0.0, random.integer(2) == 0 ? jump : -jump / 300 - 20);
       }},
      {"computer_clock_jump",
       [](Random& random, MadeLink& link) {
         link.clock_set = random.uniform(0.2, 4000) * (random.integer(2) == 0 ? 1 : -1);
         link.clock_set_at = link.cycles[inner(random, link)].time;
       }},
      {"stopped_sending", [](Random& random, MadeLink& link) { link.tail = random.uniform(0.7, 5.0); }},
      {"second_sender",
       [](Random& random, MadeLink& link) {
         MadeLink other(random, 30 + random.integer(100));
         for (const MadeCycle& c : other.cycles)
           link.between.push_back({.time = 0.5 + c.time, .sender = "10.0.0.7:5000", .telegram = MadeLink::rob(c)});
       }},
      {"late_answers",
       [](Random& random, MadeLink& link) {
         for (const std::size_t at : some_of(random, link, 5 + random.integer(30))) {
           link.cycles[at].answer_time = random.uniform(3.5e-3, 9e-3);
           for (std::size_t i = at + 1; i < link.cycles.size(); ++i) ++link.cycles[i].delay;
         }
       }},
      {"answers_rejected",
       [](Random& random, MadeLink& link) {
         for (std::size_t i = static_cast<std::size_t>(random.integer(300)); i < link.cycles.size(); ++i)
           link.cycles[i].delay = static_cast<int>(i);
       }},
      {"ipoc_not_echoed",
       [](Random& random, MadeLink& link) {
         const int how = random.integer(3);
         for (MadeCycle& c : link.cycles)
           c.answer_ipoc = how == 0 ? "0" : how == 1 ? "0" + std::to_string(c.ipoc) : std::to_string(c.ipoc + 4);
       }},
      {"wrong_type",
       [](Random& random, MadeLink& link) {
         if (random.integer(2) == 0)
           link.change = [](std::string text, std::size_t) { return replace(text, "KUKA", "ROBO"), text; };
         else
           for (MadeCycle& c : link.cycles) c.answer_type = "KR5";
       }},
      {"missing_elements",
       [](Random& random, MadeLink& link) {
         static const std::vector<std::string> names = {"RSol", "AIPos", "ASPos", "Delay"};
         const std::string name = names[static_cast<std::size_t>(random.integer(4))];
         link.change = [name](std::string text, std::size_t) { return cut_element(text, name), text; };
       }},
      {"unknown_elements",
       [](Random&, MadeLink& link) {
         link.change = [](std::string text, std::size_t) {
           return replace(text, "<IPOC>", "<Krl V=\"3\" /><IPOC>"), text;
         };
       }},
      {"other_order",
       [](Random& random, MadeLink& link) {
         static const std::vector<std::string> names = {"RIst", "RSol", "AIPos", "ASPos"};
         const std::string name = names[static_cast<std::size_t>(random.integer(4))];
         link.change = [name](std::string text, std::size_t) {
           const std::string element = cut_element(text, name);
           return replace(text, "<IPOC>", element + "<IPOC>"), text;
         };
       }},
      {"damaged_telegrams",
       [](Random& random, MadeLink& link) {
         const int how = random.integer(3);
         const auto damaged = some_of(random, link, 20);
         link.change = [how, damaged](std::string text, std::size_t at) {
           if (!std::ranges::binary_search(damaged, at)) return text;
           if (how == 0) text.resize(text.size() / 2);
           if (how == 1) replace(text, "X=\"", "X=\"nan");
           if (how == 2) replace(text, "<IPOC>", "<IPOC>-");
           return text;
         };
         for (const std::size_t at : damaged) {
           link.cycles[at].answered = false;
           for (std::size_t i = at + 1; i < link.cycles.size(); ++i) ++link.cycles[i].delay;
         }
       }},
      {"foreign_datagrams",
       [](Random& random, MadeLink& link) {
         for (int i = 0; i < 20; ++i)
           link.between.push_back({.time = random.uniform(0.1, 3.0), .sender = "10.0.0.9:123", .telegram = "hello"});
       }},
  };
  return all;
}

TEST_CASE("a sound link is called sound, whatever its controller, clock and arm") {
  Random random(11);
  for (int trial = 0; trial < test::trials(60, 60); ++trial) {
    MadeLink link(random, 300 + random.integer(600));
    const LinkDiagnosis d = examine_link(link.seen(), layout());
    CAPTURE(trial, kinds(d));
    CHECK((d.verdict == LinkVerdict::Sound && d.findings.empty()));
    CHECK(*d.cycle == Approx(0.004).epsilon(0.02));
    CHECK(d.telegrams.good == link.cycles.size());
  }
}

TEST_CASE("a fault drawn at random is named, and no other") {
  Random random(12);
  const int all = static_cast<int>(injections().size());
  for (int trial = 0; trial < test::trials(10 * all, 10 * all); ++trial) {
    const Injection& drawn = injections()[static_cast<std::size_t>(trial < all ? trial : random.integer(all))];
    MadeLink link(random);
    drawn.put(random, link);
    const std::set<std::string> found = kinds(examine_link(link.seen(), layout()));
    CAPTURE(trial, drawn.kind);
    CHECK(found == std::set<std::string>{drawn.kind});
  }
}

TEST_CASE("faults that come together are each named") {
  Random random(13);
  const int all = static_cast<int>(injections().size());
  int both = 0;
  const int trials = test::trials(60, 60);
  for (int trial = 0; trial < trials; ++trial) {
    const Injection &a = injections()[static_cast<std::size_t>(random.integer(9))],
                    &b = injections()[static_cast<std::size_t>(10 + random.integer(all - 14))];
    if (a.kind == "repeated_telegrams") continue;  // made of the telegrams as they are without the other fault
    if (b.kind == "wrong_type") continue;          // of telegrams that are not the controller's nothing else is judged
    MadeLink link(random);
    a.put(random, link);
    b.put(random, link);
    const std::set<std::string> found = kinds(examine_link(link.seen(), layout()));
    CAPTURE(trial, a.kind, b.kind, found);
    CHECK((found.contains(a.kind) && found.contains(b.kind)));
    ++both;
  }
  CHECK(both > trials / 2);
}

TEST_CASE("what was lost, repeated and late is counted") {
  Random random(14);
  MadeLink link(random);
  for (int i = 0; i < 7; ++i) link.cycles.erase(link.cycles.begin() + 100 + 20 * i);
  link.cycles.erase(link.cycles.begin() + 400, link.cycles.begin() + 403);
  link.cycles[50].answer_time = 5e-3;
  const LinkDiagnosis d = examine_link(link.seen(), layout());
  CHECK(finding(d, LinkFindingKind::LostTelegrams).count == 10);
  CHECK(finding(d, LinkFindingKind::LostTelegrams).severity == FindingSeverity::Fault);
  CHECK(finding(d, LinkFindingKind::LateAnswers).count == 1);
  CHECK(finding(d, LinkFindingKind::LateAnswers).severity == FindingSeverity::Caution);
  CHECK(*finding(d, LinkFindingKind::LateAnswers).expected_time == Approx(0.004 * 10 / 12));
}

TEST_CASE("the cycle is measured, also where half of the telegrams are lost, and compared with the expected one") {
  Random random(15);
  for (const double cycle : {0.004, 0.012}) {
    MadeLink link(random, 1200, cycle);
    for (std::size_t i = link.cycles.size(); i-- > 1;)
      if (random.uniform() < 0.5) link.cycles.erase(link.cycles.begin() + static_cast<std::ptrdiff_t>(i));
    for (const double expected : {0.004, 0.012}) {
      const LinkDiagnosis d = examine_link(link.seen(), layout(), {.cycle = expected});
      CHECK(*d.cycle == Approx(cycle).epsilon(0.05));
      CHECK(kinds(d).contains("wrong_rate") == (cycle != expected));
      CHECK(kinds(d).contains("lost_telegrams"));
    }
  }
  MadeLink link(random, 300, 0.012);
  const LinkDiagnosis d = examine_link(link.seen(), layout());
  CHECK(kinds(d) == std::set<std::string>{"wrong_rate"});
  CHECK(*finding(d, LinkFindingKind::WrongRate).measured_time == Approx(0.012).epsilon(0.02));
  TelegramLayout old = layout();
  old.controller = Controller::Krc2;
  CHECK(examine_link(link.seen(), old).verdict == LinkVerdict::Sound);
}

TEST_CASE("elements are named: missing, unknown, in another order") {
  Random random(16);
  MadeLink link(random, 100);
  link.change = [](std::string text, std::size_t) {
    cut_element(text, "RSol");
    replace(text, " A3=", " A7=");
    const std::string delay = cut_element(text, "Delay");
    replace(text, "<RIst", delay + "<RIst");
    return text;
  };
  const LinkDiagnosis d = examine_link(link.seen(), layout());
  CHECK(finding(d, LinkFindingKind::MissingElements).names == std::vector<std::string>{"RSol", "AIPos.A3"});
  CHECK(finding(d, LinkFindingKind::UnknownElements).names == std::vector<std::string>{"AIPos.A7"});
  CHECK(finding(d, LinkFindingKind::OtherOrder).found == "Delay RIst AIPos ASPos");
  CHECK(finding(d, LinkFindingKind::OtherOrder).expected == "RIst AIPos ASPos Delay");
  CHECK(d.telegrams.incomplete == 100);
}

TEST_CASE("nothing comes: another port, another address, or silence like that of a firewall") {
  LinkObservations nothing{.duration = 10.0, .port = 49152, .datagrams_elsewhere = 3};
  LinkDiagnosis d = examine_link(nothing, layout());
  CHECK(kinds(d) == std::set<std::string>{"no_telegrams"});
  CHECK((d.verdict == LinkVerdict::Faulty && *finding(d, LinkFindingKind::NoTelegrams).measured_time == 10.0));
  nothing.datagrams_elsewhere = 2400;
  d = examine_link(nothing, layout());
  CHECK(kinds(d) == std::set<std::string>{"wrong_port"});
  CHECK(finding(d, LinkFindingKind::WrongPort).count == 2400);
  nothing = {.duration = 10.0, .port = 6008, .own_address = false};
  d = examine_link(nothing, layout());
  CHECK(kinds(d) == std::set<std::string>{"no_telegrams", "other_port", "other_address"});
  CHECK(finding(d, LinkFindingKind::OtherAddress).severity == FindingSeverity::Fault);
}

TEST_CASE("too few telegrams are no verdict") {
  Random random(17);
  CHECK(examine_link(MadeLink(random, 40).seen(), layout()).verdict == LinkVerdict::Undecided);
  CHECK(examine_link(MadeLink(random, 60).seen(), layout()).verdict == LinkVerdict::Sound);
  CHECK(examine_link({.duration = 0.0, .port = 49152}, layout()).verdict == LinkVerdict::Faulty);
}

TEST_CASE("who only listens is not told of answers, nor is the stop of the controller a fault") {
  Random random(18);
  MadeLink link(random);
  link.answering = false;
  link.tail = 1.0;
  for (std::size_t i = 0; i < link.cycles.size(); ++i) link.cycles[i].delay = static_cast<int>(i);
  const LinkDiagnosis d = examine_link(link.seen(), layout());
  CHECK(kinds(d) == std::set<std::string>{"stopped_sending"});
  CHECK(d.verdict == LinkVerdict::Sound);
}

robot::SensorModel arm() {
  robot::SensorModel out;
  for (const double a : {0.18, 0.6, 0.12, 0.0, 0.0, 0.0})
    out.arm.joints.push_back({.b = 0.1, .a = a, .alpha = a > 0.15 ? 0.0 : M_PI / 2});
  out.T_flange_tool.translation() = Eigen::Vector3d(0.0, 0.05, 0.1);
  return out;
}

TEST_CASE("axis values in radians, or of another arm, are told by the pose") {
  Random random(19);
  for (int trial = 0; trial < test::trials(30, 30); ++trial) {
    MadeLink link(random, 100);
    const int how = random.integer(3);
    robot::SensorModel model = arm();
    for (MadeCycle& c : link.cycles) {
      Eigen::VectorXd q(6);
      for (int i = 0; i < 6; ++i) q[i] = c.axes[static_cast<std::size_t>(i)] * M_PI / 180;
      const Eigen::Vector3d p = (model.arm.flange(q) * model.T_flange_tool).translation();
      for (std::size_t i = 0; i < 3; ++i) c.pose[i] = 1e3 * p[static_cast<Eigen::Index>(i)];
      for (std::size_t i = 0; how == 1 && i < 6; ++i) c.axes[i] = c.axis_path[i] = q[static_cast<Eigen::Index>(i)];
    }
    if (how == 2) model.T_flange_tool.translation().z() += 0.15;
    const LinkDiagnosis d = examine_link(link.seen(), layout(), {.model = model});
    CAPTURE(trial, how);
    CHECK(d.pose_compared);
    const std::vector<std::set<std::string>> expected = {{}, {"radian_axes"}, {"pose_mismatch"}};
    CHECK(kinds(d) == expected[static_cast<std::size_t>(how)]);
    if (how == 2) CHECK(*finding(d, LinkFindingKind::PoseMismatch).distance == Approx(0.15).epsilon(1e-3));
  }
  CHECK_FALSE(examine_link(MadeLink(random, 100).seen(), layout()).pose_compared);
}

using Gains = std::array<std::array<double, 6>, 6>;

Gains unit_gains() {
  Gains out{};
  for (std::size_t i = 0; i < 6; ++i) out[i][i] = 1.0;
  return out;
}

TEST_CASE("corrections of wrong sign, unit, axis and size are told by the motion that they make") {
  Random random(20);
  for (int trial = 0; trial < test::trials(40, 40); ++trial) {
    MadeLink link(random, 1900);
    Gains gains = unit_gains();
    const auto axis = static_cast<std::size_t>(random.integer(6)),
               other = (axis + 1 + static_cast<std::size_t>(random.integer(5))) % 6;
    const std::string name = "A" + std::to_string(axis + 1);
    const int how = trial % 6;
    if (how == 1) gains[axis][axis] = -1.0;
    if (how == 2) gains[axis][axis] = random.integer(2) == 0 ? 180 / M_PI : M_PI / 180;
    if (how == 3) std::swap(gains[axis], gains[other]);
    if (how == 4) gains[axis][axis] = random.uniform(0.3, 0.6);
    if (how == 5) gains = {};
    link.move(gains, random.uniform(0.01, 0.06));
    const LinkDiagnosis d = examine_link(link.seen(), layout());
    CAPTURE(trial, how, axis);
    CHECK(d.motion_compared);
    const std::vector<std::set<std::string>> expected = {{},
                                                         {"correction_sign"},
                                                         {"correction_unit"},
                                                         {"correction_axis"},
                                                         {"correction_scale"},
                                                         {"correction_ignored"}};
    REQUIRE(kinds(d) == expected[static_cast<std::size_t>(how)]);
    if (how == 0) continue;
    const LinkFinding& f = d.findings.front();
    if (how < 3) CHECK(f.names == std::vector<std::string>{name});
    // The last decimal on the wire may be off by half over the 200 cycles of a test, in which 5 degrees are summed.
    if (how < 3) CHECK(*f.gain == Approx(gains[axis][axis]).epsilon(0.02).margin(0.5e-4 * 200 / 5));
    if (how == 3) CHECK(d.findings.size() == 2);
    if (how == 3)
      CHECK(std::set<std::string>(f.names.begin(), f.names.end()) ==
            std::set<std::string>{name, "A" + std::to_string(other + 1)});
    if (how == 5) CHECK(f.count == 6);
  }
}

TEST_CASE("relative corrections are summed before they are compared") {
  Random random(21);
  MadeLink link(random, 1900);
  link.move(unit_gains(), 0.03);
  std::array<double, 6> before{};
  for (MadeCycle& c : link.cycles)
    for (std::size_t i = 0; i < 6; ++i) c.correction[i] -= std::exchange(before[i], c.correction[i]);
  LinkDiagnosis d = examine_link(link.seen(), layout(), {.mode = robot::CommandMode::Relative});
  CHECK((d.motion_compared && d.findings.empty()));
  d = examine_link(link.seen(), layout());
  CHECK_FALSE(d.findings.empty());
}

TEST_CASE("options of a diagnosis are checked by their names") {
  const auto refused = [](auto change, const std::string& field) {
    DiagnosisOptions options;
    change(options);
    CHECK_THROWS_WITH(examine_link({}, layout(), options), Catch::StartsWith(field));
  };
  refused([](auto& o) { o.cycle = 1.0; }, "cycle");
  refused([](auto& o) { o.deadline = 0.0; }, "deadline");
  refused([](auto& o) { o.silence = NAN; }, "silence");
  refused([](auto& o) { o.jitter = 0; }, "jitter");
  refused([](auto& o) { o.clock_jump = -1; }, "clock_jump");
  refused([](auto& o) { o.min_telegrams = 1; }, "min_telegrams");
  refused([](auto& o) { o.position_tolerance = 0; }, "position_tolerance");
  refused([](auto& o) { o.gain_tolerance = 1; }, "gain_tolerance");
}

}  // namespace link_diagnosis_test

#include <algorithm>
#include <cstring>
#include <filesystem>

#include <catch2/catch.hpp>

#include <kr5/cell/check.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "cell/sample_recording.hpp"
#include "support/reference.hpp"

namespace recording_test {

using namespace kr5;
using namespace kr5::cell;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

bool identical(const io::Table& a, const io::Table& b) {
  return a.columns == b.columns && a.values.rows() == b.values.rows() &&
         std::memcmp(a.values.data(), b.values.data(), sizeof(double) * static_cast<std::size_t>(a.values.size())) == 0;
}

void check_identical(const Recording& a, const Recording& b) {
  CHECK(to_yaml(a.cell) == to_yaml(b.cell));
  REQUIRE(a.experiments.size() == b.experiments.size());
  for (std::size_t i = 0; i < a.experiments.size(); ++i) {
    const Experiment &x = a.experiments[i], &y = b.experiments[i];
    CAPTURE(x.name);
    CHECK((x.name == y.name && x.kind == y.kind && x.file == y.file && x.split == y.split));
    CHECK(identical(x.data, y.data));
  }
}

std::string complaint(const fs::path& folder) {
  try {
    load_recording(folder);
  } catch (const IoError& e) {
    return e.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("a recording of every kind is written and reads back bit for bit") {
  const test::Folder folder("exact");
  Recording recording = test::sample_recording();
  Random random(9);
  for (Experiment& e : recording.experiments)
    for (const Column& column : columns(e.kind, 6)) {
      const int at = e.data.find(column.name);
      if (at < 0 || column.noise.empty()) continue;
      for (double& v : e.data.values.col(at)) v += 1e-9 * random.normal();  // digits no format would guess
    }
  save_recording(recording, folder.path);
  const Recording back = load_recording(folder.path);
  check_identical(back, recording);
  CHECK(back.folder == folder.path);
  CHECK(back.experiment("views-1").kind == Kind::Views);
  CHECK_THROWS_WITH(back.experiment("views-9"), Contains("no experiment 'views-9'; there are motion-1, motion-2"));
}

TEST_CASE("all reference cases load, are clean and round trip exactly") {
  const auto cases = test::reference("cases");
  const test::Folder folder("case");
  int count = 0;
  for (const auto& entry : fs::directory_iterator(cases)) {
    if (!entry.is_directory()) continue;
    CAPTURE(entry.path());
    const Recording recording = load_recording(entry.path());
    CHECK(recording.experiments.size() == 17);
    for (const io::Diagnostic& p : check(recording)) FAIL_CHECK(p.text());
    save_recording(recording, folder.path);
    check_identical(load_recording(folder.path), recording);
    ++count;
  }
  CHECK(count == 14);
}

TEST_CASE("columns say unit, role and noise, for any number of joints") {
  const auto motion = columns(Kind::Motion, 3);
  REQUIRE(motion.size() == 1 + 3 * 4 + 6 + 1);
  CHECK((motion.back().name == servo_gain_column && motion.back().role == Role::Given));
  CHECK(motion[4].name == "q1");
  CHECK(motion[4].role == Role::Predicted);
  CHECK(motion[4].noise == "position");
  for (const auto& [kind, name] : enum_names(Kind{}))
    for (const Column& c : columns(kind, 6)) {
      CAPTURE(name, c.name);
      CHECK_FALSE(c.unit.empty());
      CHECK((c.noise.empty() || c.role == Role::Predicted));
      bool known = c.noise.empty();
      const Noise none;
      Noise::each_field(none, [&](const char* key, const auto&, const char*) { known |= c.noise == key; });
      CHECK(known);
    }
  CHECK(columns(Kind::Profile, 6)[7].noise == "depth");
  CHECK(columns(Kind::Scan, 6)[10].noise == "laser");
  CHECK(columns(Kind::Press, 6)[3].noise == "position");
}

TEST_CASE("joint torques instead of currents, and a cell without a force sensor, are recordings too") {
  const test::Folder folder("torques");
  Recording recording = test::sample_recording();
  io::Table& data = recording.experiments[0].data;
  for (std::string& name : data.columns)
    if (name[0] == 'i') name = "tau" + name.substr(1);
  data.columns.resize(data.columns.size() - 6);
  data.values.conservativeResize(Eigen::NoChange, data.values.cols() - 6);
  save_recording(recording, folder.path);
  check_identical(load_recording(folder.path), recording);
}

TEST_CASE("missing, unknown and half groups of columns are named") {
  const test::Folder folder("columns");
  const Recording good = test::sample_recording();
  const auto told = [&](std::size_t experiment, const std::string& column, const std::string& name) {
    Recording bad = good;
    auto& columns = bad.experiments[experiment].data.columns;
    *std::find(columns.begin(), columns.end(), column) = name;
    save_recording(bad, folder.path);
    return complaint(folder.path);
  };
  CHECK_THAT(told(0, "qc3", "qx3"),
             Contains("motion-1.csv:1: qc3: found no such column, expected qc3 [rad or m], required") &&
                 Contains("motion-1.csv:1: qx3: found an unknown column"));
  CHECK_THAT(told(0, "i4", "i9"),
             Contains("i9: found an unknown column, expected columns of 6 joints, as the cell has"));
  CHECK_THAT(told(2, "qw", "q0"), Contains("qw: found only qx qy qz of the orientation"));
  CHECK_THAT(told(3, "marker", "markr"),
             Contains("markr: found an unknown column, expected no such column; did you mean 'marker'?"));
}

TEST_CASE("a drive without its current, a sensor without an axis and a scan without its flag are recordings too") {
  const test::Folder folder("lacking");
  Recording recording = test::sample_recording();
  const auto drop = [](io::Table& data, const std::string& name) {
    const int at = data.find(name);
    REQUIRE(at >= 0);
    std::vector<int> kept;
    for (int c = 0; c < static_cast<int>(data.columns.size()); ++c)
      if (c != at) kept.push_back(c);
    data.columns.erase(data.columns.begin() + at);
    data.values = Eigen::MatrixXd(data.values(Eigen::all, kept));
  };
  for (Experiment& e : recording.experiments) {
    if (e.kind == Kind::Motion)
      for (const char* name : {"i3", "tx", "ty", "tz"}) drop(e.data, name);
    if (e.kind == Kind::Scan) drop(e.data, "sphere");
    if (e.kind == Kind::Views) drop(e.data, "v");
  }
  save_recording(recording, folder.path);
  check_identical(load_recording(folder.path), recording);
}

TEST_CASE("a recording of another number of joints is refused") {
  const test::Folder folder("joints");
  save_recording(test::sample_recording(), folder.path);
  fs::copy_file(KR5_SHARE_DIR "/cells/gantry_rrp.yaml", folder.path / "cell.yaml",
                fs::copy_options::overwrite_existing);
  CHECK_THAT(complaint(folder.path),
             Contains("motion-1.csv:1: q6: found an unknown column, expected columns of 4 joints, as the cell has"));
}

TEST_CASE("what is wrong with recording.yaml is named with line and field") {
  const test::Folder folder("index");
  save_recording(test::sample_recording(), folder.path);
  const std::string text = io::read_text(folder.path / "recording.yaml");
  const auto told = [&](const std::string& what, const std::string& by) {
    std::string changed = text;
    const auto at = changed.find(what);
    REQUIRE(at != std::string::npos);
    io::write_text(folder.path / "recording.yaml", changed.replace(at, what.size(), by));
    return complaint(folder.path);
  };
  CHECK_THAT(told("kr5-recording/1", "kr5-recording/9"),
             Contains("recording.yaml:1: format: found kr5-recording/9, expected kr5-recording/1"));
  CHECK_THAT(told("kind: motion", "kind: moton"),
             Contains("experiments[0].kind: found 'moton', expected one of motion | poses"));
  CHECK_THAT(told("split: fit", "splt: fit"),
             Contains("experiments[0].splt: found an unknown key, expected no such key; did you mean 'split'?"));
  CHECK_THAT(told("name: motion-2", "name: motion-1"), Contains("experiments[1].name: found 'motion-1' a second time"));
  CHECK_THAT(told("file: motion-2.csv", "file: motion-1.csv"), Contains("rows used to fit must not be used to check"));
  CHECK_THAT(told("file: motion-2.csv", "file: ../motion-2.csv"), Contains("a file in the folder of the recording"));
  CHECK_THAT(told("file: motion-2.csv", "file: motion-3.csv"), Contains("motion-3.csv: found no such file"));
  CHECK_THAT(told("cell: cell.yaml", "cell: cel.yaml"), Contains("cel.yaml: found no such file"));
  CHECK_THAT(complaint(folder.path / "nowhere"), Contains("recording.yaml: found no such file"));
  CHECK_THAT(complaint(folder.path / "motion-1.csv"),
             Contains("motion-1.csv: is a file, expected the folder of a recording; kr5 gap diagnose takes logs"));
}

TEST_CASE("every bad row of every file is told at once") {
  const test::Folder folder("rows");
  save_recording(test::sample_recording(), folder.path);
  const auto spoil = [&](const std::string& file, const std::string& line) {
    io::write_text(folder.path / file, io::read_text(folder.path / file) + line);
  };
  spoil("step-1.csv", "0,1,0\n");
  spoil("press-1.csv", "0,1,0,nan,0,0,0,0,0,0\n");
  CHECK_THAT(complaint(folder.path),
             Contains("step-1.csv:22: found 3 values, expected 4 as in the header; is the file cut off?") &&
                 Contains("press-1.csv:22: z: found 'nan', expected a finite number"));
}

TEST_CASE("a recording is not written outside its folder, nor two experiments into one file") {
  const test::Folder folder("outside");
  Recording bad = test::sample_recording();
  bad.experiments[0].file = "../motion-1.csv";
  CHECK_THROWS_AS(save_recording(bad, folder.path), InvalidArgument);
  bad.experiments[0].file = bad.experiments[1].file;
  CHECK_THROWS_AS(save_recording(bad, folder.path), InvalidArgument);
}

TEST_CASE("a lead-in and measured positions are written and read back, and simulate the same") {
  const test::Folder folder("lead_in");
  Recording recording = test::sample_recording();
  Experiment& motion = *std::find_if(recording.experiments.begin(), recording.experiments.end(),
                                     [](const Experiment& e) { return e.kind == Kind::Motion; });
  const io::Table whole = motion.data;
  const double duration = 0.4 * (whole.column("t").tail<1>()[0] - whole.column("t")[0]);
  motion = split_lead_in(motion, duration);
  motion.joint_reference = JointReference::Measured;
  motion.speed_noise = Eigen::VectorXd::LinSpaced(6, 0.001, 0.006);
  REQUIRE(motion.lead_in.values.rows() > 0);
  REQUIRE(motion.data.values.rows() + motion.lead_in.values.rows() == whole.values.rows());
  save_recording(recording, folder.path);
  const Recording back = load_recording(folder.path);
  const Experiment& read = back.experiment(motion.name);
  CHECK(identical(read.data, motion.data));
  CHECK(identical(read.lead_in, motion.lead_in));
  CHECK(read.joint_reference == JointReference::Measured);
  CHECK(read.speed_noise == motion.speed_noise);
  CHECK(identical(with_lead_in(read).data, whole));
}

TEST_CASE("a lead-in that leaves no row is refused with the length of the file") {
  const test::Folder folder("lead_in_too_long");
  save_recording(test::sample_recording(), folder.path);
  const std::string index = io::read_text(folder.path / "recording.yaml");
  const std::size_t at = index.find("kind: motion");
  REQUIRE(at != std::string::npos);
  io::write_text(folder.path / "recording.yaml", index.substr(0, at) + "lead_in: 1000.0\n    " + index.substr(at));
  CHECK_THAT(complaint(folder.path), Contains("lead_in") && Contains("1000") && Contains("a time within the"));
  CHECK_THROWS_WITH(split_lead_in(test::sample_recording().experiments.front(), 1000.0),
                    Contains("no row is left after its lead-in"));
}

TEST_CASE("a motion that begins before the arm rests is warned of, unless it has a lead-in or is measured") {
  const test::Folder folder("begins_in_motion");
  Recording recording = test::sample_recording();
  std::erase_if(recording.experiments, [](const Experiment& e) { return e.kind != Kind::Motion; });
  Experiment& motion = recording.experiments.front();
  const Eigen::Index rows = motion.data.values.rows();
  for (const std::string stem : {"q2", "qc2"})
    if (const int at = motion.data.find(stem); at >= 0)
      motion.data.values.col(at) = Eigen::VectorXd::LinSpaced(rows, 0.1, 0.1 + 0.012 * 0.2 * static_cast<double>(rows));
  const auto warned = [&] {
    for (const io::Diagnostic& d : check(recording))
      if (d.found.find("when the motion begins") != std::string::npos) return true;
    return false;
  };
  CHECK(warned());
  const Experiment late = split_lead_in(motion, 0.1);
  motion.joint_reference = JointReference::Measured;
  CHECK_FALSE(warned());
  motion = late;
  CHECK_FALSE(warned());
}

TEST_CASE("readings of an arm at rest are not taken for motion, however noisy the cell says they are") {
  Recording recording = test::sample_recording();
  std::erase_if(recording.experiments, [](const Experiment& e) { return e.kind != Kind::Motion; });
  recording.experiments.resize(1);
  Experiment& motion = recording.experiments.front();
  recording.cell.noise.position = 2e-4;
  int warned = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const Eigen::Index rows = motion.data.values.rows();
    motion.data.values.col(motion.data.find("t")) =
        Eigen::VectorXd::LinSpaced(rows, 0.0, 0.001 * static_cast<double>(rows - 1));
    for (int j = 1; j <= recording.cell.robot.joints(); ++j) {
      const int q = motion.data.find("q" + std::to_string(j));
      REQUIRE(q >= 0);
      for (Eigen::Index i = 0; i < rows; ++i)
        motion.data.values(i, q) = motion.data.values(0, motion.data.find("qc" + std::to_string(j))) +
                                   recording.cell.noise.position * random.normal();
    }
    for (const io::Diagnostic& d : check(recording))
      warned += d.found.find("when the motion begins") != std::string::npos;
  }
  CHECK(warned <= 1);  // 4 standard deviations beside 0.02 rad/s, of 300 joints
}

TEST_CASE("a lead-in is checked like the rows behind it, by its lines") {
  const test::Folder folder("damaged_lead_in");
  Recording recording = test::sample_recording();
  std::erase_if(recording.experiments, [](const Experiment& e) { return e.kind != Kind::Motion; });
  recording.experiments.resize(1);
  Experiment& motion = recording.experiments.front();
  motion = split_lead_in(motion, 0.2);
  motion.lead_in.values(3, motion.lead_in.find("t")) = motion.lead_in.values(1, motion.lead_in.find("t"));
  save_recording(recording, folder.path);
  bool told = false;
  for (const io::Diagnostic& d : check(folder.path / "recording.yaml"))
    told = told || (d.field == "t" && d.line == 5 && d.expected.find("time that increases") == 0);
  CHECK(told);
  motion.data.values(2, motion.data.find("qc1")) = 1e13;
  for (const io::Diagnostic& d : check(recording))
    if (d.field == "qc1" && d.expected.find("a magnitude") == 0)
      CHECK(d.line == 2 + static_cast<int>(motion.lead_in.values.rows()) + 2);
}

TEST_CASE("noise of single joints takes the place of that of all, and is checked") {
  Cell cell = test::sample_recording().cell;
  CHECK(cell.noise.of("current", 3) == cell.noise.current);
  CHECK(cell.noise.field_of("current", 3) == "current");
  cell.noise.joint_current = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  CHECK(cell.noise.of("current", 3) == 0.4);
  CHECK(cell.noise.of("current") == cell.noise.current);
  CHECK(cell.noise.field_of("current", 3) == "joint_current");
  CHECK(parse_cell(to_yaml(cell), "text").noise.joint_current == cell.noise.joint_current);
  cell.noise.joint_current.pop_back();
  CHECK_THROWS_WITH(cell.validate(), Contains("noise.joint_current") && Contains("6 values, one a joint"));
  cell.noise.joint_current = {0.1, 0.2, 0.3, 0.4, 0.5, -0.6};
  CHECK_THROWS_WITH(cell.validate(), Contains("noise.joint_current") && Contains("positive"));
}

}  // namespace recording_test

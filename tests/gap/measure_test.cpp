#include <kr5/gap/measure.hpp>

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace measure_test {

using namespace kr5;

namespace {

/// Shows a constant in every column there may be, and a pose that is turned by nothing.
class Constant : public cell::Simulator {
 public:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
    io::Table out;
    for (const cell::Column& c : cell::columns(experiment.kind, cell.robot.joints()))
      if (c.role == cell::Role::Predicted && c.name != "v") out.columns.push_back(c.name);
    out.values =
        Eigen::MatrixXd::Constant(experiment.data.values.rows(), static_cast<Eigen::Index>(out.columns.size()), 0.0);
    if (out.find("qw") >= 0) out.values.col(out.find("qw")).setOnes();
    if (out.find("sphere") >= 0) out.values.col(out.find("sphere")).head(2).setOnes();
    return out;
  }
};

cell::Experiment make(cell::Kind kind, const std::vector<std::string>& columns, const Eigen::MatrixXd& values) {
  cell::Experiment e;
  e.name = std::string(name_of(kind)) + "-1";
  e.kind = kind;
  e.data = {columns, values};
  return e;
}

cell::Recording recording(const cell::Experiment& e) {
  cell::Recording r;
  r.cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  r.experiments = {e};
  return r;
}

const gap::ColumnGap& column(const gap::Measure& m, const std::string& name) {
  for (const auto& c : m.columns)
    if (c.column == name) return c;
  FAIL("no column " << name);
  return m.columns.front();
}

}  // namespace

TEST_CASE("rows in which a joint rests are not measured") {
  Eigen::MatrixXd values(40, 8);
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(40, 0.0, 0.39);
  values << t, t.cwiseMax(0.2), Eigen::MatrixXd::Zero(40, 5), Eigen::VectorXd::Constant(40, 0.06);
  values.col(7).head(20).setConstant(100.0);  // of friction that holds the joint
  auto r = recording(make(cell::Kind::Motion, {"t", "qc1", "qc2", "qc3", "qc4", "qc5", "qc6", "i1"}, values));
  r.experiments[0].joint_reference = cell::JointReference::Measured;
  CHECK(column(gap::measure(r, Constant()), "i1").rows == 40);
  r.experiments[0].speed_noise = Eigen::VectorXd::Constant(6, 0.1);
  const gap::Measure m = gap::measure(r, Constant());
  CHECK(column(m, "i1").rows == 20);
  CHECK(column(m, "i1").gap == Approx(0.06 / r.cell.noise.current));
}

TEST_CASE("the gap is the RMS of the residual over the noise") {
  Eigen::MatrixXd values(4, 1);
  values << 1e-4, -1e-4, 3e-4, 1e-4;
  const auto r = recording(make(cell::Kind::Step, {"z"}, values));
  const gap::Measure m = gap::measure(r, Constant());
  REQUIRE(m.columns.size() == 1);
  CHECK(m.columns[0].rms == Approx(std::sqrt(3e-8)));
  CHECK(m.columns[0].gap == Approx(std::sqrt(3e-8) / r.cell.noise.position));
  CHECK(m.columns[0].noise == r.cell.noise.position);
  CHECK(m.columns[0].unit == "m");
  CHECK(m.columns[0].exceeds);
  CHECK(m.gap == Approx(m.columns[0].gap));
}

TEST_CASE("orientation is compared by its rotation vector, whatever the sign of the quaternion") {
  Eigen::MatrixXd values(2, 4);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()));
  values.row(0) << q.w(), q.x(), q.y(), q.z();
  values.row(1) = -values.row(0);
  const auto r = recording(make(cell::Kind::Poses, {"qw", "qx", "qy", "qz"}, values));
  const gap::Measure m = gap::measure(r, Constant());
  REQUIRE(m.columns.size() == 3);
  CHECK(column(m, "ry").rms == Approx(0.01));
  CHECK(column(m, "rx").rms < 1e-12);
  CHECK(column(m, "rz").unit == "rad");
}

TEST_CASE("rows whose ray met the sphere in one of the two only are left out") {
  Eigen::MatrixXd values(3, 2);
  values << 1e-3, 1, 9.0, 0, 1e-3, 0;  // the simulator meets the sphere in the first two
  const gap::Measure m = gap::measure(recording(make(cell::Kind::Scan, {"z", "sphere"}, values)), Constant());
  REQUIRE(m.columns.size() == 1);
  CHECK(m.columns[0].rows == 2);
  CHECK(m.columns[0].left_out == 1);
  CHECK(m.columns[0].rms == Approx(1e-3));
}

TEST_CASE("columns that were not recorded, are not predicted, or have no noise are left out") {
  auto r = recording(make(cell::Kind::Views, {"u", "v"}, Eigen::MatrixXd::Zero(5, 2)));
  CHECK(gap::measure(r, Constant()).columns.size() == 1);
  r.cell.noise.pixel = 0.0;
  CHECK_THROWS_WITH(gap::measure(r, Constant()),
                    Catch::Contains("views.u, v were not compared: the cell does not state noise.pixel"));
  r = recording(make(cell::Kind::Press, {"z"}, Eigen::MatrixXd::Zero(5, 1)));
  CHECK(gap::measure(r, Constant()).columns.size() == 1);
}

TEST_CASE("the limit of noise is that of chi-square, and without rows there is none") {
  CHECK(gap::noise_limit(99) == Approx(std::sqrt(148.230 / 99)).epsilon(1e-4));  // from tables
  CHECK(gap::noise_limit(1) == Approx(std::sqrt(10.828)).epsilon(1e-4));
  CHECK(gap::noise_limit(1, 10) == Approx(std::sqrt(15.137)).epsilon(1e-4));  // any of ten columns
  CHECK_THROWS_AS(gap::noise_limit(1, 0), InvalidArgument);
  CHECK(gap::noise_limit(1e6) == Approx(1.0).margin(0.003));
  CHECK(std::isinf(gap::noise_limit(0)));
  CHECK(std::isinf(gap::noise_limit(std::nan(""))));
}

TEST_CASE("noise alone exceeds the limit in one column of a thousand, for any number of rows") {
  constexpr int trials = 4000;
  int of_all = 0;
  for (const int rows : {3, 40, 400}) {
    Random random(static_cast<std::uint64_t>(rows));
    int exceeding = 0;
    for (int trial = 0; trial < trials / 6; ++trial) {
      auto r = recording(make(cell::Kind::Press, {"fx", "fy", "fz", "tx", "ty", "tz"}, Eigen::MatrixXd(rows, 6)));
      for (int c = 0; c < 6; ++c)
        r.experiments[0].data.values.col(c) =
            random.normal_vector(rows, c < 3 ? r.cell.noise.force : r.cell.noise.torque);
      exceeding += gap::measure(r, Constant()).exceeding;
    }
    CHECK(exceeding <= 13);  // binomial, 4000 trials of 0.001: beyond with probability 2e-4
    of_all += exceeding;
  }
  CHECK(of_all >= 3);  // 12000 trials of 0.001: below with probability 5e-4
}

TEST_CASE("an experiment that the simulator refuses is left out with a word, and alone is an error") {
  class NoScan : public Constant {
   public:
    io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
      require(experiment.kind != cell::Kind::Scan, "there is no laser");
      return Constant::simulate(cell, experiment);
    }
  };
  auto r = recording(make(cell::Kind::Scan, {"z"}, Eigen::MatrixXd::Zero(5, 1)));
  CHECK_THROWS_WITH(gap::measure(r, NoScan()), "scan-1 was not compared: there is no laser");
  r.experiments.push_back(make(cell::Kind::Step, {"z"}, Eigen::MatrixXd::Zero(5, 1)));
  const gap::Measure m = gap::measure(r, NoScan());
  REQUIRE(m.columns.size() == 1);
  CHECK(m.columns[0].experiment == "step-1");
  CHECK(m.refused == std::vector<std::string>{"scan-1 was not compared: there is no laser"});
}

TEST_CASE("the gap is told by subsystem, target, channel and experiment") {
  Eigen::MatrixXd far = Eigen::MatrixXd::Zero(400, 4), near = Eigen::MatrixXd::Zero(400, 1);
  auto r = recording(make(cell::Kind::Motion, {"q3", "i3", "i4", "fz"}, far));
  r.experiments.push_back(make(cell::Kind::Step, {"z"}, near));
  const double current = gap::measure(r, Constant()).columns.at(1).noise;
  r.experiments[0].data.values.col(1).setConstant(3 * current);
  r.experiments[0].data.values.col(3).setConstant(2 * r.cell.noise.force);
  const gap::Measure m = gap::measure(r, Constant());
  const auto part = [&](const std::string& by, const std::string& name) {
    for (const gap::GapPart& p : m.parts)
      if (p.by == by && p.name == name) return p;
    FAIL("no " << by << ' ' << name);
    return gap::GapPart{};
  };
  CHECK(part("subsystem", "drives").share == Approx(8.0 / 11));
  CHECK(part("subsystem", "drives").gap == Approx(std::sqrt(4.5)));
  CHECK(part("subsystem", "wrist sensor").share == Approx(3.0 / 11));
  CHECK(part("target", "joint3").columns == 2);
  CHECK(part("target", "joint3").exceeding == 1);
  CHECK(part("channel", "motor current").gap == Approx(std::sqrt(4.5)));
  CHECK(part("experiment", "motion-1").share == Approx(1));
  CHECK(part("experiment", "step-1").gap == 0);
  CHECK(m.parts.front().name == "drives");
}

TEST_CASE("the gap is told by where the arm was and how fast it moved") {
  constexpr int rows = 1200, third = rows / 3;
  const std::vector<std::string> columns = {"t", "qc1", "qc2", "qc3", "qc4", "qc5", "qc6", "i3"};
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(rows, 8);
  double q3 = 0.0;
  for (int i = 0; i < rows; ++i) {  // stands, goes slowly, goes fast: from the elbow stretched to bent
    values.row(i) << 0.01 * i, 0.0, -1.0, q3, 0.0, 0.3, 0.0, 0.0;
    q3 += i < third ? 0.0 : i < 2 * third ? 0.001 : 0.004;
  }
  auto r = recording(make(cell::Kind::Motion, columns, values));
  const double noise = gap::measure(r, Constant()).columns.at(0).noise;
  Random random(12);
  r.experiments[0].data.values.col(7) = random.normal_vector(rows, noise);
  r.experiments[0].data.values.col(7).tail(third - 1).array() += 3 * noise;
  const gap::Measure m = gap::measure(r, Constant());
  std::vector<std::string> speeds;
  double share = 0.0;
  int regions = 0;  // of 0.1 and 0.4 rad/s, 0.25 is the middle
  for (const gap::GapPart& p : m.parts) {
    if (p.by == "speed") speeds.push_back(p.name);
    if (p.by == "speed" && p.name.starts_with("fast")) CHECK(p.share > 0.95);
    if (p.by != "pose region") continue;
    share += p.share;
    ++regions;
    CHECK(p.name.find("height") != std::string::npos);
  }
  std::sort(speeds.begin(), speeds.end());
  CHECK(speeds == std::vector<std::string>{"at rest", "fast, above 0.25 rad/s", "slow, to 0.25 rad/s"});
  CHECK(share == Approx(1));
  CHECK(regions >= 2);

  r.experiments[0].data.values.middleCols(1, 6).setZero();  // stands still all the time
  const gap::Measure still = gap::measure(r, Constant());
  CHECK(std::none_of(still.parts.begin(), still.parts.end(), [](const auto& p) { return p.by == "pose region"; }));
}

TEST_CASE("a cell with another number of joints is refused") {
  const auto r = recording(make(cell::Kind::Step, {"z"}, Eigen::MatrixXd::Zero(5, 1)));
  cell::Cell other = r.cell;
  other.robot.dh.pop_back();
  CHECK_THROWS_AS(gap::measure(r, other, Constant()), InvalidArgument);
}

}  // namespace measure_test

#include <kr5/sim/work_cell.hpp>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/force/insertion.hpp>
#include <kr5/sim/insertion_options.hpp>
#include <support/work_cell_driver.hpp>

namespace work_cell_test {

using namespace kr5;
using namespace kr5::sim;
using Catch::Contains;
using Eigen::Vector3d;
using test::down_at;
using test::WorkCellDriver;

namespace {

constexpr double mm = 1e-3, gravity = 9.81;

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

/// A cell where everything is as it is assumed, with one pellet.
WorkCellOptions exact() {
  WorkCellOptions out;
  out.pour = {.pellets = 1, .height_min = 0.015, .height_max = 0.015};
  out.noise = false;
  out.errors.repeatability = 0;
  return out;
}

PelletTruth first(const WorkCell& cell) { return cell.truth().pellets.front(); }

/// Highest point of a pellet, seen from above its middle.
Vector3d top_of(const PelletTruth& p) {
  const double cosine = std::abs(p.T_base_pellet.linear()(2, 2));
  return p.T_base_pellet.translation() + Vector3d(0, 0, cosine > 0.9 ? 0.5 * p.height : p.radius);
}

double weight_of(const WorkCell& cell, const PelletTruth& p) {
  return cell.options().pile.density * std::numbers::pi * p.radius * p.radius * p.height * gravity;
}

/// Takes the pellet of the bin with the cup, and lifts it.
void pick(WorkCell& cell, WorkCellDriver& driver) {
  const Vector3d top = top_of(first(cell));
  driver.start(down_at(top + Vector3d(0, 0, 0.08)));
  driver.go(down_at(top + Vector3d(0, 0, 0.5 * mm)), 1.0);
  driver.grip(true);
  driver.wait(0.3);
  driver.go(down_at(top + Vector3d(0, 0, 0.16)), 1.5);
}

/// How the tool must stand so that the pellet that it holds is there.
Pose tool_for(const WorkCell& cell, const Pose& T_base_pellet) {
  return T_base_pellet * cell.truth().T_tool_pellet.inverse();
}

/// How the tool must stand so that the pellet is there, turned as it is now.
Pose lowered(const WorkCell& cell, const Vector3d& centre) {
  Pose out = first(cell).T_base_pellet;
  out.translation() = centre;
  return tool_for(cell, out);
}

/// That pose of the pellet, turned about its axis so that the tool that holds it points down as far as it can.
Pose from_above(const WorkCell& cell, const Pose& T_base_pellet) {
  const Eigen::Matrix3d R_pellet_tool = cell.truth().T_tool_pellet.linear().transpose();
  Pose best = T_base_pellet;
  for (int k = 0; k < 72; ++k) {
    Pose turned = T_base_pellet;
    turned.rotate(Eigen::AngleAxisd(k * M_PI / 36, Vector3d::UnitZ()));
    if ((turned.linear() * R_pellet_tool)(2, 2) < (best.linear() * R_pellet_tool)(2, 2)) best = turned;
  }
  return best;
}

double lower_end(const PelletTruth& p) {
  const double cosine = std::min(std::abs(p.T_base_pellet.linear()(2, 2)), 1.0);
  return p.T_base_pellet.translation().z() - 0.5 * p.height * cosine - p.radius * std::sqrt(1 - cosine * cosine);
}

/// Angle of a pellet's axis from upright beyond which it falls over.
double critical_lean(const PelletTruth& p) { return std::atan2(p.radius, 0.5 * p.height); }

/// Lets the pellet go on the stand with its axis leaning, and waits until it lies still.
void put_down_leaning(WorkCell& cell, WorkCellDriver& driver, double lean) {
  const Vector3d stand = cell.options().stand.T_base_stand.translation();
  Pose there(Eigen::AngleAxisd(lean, Vector3d::UnitY()));
  there.translation() = stand + Vector3d(0, 0, 0.1);
  there = from_above(cell, there);
  driver.go(tool_for(cell, there), 3.0);
  const double gap = lower_end(first(cell)) - stand.z();
  there.translation().z() -= gap - 0.1 * mm;
  driver.go(tool_for(cell, there), 2.0, 3.0);
  driver.grip(false);
  driver.wait(3.0);
}

/// From the bin over the stand, until a gripper holds it upright at a height above its lower end.
void stand_up(WorkCell& cell, WorkCellDriver& driver, bool fingers, double height) {
  pick(cell, driver);
  put_down_leaning(cell, driver, critical_lean(first(cell)) - 0.15);
  Pose back = driver.last().tool;
  back.translation() -= 0.08 * back.linear().col(2);
  driver.go(back, 1.5);
  const PelletTruth standing = first(cell);
  const Vector3d at = standing.T_base_pellet.translation() + Vector3d(0, 0, height - 0.5 * standing.height);
  driver.go(down_at(at + Vector3d(0, 0, 0.05)), 2.0);
  driver.go(down_at(at), 1.5);
  driver.grip(true, fingers);
  driver.wait(0.5);
  driver.go(down_at(at + Vector3d(0, 0, 0.08)), 1.5);
}

/// The same by the cup on its upper face.
void stand_up(WorkCell& cell, WorkCellDriver& driver) { stand_up(cell, driver, false, first(cell).height + 0.3 * mm); }

/// Lowers the lower end of an upright pellet to a height over the face of the tube, beside its axis.
void lower_into_tube(WorkCell& cell, WorkCellDriver& driver, const Vector3d& end) {
  const Vector3d tube = cell.truth().T_base_tubes.front().translation();
  const double half = 0.5 * first(cell).height;
  driver.go(lowered(cell, tube + Vector3d(end.x(), end.y(), 0.03 + half)), 2.5);
  driver.go(lowered(cell, tube + end + Vector3d(0, 0, half)), 2.0, 3.0);
}

bool same(const robot::RobotReading& a, const robot::RobotReading& b) {
  return a.time == b.time && a.joints == b.joints && a.currents == b.currents && a.sensor == b.sensor &&
         a.wrench == b.wrench && a.T_base_tool.matrix() == b.T_base_tool.matrix() &&
         a.status.gripped == b.status.gripped;
}

bool same(const WorkCellTruth& a, const WorkCellTruth& b) {
  bool out = a.gripped == b.gripped && a.pellets.size() == b.pellets.size() && a.contact == b.contact;
  for (std::size_t i = 0; out && i < a.pellets.size(); ++i)
    out = a.pellets[i].place == b.pellets[i].place &&
          a.pellets[i].T_base_pellet.matrix() == b.pellets[i].T_base_pellet.matrix();
  return out;
}

}  // namespace

TEST_CASE("the cup takes the pellet that it meets, once it has closed, and the sensor feels its weight") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  const Vector3d top = top_of(first(cell));
  driver.start(down_at(top + Vector3d(0, 0, 0.08)));
  driver.wait(0.5);
  const double before = driver.reading.wrench.z();
  driver.go(down_at(top + Vector3d(0, 0, 0.5 * mm)), 1.0);
  CHECK(cell.truth().gripped == -1);
  driver.grip(true);
  driver.wait(0.5 * cell.options().cup.closing);
  CHECK_FALSE(driver.reading.status.gripped);
  driver.wait(cell.options().cup.closing);
  CHECK(driver.reading.status.gripped);
  CHECK(first(cell).place == PelletPlace::Grip);
  driver.go(down_at(top + Vector3d(0, 0, 0.1)), 1.5);
  driver.wait(1.0);
  CHECK(cell.truth().gripped == 0);
  CHECK(cell.truth().slip < 0.1 * mm);
  CHECK(top_of(first(cell)).z() > top.z() + 0.095);
  const double resolution = 0.0625;  // of the sensor [N]
  CHECK(driver.reading.wrench.z() - before == Approx(-weight_of(cell, first(cell))).margin(resolution));
  CHECK(cell.truth().contact.z() == Approx(-weight_of(cell, first(cell))).epsilon(1e-3));
}

TEST_CASE("a cup in the air, or one that leans too far, takes nothing") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  const Vector3d top = top_of(first(cell));
  driver.start(down_at(top + Vector3d(0, 0, 2 * mm)));
  driver.grip(true);
  driver.wait(0.5);
  CHECK_FALSE(driver.reading.status.gripped);
  driver.grip(false);
  Pose leaning = down_at(top + Vector3d(0, 0, 0.2 * mm));
  leaning.linear() = Eigen::AngleAxisd(0.6, Vector3d::UnitY()) * leaning.linear();
  driver.go(leaning, 1.0);
  driver.grip(true);
  driver.wait(0.5);
  CHECK_FALSE(driver.reading.status.gripped);
  CHECK(first(cell).place == PelletPlace::Bin);
}

TEST_CASE("a pellet let go over the stand falls as gravity has it, and comes to rest on the plate") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  pick(cell, driver);
  const Vector3d stand = cell.options().stand.T_base_stand.translation();
  const double drop = 0.02;
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.1)), 3.0);
  const double below = 0.1 - (first(cell).T_base_pellet.translation().z() - lower_end(first(cell)));
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.1 - below + drop)), 2.0, 3.0);
  const double height = lower_end(first(cell)) - stand.z();
  REQUIRE(height == Approx(drop).margin(0.2 * mm));
  driver.grip(false);
  const double fall = std::sqrt(2 * height / gravity), begin = cell.truth().time;
  double last = lower_end(first(cell)), landed = 0.0, energy = 0.0;
  for (int k = 0; k < 100; ++k) {
    driver.step();
    const double now = lower_end(first(cell)), speed = (now - last) / cell.cycle();
    energy = gravity * (0.5 * (now + last) - stand.z()) + 0.5 * speed * speed;  // in the middle of the cycle
    last = now;
    const double time = cell.truth().time - begin;
    if (time < fall) CHECK(energy == Approx(gravity * height).epsilon(0.02));
    if (landed == 0.0 && now - stand.z() < 1 * mm) landed = time;
  }
  CHECK(landed == Approx(fall).margin(1.5 * cell.cycle()));
  CHECK(std::abs(energy) < 1e-3 * gravity * height);
  driver.wait(1.0);
  CHECK(first(cell).place == PelletPlace::Stand);
  CHECK(lower_end(first(cell)) == Approx(stand.z()).margin(0.01 * mm));
  CHECK_FALSE(driver.reading.status.gripped);
}

TEST_CASE("a pellet that is put down leaning stands up or falls over, as its centre lies over its edge") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  pick(cell, driver);
  const PelletTruth held = first(cell);
  const double critical = critical_lean(held);
  const double lean = GENERATE_COPY(critical - 0.15, critical + 0.15);
  put_down_leaning(cell, driver, lean);
  INFO("lean " << lean << " of " << critical);
  CHECK(first(cell).place == PelletPlace::Stand);
  const double upright = std::abs(first(cell).T_base_pellet.linear()(2, 2));
  if (lean < critical)
    CHECK(upright > 0.999);
  else
    CHECK(upright < 0.02);
}

TEST_CASE("a pellet pressed on the stand pushes back as the stiffness of grip and contact in series") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  pick(cell, driver);
  const Vector3d stand = cell.options().stand.T_base_stand.translation();
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.05)), 3.0);
  const double gap = lower_end(first(cell)) - stand.z();
  const double depth = 0.4 * mm;
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.05 - gap - depth)), 2.0, 4.0);
  const double local = 2e6;  // of the pellet's edge on the plate [N/m]
  const double stiffness = 1 / (1 / cell.believed().contact->stiffness + 1 / local);
  INFO("contact " << cell.truth().contact.transpose());
  CHECK(cell.truth().contact.z() == Approx(stiffness * depth).epsilon(0.01));
  CHECK(driver.reading.wrench.z() == Approx(cell.truth().contact.z()).margin(0.1));
}

TEST_CASE("what is drawn aside beyond the force of the cup slips, at that force, and is lost after its way") {
  WorkCellOptions options = exact();
  options.cup.force = 1.0;
  options.cup.slip = 1.0 * mm;
  WorkCell cell(arc(), options);
  WorkCellDriver driver(cell);
  pick(cell, driver);
  const Vector3d stand = options.stand.T_base_stand.translation();
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.05)), 3.0);
  const double gap = lower_end(first(cell)) - stand.z();
  const double friction = cell.believed().contact->friction, stiffness = cell.believed().contact->stiffness;
  const double pressed = 20.0;  // which friction holds with more than the cup can
  REQUIRE(friction * pressed > 2 * options.cup.force);
  const double height = 0.05 - gap - pressed / stiffness;
  driver.go(lowered(cell, stand + Vector3d(0, 0, height)), 2.0, 4.0);
  REQUIRE(cell.truth().gripped == 0);
  CHECK(cell.truth().slip < 0.1 * mm);
  Pose aside = driver.last().tool;
  aside.translation().x() += 0.6 * mm;
  driver.go(aside, 1.0, 3.0);
  REQUIRE(cell.truth().gripped == 0);
  // The rest of the way is strain of the grip under the force of the cup.
  CHECK(cell.truth().slip == Approx(0.6 * mm - options.cup.force / stiffness).margin(0.1 * mm));
  CHECK(cell.truth().contact.head<2>().norm() == Approx(options.cup.force).epsilon(0.1));
  aside.translation().x() += 1.0 * mm;
  driver.go(aside, 1.0, 3.0);
  CHECK(cell.truth().gripped == -1);
  CHECK_FALSE(driver.reading.status.gripped);
  CHECK(first(cell).place == PelletPlace::Stand);
}

TEST_CASE("fingers take a lying pellet from the stand and bring its axis into their middle plane") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  pick(cell, driver);
  const bool lying = std::abs(first(cell).T_base_pellet.linear()(2, 2)) < 0.5;
  const Vector3d stand = cell.options().stand.T_base_stand.translation();
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.05)), 3.0);
  const double gap = lower_end(first(cell)) - stand.z();
  driver.go(lowered(cell, stand + Vector3d(0, 0, 0.05 - gap + 0.5 * mm)), 2.0, 3.0);
  driver.grip(false);
  driver.wait(1.0);
  REQUIRE(first(cell).place == PelletPlace::Stand);
  REQUIRE(lying);
  Pose above = driver.last().tool;
  above.translation().z() += 0.05;
  driver.go(above, 1.0);
  // X of the fingers along the axis, 2 mm beside the middle.
  const Pose T = first(cell).T_base_pellet;
  const Vector3d axis = T.linear().col(2);
  Pose fingers = down_at(T.translation());
  Vector3d x = Vector3d(axis.x(), axis.y(), 0).normalized();
  if (x.dot(above.linear().col(0)) < 0) x = -x;
  fingers.linear() << x, x.cross(Vector3d::UnitZ()), -Vector3d::UnitZ();
  fingers.translation() += 2 * mm * fingers.linear().col(1);
  driver.go(fingers, 2.0, 3.0);
  driver.grip(true, true);
  driver.wait(0.5);
  REQUIRE(cell.truth().gripped == 0);
  const Pose held = cell.truth().T_tool_pellet;
  CHECK(std::abs(held.linear()(1, 2)) < 1e-3);
  CHECK(std::abs(held.translation().y()) < 0.05 * mm);
  CHECK(driver.reading.status.gripped);
  Pose up = fingers;
  up.translation().z() += 0.05;
  driver.go(up, 1.5);
  CHECK(lower_end(first(cell)) == Approx(stand.z() + 0.05).margin(0.5 * mm));
}

TEST_CASE("a pellet let go beside everything is lost on the table, one over the bin lies in it again") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  pick(cell, driver);
  SECTION("over the table") {
    driver.go(lowered(cell, Vector3d(0.55, -0.12, 0.45)), 2.0);
    driver.grip(false);
    driver.wait(1.5);
    CHECK(first(cell).place == PelletPlace::Lost);
    CHECK(lower_end(first(cell)) <= cell.options().table + 1 * mm);
  }
  SECTION("over the bin") {
    driver.grip(false);
    driver.wait(2.0);
    CHECK(first(cell).place == PelletPlace::Bin);
    CHECK(lower_end(first(cell)) == Approx(cell.options().bin.T_base_bin.translation().z()).margin(0.1 * mm));
  }
}

TEST_CASE("a pellet that is stood up, gripped anew and let go over the bore slides to the bottom of the tube") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  stand_up(cell, driver);
  REQUIRE(cell.truth().gripped == 0);
  REQUIRE(std::abs(first(cell).T_base_pellet.linear()(2, 2)) > 0.9999);
  lower_into_tube(cell, driver, {0, 0, -5 * mm});
  CHECK(first(cell).place == PelletPlace::Grip);
  CHECK(first(cell).tube == 0);
  CHECK(first(cell).depth == Approx(5 * mm).margin(0.05 * mm));
  CHECK(cell.truth().contact.norm() < 1.0);
  driver.grip(false);
  driver.wait(2.0);
  CHECK(first(cell).place == PelletPlace::Tube);
  CHECK(first(cell).tube == 0);
  CHECK(first(cell).depth == Approx(cell.believed().tube->depth).margin(0.02 * mm));
}

TEST_CASE("a pellet that hangs in the mouth of the bore upright is in it, one that leans there is not") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  stand_up(cell, driver, true, 12 * mm);
  const double half = 0.5 * first(cell).height, lean = 0.5;
  const Eigen::Matrix3d upright = first(cell).T_base_pellet.linear();
  const Vector3d tube = cell.truth().T_base_tubes.front().translation();
  const auto hang = [&](double angle, const Vector3d& end) {
    Pose out(Eigen::AngleAxisd(angle, Vector3d::UnitX()) * upright);
    out.translation() = tube + end + half * (Eigen::AngleAxisd(angle, Vector3d::UnitX()) * Vector3d::UnitZ());
    return tool_for(cell, out);
  };
  driver.go(hang(0, {0, 0, 30 * mm}), 2.5);
  driver.go(hang(0, {0, 0, -3 * mm}), 2.0, 3.0);
  CHECK(first(cell).tube == 0);
  driver.go(hang(0, {0, 0, 30 * mm}), 2.0);
  driver.go(hang(lean, {0, 2.6 * mm, 30 * mm}), 2.0);
  driver.go(hang(lean, {0, 2.6 * mm, -3 * mm}), 2.0, 3.0);  // only its edge is below the face on one side
  CHECK(lower_end(first(cell)) < tube.z());
  CHECK(first(cell).tube == -1);
}

TEST_CASE("a pellet that falls deep into a bore is in it at every instant, however it bounces there") {
  const double depth = GENERATE(0.15, 0.3, 0.45);  // through the table
  WorkCellOptions options = exact();
  options.tube_depth = depth;
  WorkCell cell(arc(), options);
  WorkCellDriver driver(cell);
  stand_up(cell, driver);
  lower_into_tube(cell, driver, {0, 0, -5 * mm});
  driver.grip(false);
  const double face = cell.truth().T_base_tubes.front().translation().z();
  int deep = 0, in = 0;
  for (double t = 0; t < 3.0; t += cell.cycle()) {
    driver.step();
    const PelletTruth now = first(cell);
    if (now.T_base_pellet.translation().z() > face) continue;
    ++deep;
    in += now.tube == 0 && now.place != PelletPlace::Lost;
  }
  CHECK(deep > 200);
  CHECK(in == deep);
  CHECK(first(cell).place == PelletPlace::Tube);
}

TEST_CASE("a pellet beside the bore stands on the face of the tube, however it is pressed") {
  WorkCell cell(arc(), exact());
  WorkCellDriver driver(cell);
  stand_up(cell, driver);
  REQUIRE(cell.truth().gripped == 0);
  const double pressed = 0.3 * mm;
  lower_into_tube(cell, driver, {2 * mm, 0, -pressed});
  CHECK(first(cell).depth < 0.1 * mm);
  const double force = cell.truth().contact.z(), most = cell.believed().contact->stiffness * pressed;
  CHECK(force > 0.5 * most);
  CHECK(force < 1.02 * most);
}

TEST_CASE("the insertion of the library puts a pellet into a tube that is not where it is assumed") {
  WorkCellOptions options = exact();
  options.pour.height_min = options.pour.height_max = 0.017;
  options.noise = true;
  options.errors.repeatability = 1e-4;
  options.errors.tube_offset = {2 * mm, -1 * mm};
  WorkCell cell(arc(), options);
  WorkCellDriver driver(cell);
  const double height = 0.013;  // of the fingers above its lower end [m]
  stand_up(cell, driver, true, height);
  REQUIRE(cell.truth().gripped == 0);

  const cell::Cell& believed = cell.believed();
  InsertionSetup setup;
  setup.clearance = options.clearance;
  force::InsertionOptions insertion = insertion_options(believed, setup);
  insertion.grip.height = height;
  force::InsertionFrames frames{believed.tube->T_base_tube, Pose::Identity()};
  frames.T_tool_peg.translation().z() = height;
  frames.T_tool_peg.rotate(Eigen::AngleAxisd(M_PI, Vector3d::UnitX()));
  Pose above = Pose::Identity();
  above.translation().z() = 0.015;
  driver.go(force::T_base_tool(frames, above), 3.0);
  force::Insertion controller(insertion, frames);
  const double begin = cell.truth().time;
  while (!controller.finished() && cell.truth().time - begin < 300) {
    robot::RobotCommand command = controller.step(cell.read());
    command.gripper.fingers = true;
    cell.send(command);
  }
  INFO("phase " << name_of(controller.state().stopped_in) << ", reason " << name_of(controller.state().reason));
  CHECK(controller.state().phase == force::Phase::Done);
  CHECK(first(cell).tube == 0);
  CHECK(first(cell).depth > 0.9 * insertion.motion.depth);
  CHECK(cell.truth().max_force < insertion.limits.force);
}

TEST_CASE("cells of one seed do the same, those of another one something else") {
  WorkCellOptions options;
  options.pour.pellets = 3;
  const auto run = [&](std::uint64_t seed) {
    options.seed = seed;
    WorkCell cell(arc(), options);
    WorkCellDriver driver(cell);
    pick(cell, driver);
    return std::pair(driver.reading, cell.truth());
  };
  const auto once = run(3), again = run(3), other = run(4);
  CHECK(same(once.first, again.first));
  CHECK(same(once.second, again.second));
  CHECK_FALSE(same(once.first, other.first));
}

TEST_CASE("a cell goes on from its state as the one that it is of") {
  WorkCellOptions options;
  options.pour.pellets = 3;
  WorkCell cell(arc(), options);
  WorkCellDriver driver(cell);
  const auto file = std::filesystem::temp_directory_path() / "kr5_work_cell_test.yaml";
  const std::string when = GENERATE("moving", "in the grip", "falling");
  const Vector3d top = top_of(first(cell));
  driver.start(down_at(top + Vector3d(0, 0, 0.08)));
  driver.go(down_at(top + Vector3d(0, 0, 0.5 * mm)), 1.0, when == "moving" ? -0.5 : 1.0);
  if (when != "moving") {
    driver.grip(true);
    driver.wait(0.3);
    REQUIRE(cell.truth().gripped >= 0);
    driver.go(down_at(top + Vector3d(0, 0, 0.1)), 1.5, 0.0);
  }
  if (when == "falling") {
    driver.grip(false);
    driver.wait(0.05);
  }
  INFO(when);
  save_state(cell.state(), file);
  WorkCell other(arc(), options);
  other.restore(load_state(file));
  std::filesystem::remove(file);
  WorkCellDriver follower(other, driver);
  for (int k = 0; k < 80; ++k) {
    driver.step();
    follower.step();
    REQUIRE(same(driver.reading, follower.reading));
    REQUIRE(same(cell.truth(), other.truth()));
  }
}

TEST_CASE("a state of another cell, or a file that is none, is refused with what is wrong") {
  WorkCellOptions options = exact();
  WorkCell cell(arc(), options);
  options.pour.pellets = 2;
  WorkCell other(arc(), options);
  CHECK_THROWS_WITH(other.restore(cell.state()), Contains("pellets: found 1, expected 2"));
  const auto file = std::filesystem::temp_directory_path() / "kr5_work_cell_test_none.yaml";
  io::write_text(file, "format: kr5-cell/1\n");
  CHECK_THROWS_WITH(load_state(file), Contains("kr5_work_cell_test_none.yaml") && Contains("format: found kr5-cell/1"));
  std::filesystem::remove(file);
  CHECK_THROWS_AS(load_state(file), IoError);
}

TEST_CASE("late readings of the force sensor are those of before") {
  WorkCellOptions options = exact();
  WorkCell prompt(arc(), options);
  options.errors.force_delay = 2 * prompt.cycle();
  WorkCell late(arc(), options);
  WorkCellDriver driver(prompt), follower(late);
  const Pose start = down_at(top_of(first(prompt)) + Vector3d(0, 0, 0.08));
  driver.start(start);
  follower.start(start);
  std::vector<Vector6> told, told_late;
  for (int k = 0; k < 60; ++k) {
    robot::RobotCommand command = robot::tool_command(start);
    command.tool.translation().x() += 0.02 * std::sin(0.2 * k);
    told.push_back(prompt.read().sensor);
    told_late.push_back(late.read().sensor);
    prompt.send(command);
    late.send(command);
  }
  double most = 0.0;
  for (std::size_t k = 2; k < told.size(); ++k) {
    CHECK((told_late[k] - told[k - 2]).norm() < 1e-9);
    most = std::max(most, (told_late[k] - told[k]).norm());
  }
  CHECK(most > 0.1);
}

TEST_CASE("a scan over the real motion shows the pellets where they are") {
  WorkCellOptions options = exact();
  options.pour.pellets = 5;
  options.scanner.pitch = 0.001;
  WorkCell cell(arc(), options);
  WorkCellDriver driver(cell);
  const Vector3d bin = options.bin.T_base_bin.translation();
  driver.start(down_at(bin + Vector3d(0, -0.12, 0.15)));
  cell.start_scan();
  driver.go(down_at(bin + Vector3d(0, 0.12, 0.15)), 6.0);
  const std::function<BinScan()> see = cell.end_scan(ScanPlace::Bin);
  driver.go(down_at(bin + Vector3d(0, 0.1, 0.15)), 0.5);  // the cell goes on before the rays are traced
  const BinScan scan = see();
  std::vector<int> surfaces;
  const auto points = scan.cloud(&surfaces);
  int on_pellets = 0;
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    if (surfaces[k] < 0) continue;
    const PelletTruth p = cell.truth().pellets[static_cast<std::size_t>(surfaces[k])];
    const Vector3d at = p.T_base_pellet.inverse() * Vector3d(points.row(static_cast<Eigen::Index>(k)).transpose());
    const double side = std::abs(at.head<2>().norm() - p.radius), face = std::abs(std::abs(at.z()) - 0.5 * p.height);
    CHECK(std::min(side, face) < 0.05 * mm);
    ++on_pellets;
  }
  CHECK(on_pellets > 200);
  CHECK_THROWS_WITH(cell.finish_scan(ScanPlace::Bin), Contains("scan: none was started"));
}

TEST_CASE("bad options are named with what holds them") {
  const auto refused = [](auto&& change) {
    WorkCellOptions options = exact();
    change(options);
    try {
      WorkCell(arc(), options);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  CHECK_THAT(refused([](auto& o) { o.clearance = 0; }), Contains("clearance: must be positive"));
  CHECK_THAT(refused([](auto& o) { o.cup.force = -1; }), Contains("cup.force: must be positive"));
  CHECK_THAT(refused([](auto& o) { o.fingers.angle = 2; }), Contains("fingers.angle: must lie between"));
  CHECK_THAT(refused([](auto& o) { o.stand.size.x() = 0; }), Contains("stand.size: must be two positive"));
  CHECK_THAT(refused([](auto& o) { o.errors.face = NAN; }), Contains("errors.face: must not be negative"));
  CHECK_THAT(refused([](auto& o) { o.bin.wall = 0; }), Contains("bin.wall"));
  CHECK_THAT(refused([](auto& o) { o.pour.pellets = 0; }), Contains("pour.pellets"));
  CHECK_THAT(refused([](auto& o) { o.scanner.points = 0; }), Contains("scanner.points"));
  Pose stretched = Pose::Identity();
  stretched.matrix()(0, 0) = 2.0;
  CHECK_THAT(refused([&](auto& o) { o.further_tubes.push_back(stretched); }),
             Contains("further_tubes[0]: must be a rigid motion"));
  cell::Cell bare = arc();
  bare.contact.reset();
  CHECK_THROWS_WITH(WorkCell(bare, exact()), Contains("contact"));
  bare = arc();
  bare.tube.reset();
  CHECK_THROWS_WITH(WorkCell(bare, exact()), Contains("tube"));
}

TEST_CASE("what differs from the model is withheld from the controller") {
  WorkCellOptions options = exact();
  options.noise = true;
  options.errors.tube_offset = {3 * mm, -2 * mm};
  options.errors.face = 0;
  options.errors.tube_tilt = 0;
  cell::Cell given = arc();
  given.effects.set("ft_bias", "fz", "bias", 5.0);
  WorkCell cell(given, options);
  CHECK(cell.believed().effects.entries().empty());
  CHECK(cell.believed().tube->T_base_tube.isApprox(given.tube->T_base_tube));
  CHECK(cell.believed().peg->radius == options.pour.radius);
  CHECK(cell.believed().tube->inner_radius == Approx(options.pour.radius + options.clearance));
  const Vector3d off = cell.truth().T_base_tubes.front().translation() - given.tube->T_base_tube.translation();
  CHECK((off - Vector3d(3 * mm, -2 * mm, 0)).norm() < 1e-9);
}

}  // namespace work_cell_test

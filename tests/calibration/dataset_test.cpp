#include <filesystem>
#include <fstream>

#include <catch2/catch.hpp>

#include <kr5/calibration/dataset.hpp>
#include <kr5/calibration/pose_file.hpp>
#include <kr5/core/error.hpp>

namespace dataset_test {

namespace fs = std::filesystem;
using namespace kr5;
using namespace kr5::calibration;

namespace {

/// A folder that is gone afterwards.
class Folder {
 public:
  Folder()
      : path_(fs::temp_directory_path() / ("kr5_dataset_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)))) {
    fs::remove_all(path_);
    fs::create_directories(path_ / "images");
    fs::create_directories(path_ / "poses");
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

const std::string head =
    "images: images/*.png\nposes: poses/*.yaml\nmount: eye_in_hand\nconvention: {position: m, rotation: "
    "quaternion_xyzw}\n";

void write_three(const Folder& folder) {
  for (const int i : {1, 2, 10}) {
    folder.write("images/image-" + std::to_string(i) + ".png", "");
    folder.write("poses/pose_" + std::to_string(i) + ".yaml",
                 "qw: 1\nx: " + std::to_string(i) + "\ny: 0\nz: 0.5\nqx: 0\nqy: 0\nqz: 0\n");
  }
}

std::string error_of(const fs::path& file) {
  try {
    load_dataset(file);
  } catch (const IoError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("images and poses are paired by their numbers, in the order people count") {
  Folder folder;
  write_three(folder);
  const Dataset set = load_dataset(folder.write("dataset.yaml", head + "target: chessboard:6x9:0.02\n"));
  REQUIRE(set.images.size() == 3);
  CHECK_THAT(set.images[2], Catch::EndsWith("image-10.png"));
  CHECK(set.rows.col(0) == Eigen::Vector3d(1, 2, 10));
  CHECK(set.pairing == Pairing::Number);
  CHECK(set.target == "chessboard:6x9:0.02");
  CHECK((set.poses()[1].translation() - Eigen::Vector3d(2, 0, 0.5)).norm() < 1e-12);
}

TEST_CASE("poses are read from flat and nested keys, ViSP's matrices, lists, CSV and plain text") {
  Folder folder;
  const auto row = [&](const std::string& name, const std::string& text, RotationForm form) {
    const PoseFile file = load_poses(folder.write(name, text), form);
    REQUIRE(file.rows.rows() == 1);
    return Eigen::VectorXd(file.rows.row(0));
  };
  const Eigen::VectorXd six = Eigen::VectorXd::LinSpaced(6, 1, 6);
  using enum RotationForm;
  CHECK(row("a.yaml", "rows: 6\ncols: 1\ndata:\n  - [1]\n  - [2]\n  - [3]\n  - [4]\n  - [5]\n  - [6]\n",
            RotationVector) == six);
  CHECK(row("b.yaml", "[1, 2, 3, 4, 5, 6]", Rpy) == six);
  CHECK(row("c.yaml", "{X: 1, Y: 2, Z: 3, A: 4, B: 5, C: 6}", KukaAbc) == six);
  CHECK(row("d.csv", "name,yaw,pitch,roll,z,y,x\n7,6,5,4,3,2,1\n", Rpy) == six);
  CHECK(row("d2.csv", "x;y;z;roll;pitch;yaw\n1,0;2,0;3;4;5;6\n", Rpy) == six);
  CHECK(row("d3.csv", "1;2;3,0;4;5;6,0\n", Rpy) == six);
  CHECK(row("d4.csv", "1,2,3,4,5,6\n", Rpy) == six);
  CHECK(row("d5.txt", "1,0\t2,0\t3\t4\t5\t6,0\n", Rpy) == six);
  CHECK(row("e.txt", "# a comment\n1 2,3;\t4 5 6\n", RotationVector) == six);
  CHECK(row("f.txt", "1\n2\n3\n4\n5\n6\n", RotationVector) == six);
  const Eigen::VectorXd seven =
      row("g.yaml", "position: {x: 1, y: 2, z: 3}\norientation: {w: 4, x: 5, y: 6, z: 7}\n", QuaternionWxyz);
  CHECK(seven == Eigen::VectorXd::LinSpaced(7, 1, 7));
  CHECK(row("h.txt", "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n", Matrix).size() == 16);
  const PoseFile rows =
      load_poses(folder.write("i.csv", "t,x,y,z,qx,qy,qz,qw\n0.5,1,2,3,0,0,0,1\n1.5,1,2,3,0,0,0,1\n"), QuaternionXyzw);
  CHECK(rows.times == std::vector<double>{0.5, 1.5});
}

TEST_CASE("a tool offset is taken off the poses") {
  Folder folder;
  write_three(folder);
  const Dataset set = load_dataset(folder.write("dataset.yaml", head + "T_flange_tool: [0, 0, 0.1, 0, 0, 0]\n"));
  CHECK(set.poses()[0].translation().z() == Approx(0.4));
}

TEST_CASE("what is wrong with a data set is said with file, line, field and remedy") {
  Folder folder;
  write_three(folder);
  CHECK_THAT(error_of(folder.path() / "none.yaml"), Catch::Contains("no such file"));
  CHECK_THAT(error_of(folder.write("a.yaml", head + "tarjet: x\n")),
             Catch::Contains("a.yaml:5") && Catch::Contains("did you mean 'target'"));
  CHECK_THAT(error_of(folder.write("b.yaml", "images: images/*.png\nposes: [1, 2]\n")),
             Catch::Contains("convention") && Catch::Contains("mount"));
  CHECK_THAT(error_of(folder.write(
                 "c.yaml", "images: pictures/*.png\nposes: poses/*.yaml\nmount: eye_in_hand\nconvention: {}\n")),
             Catch::Contains("images") && Catch::Contains("none matches"));
  CHECK_THAT(
      error_of(folder.write(
          "d.yaml", "images: images/*.png\nposes: poses/*.yaml\nmount: in_hand\nconvention: {rotation: euler}\n")),
      Catch::Contains("eye_in_hand | eye_to_hand") && Catch::Contains("quaternion_xyzw | "));
  folder.write("images/image-11.png", "");
  CHECK_THAT(error_of(folder.write("e.yaml", head)),
             Catch::Contains("without a pose of the same number") && Catch::Contains("image-11.png"));
  CHECK_THAT(error_of(folder.write("f.yaml", head + "pairing: order\n")),
             Catch::Contains("3 poses for 4 images") && Catch::Contains("one for each"));
  folder.write("poses/pose_11.yaml", "x: 1\ny: 0\nz: 0.5\nqx: 0\nqy: 0\nqz: 0\n");
  CHECK_THAT(error_of(folder.write("e.yaml", head)), Catch::Contains("pose_11.yaml") && Catch::Contains("found no qw"));
  folder.write("poses/pose_11.yaml", "x: .nan\ny: 0\nz: 0.5\nqx: 0\nqy: 0\nqz: 0\nqw: 1\n");
  CHECK_THAT(error_of(folder.write("e.yaml", head)), Catch::Contains("pose_11.yaml:1") && Catch::Contains("NaN"));
  folder.write("poses/pose_11.yaml", "x: 1\ny: 0\nz: 0.5\nqx: 0\nqy: 0\nqz: 0\nqw: 1.5\n");
  CHECK_THAT(error_of(folder.write("e.yaml", head)), Catch::Contains("convention") && Catch::Contains("pose 4"));
  folder.write("poses/pose_11.yaml", "rows: 6\ncols: 1\ndata: [1, 2, 3, 4, 5, 6]\n");
  CHECK_THAT(error_of(folder.write("e.yaml", head)), Catch::Contains("6 numbers") && Catch::Contains("expected 7"));
}

TEST_CASE("a short row of a CSV or text file is named by its line") {
  Folder folder;
  CHECK_THROWS_WITH(
      load_poses(folder.write("a.csv", "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,3\n"), RotationForm::QuaternionXyzw),
      Catch::Contains("a.csv:3") && Catch::Contains("3 values"));
  CHECK_THROWS_WITH(load_poses(folder.write("b.txt", "1 2 3 4 5 6\n1 2 3 4 5\n"), RotationForm::RotationVector),
                    Catch::Contains("b.txt:2") && Catch::Contains("5 numbers"));
  CHECK_THROWS_WITH(load_poses(folder.write("c.txt", "1 2 x 4 5 6\n"), RotationForm::RotationVector),
                    Catch::Contains("'x'"));
  CHECK_THROWS_WITH(load_poses(folder.write("d.csv", "u,v\n1,2\n"), RotationForm::Rpy), Catch::Contains("columns u v"));
}

TEST_CASE("poses that touch a point need neither images nor mount, but their convention") {
  Folder folder;
  folder.write("touches.csv", "x,y,z,a,b,c\n1000,0,0,90,0,0\n0,0,500,0,0,0\n");
  const std::string convention = "convention: {position: mm, rotation: kuka_abc, angle: deg}\n";
  const Dataset set = load_pose_set(folder.write("dataset.yaml", "poses: touches.csv\n" + convention));
  REQUIRE(set.poses().size() == 2);
  CHECK((set.poses()[0].translation() - Eigen::Vector3d(1, 0, 0)).norm() < 1e-12);
  CHECK((set.poses()[0].linear() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm() < 1e-12);
  CHECK_THROWS_WITH(load_pose_set(folder.write("dataset.yaml", "poses: touches.csv\n")), Catch::Contains("convention"));
  CHECK_THROWS_WITH(load_pose_set(folder.write("dataset.yaml", "poses: none.csv\n" + convention)),
                    Catch::Contains("none matches"));
}

}  // namespace dataset_test

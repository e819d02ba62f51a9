#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <sys/stat.h>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/io/fields.hpp>
#include <kr5/io/format.hpp>
#include <kr5/io/json.hpp>
#include <kr5/io/node.hpp>

namespace node_test {

using namespace kr5;
using namespace kr5::io;
using Catch::Matchers::Contains;

namespace {
std::string complaint(const std::string& yaml) {
  try {
    parse_yaml(yaml, "cell.yaml");
  } catch (const IoError& e) {
    return e.what();
  }
  return "none";
}
std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("kr5_io_" + name);
}
}  // namespace

TEST_CASE("a tree written as YAML reads back the same") {
  const std::string text =
      "name: arm\nrows: [[1.0, 2.5], [3.0, -4.0e-05]]\nlinks:\n  - {mass: 1.0, com: [0, 0, 1]}\n"
      "  - mass: 2\nempty: []\nnothing: ~\nquoted: '12'\nwords: \"a: b # c\"\n";
  const Node tree = parse_yaml(text, "t");
  const Node again = parse_yaml(to_yaml(tree), "t");
  CHECK(tree == again);
  CHECK(again.find("quoted")->quoted);
  CHECK(again.find("words")->scalar == "a: b # c");
}

TEST_CASE("numbers read back bit for bit, and carry a point for readers of YAML 1.1") {
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const double value = random.normal() * std::pow(10.0, random.uniform(-300, 300));
    const Node node = Node::make_scalar(value);
    CHECK(node.scalar.find('.') != std::string::npos);
    Reader reader("t");
    double back = 0;
    REQUIRE(reader.read(parse_yaml(to_yaml(node), "t"), "x", back));
    CHECK(back == value);
  }
  CHECK(Node::make_scalar(2e-5).scalar == "2.0e-05");
  CHECK(std::signbit(std::strtod(Node::make_scalar(-0.0).scalar.c_str(), nullptr)));
}

TEST_CASE("every node knows its line, an entry that of its key") {
  const Node tree = parse_yaml("a: 1\nb:\n  c: [1,\n    2]\n  d:\n    - x: 3\n", "t");
  CHECK(tree.find("b")->line == 2);
  CHECK(tree.find("b")->find("c")->items[1].line == 4);
  CHECK(tree.find("b")->find("d")->items[0].find("x")->line == 6);
}

TEST_CASE("malformed YAML is refused with file and line") {
  CHECK_THAT(complaint("a: 1\nb: [1, 2\n"), Contains("cell.yaml:") && Contains("not valid YAML"));
  CHECK_THAT(complaint("a: 1\nb: 2\na: 3\n"), Contains("cell.yaml:3: the key 'a' occurs twice"));
  CHECK_THAT(complaint("# only a comment\n"), Contains("cell.yaml: the file is empty"));
  CHECK_THAT(complaint("a: 1\n---\nb: 2\n"), Contains("cell.yaml:3: a second document"));
  CHECK_THAT(complaint("? [1, 2]\n: 3\n"), Contains("a key must be a scalar"));
  CHECK_THAT(complaint(std::string(5000, '[')), Contains("cell.yaml:1:"));
}

TEST_CASE("aliases that multiply beyond reason are refused before they fill the memory") {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last;
    for (int k = 0; k < 9; ++k) text += ", " + last;
    text += "]\n";
  }
  CHECK_THAT(complaint(text), Contains("too large"));
}

TEST_CASE("a file that is missing, empty or a folder is named") {
  CHECK_THROWS_WITH(load_yaml(scratch("missing.yaml")), Contains("kr5_io_missing.yaml: no such file"));
  const auto folder = std::filesystem::temp_directory_path();
  CHECK_THROWS_WITH(load_yaml(folder), Contains("is a folder"));
  const auto file = scratch("empty.yaml");
  std::ofstream(file).close();
  CHECK_THROWS_WITH(load_yaml(file), Contains("kr5_io_empty.yaml") && Contains("empty"));
  std::filesystem::remove(file);
}

TEST_CASE("a file that cannot be written leaves the old one and no rest") {
  const auto folder = scratch("no_such_folder");
  CHECK_THROWS_AS(write_text(folder / "x.yaml", "a"), IoError);
  const auto file = scratch("kept.yaml");
  write_text(file, "old");
  write_text(file, "new");
  CHECK(read_text(file) == "new");
  CHECK_FALSE(std::filesystem::exists(file.string() + ".part"));
  std::filesystem::remove(file);
}

TEST_CASE("JSON shows numbers as numbers, quoted numbers as text and what is not finite as null") {
  Node tree =
      parse_yaml("a: 1\nb: '1'\nc: .5\nd: .inf\ne: nan\nf: true\ng: [1.0, -2e-7]\nh: \"x\\\"y\\n\"\ni: 007\n", "t");
  CHECK(to_json(tree, 0) ==
        "{\"a\": 1,\"b\": \"1\",\"c\": 0.5,\"d\": null,\"e\": \"nan\",\"f\": true,\"g\": [1.0, -2.0e-07],"
        "\"h\": \"x\\\"y\\u000a\",\"i\": 7.0}\n");
}

TEST_CASE("bytes that are no UTF-8 text are refused with their line") {
  for (const std::string& bad :
       {std::string("\xff"), std::string("\xc0\x80"), std::string("\xed\xa0\x80"), std::string("\xe2\x82"),
        std::string(1, '\0'), std::string("\x01"), std::string("\x7f"), std::string("\rc\n")}) {
    CHECK_THROWS_WITH(parse_yaml("a: 1\nb: " + bad, "t"),
                      Catch::StartsWith("t:2: found the byte 0x") && Catch::Contains("UTF-8"));
  }
  CHECK(parse_yaml("a: \xc3\xa9\xe2\x82\xac\xf0\x9f\xa4\x96", "t").find("a")->scalar ==
        "\xc3\xa9\xe2\x82\xac\xf0\x9f\xa4\x96");
  CHECK_THROWS_WITH(parse_yaml("a: 1\nb: \"\\N\"", "t"),
                    Catch::StartsWith("t:2: an escape sequence that is not a character"));
}

TEST_CASE("documents nested a thousand deep, and aliases that multiply, are refused with their line") {
  std::string deep(1000, '[');
  deep += std::string(1000, ']');
  CHECK_THAT(complaint("a: " + deep), Contains("cell.yaml:1: not valid YAML"));
  std::string maps;
  for (int i = 0; i < 1000; ++i) maps += "{a: ";
  CHECK_THAT(complaint("a: " + maps), Contains("not valid YAML"));
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int k = 0; k < 8; ++k) bomb += ", " + before;
    bomb += "]\n";
  }
  CHECK_THAT(complaint(bomb), Contains("the aliases make the document too large"));
}

TEST_CASE("values of any length are shortened in messages, between two characters") {
  CHECK(shortened("short") == "short");
  CHECK(shortened(std::string(200, 'x')) == std::string(80, 'x') + "...");
  std::string accents;
  for (int i = 0; i < 100; ++i) accents += "\xC3\xA9";  // e with an accent
  const std::string cut = shortened(accents, 81);
  CHECK(cut == accents.substr(0, 80) + "...");
  Reader reader("t");
  double value = 0;
  reader.read(parse_yaml("x: " + std::string(100'000, 'y'), "t"), "", value);
  reader.read(parse_yaml(std::string(100'000, 'y'), "t"), std::string(5000, 'z'), value);
  for (const Diagnostic& d : reader.diagnostics()) CHECK(d.text().size() < 1200);
  const std::vector<Diagnostic> one = {{"f", 1, "k", std::string(1 << 20, 'v'), std::string(1 << 20, 'w')}};
  CHECK_THROWS_AS(throw_diagnostics(one), IoError);
  CHECK(one[0].text().size() < 1200);
  CHECK(nearest_name(std::string(1 << 20, 'q'), std::vector<std::string>{"q1"}).empty());
}

TEST_CASE("warnings alone let a file be used, errors beside them do not") {
  Diagnostic warning{"f", 1, "mass", "9000", "a mass in kilograms", Severity::Warning};
  CHECK_NOTHROW(throw_diagnostics(std::vector{warning}));
  const std::vector<Diagnostic> both = {warning, {"f", 2, "b", "x", "a number"}};
  CHECK_THROWS_WITH(throw_diagnostics(both), "f:2: b: found x, expected a number");
}

TEST_CASE("why a file cannot be written is said") {
  if (!std::filesystem::exists("/dev/full")) return;
  CHECK_THROWS_WITH(write_text("/dev/full", "x"), Contains("/dev/full: cannot be written: No space left on device"));
  CHECK_THROWS_WITH(write_text("/no_such_folder/x", "x"), Contains("x: cannot be written: No such file or directory"));
}

TEST_CASE("loops of links, devices and pipes are errors of the file, and a link given to write to is followed") {
  namespace fs = std::filesystem;
  const fs::path folder = scratch("links");
  fs::remove_all(folder);
  fs::create_directories(folder);
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  CHECK_THROWS_WITH(read_text(folder / "a"), Contains("cannot be read"));
  CHECK_THROWS_AS(write_text(folder / "a", "x"), IoError);
  if (fs::exists("/dev/zero")) CHECK_THROWS_WITH(read_text("/dev/zero"), Contains("is a device"));
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);  // to which nobody writes
  CHECK_THROWS_WITH(read_text(folder / "pipe"), Contains("pipe: is a pipe or a socket, expected a file"));
  fs::remove(folder / "pipe");
  write_text(folder / "real", "old");
  fs::create_symlink("real", folder / "link");
  write_text(folder / "link", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(read_text(folder / "real") == "new");
  CHECK(std::distance(fs::directory_iterator(folder), fs::directory_iterator()) == 4);  // nothing is left beside
  fs::remove_all(folder);
}

}  // namespace node_test

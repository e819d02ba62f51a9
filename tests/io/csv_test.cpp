#include <cstring>
#include <filesystem>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/io/csv.hpp>
#include <kr5/io/node.hpp>

namespace csv_test {

using namespace kr5;
using namespace kr5::io;
using Catch::Matchers::Contains;

namespace {
std::string complaint(const std::string& text) {
  try {
    parse_csv(text, "log.csv");
  } catch (const IoError& e) {
    return e.what();
  }
  return "none";
}
}  // namespace

TEST_CASE("a table of any doubles reads back bit for bit") {
  Random random(3);
  Table table{{"t", "q1", "fx"}, Eigen::MatrixXd(400, 3)};
  for (double& v : table.values.reshaped()) v = random.normal() * std::pow(10.0, random.uniform(-320, 300));
  table.values(0, 0) = -0.0;
  table.values(1, 0) = std::numeric_limits<double>::denorm_min();
  table.values(2, 0) = std::numeric_limits<double>::max();
  const auto file = std::filesystem::temp_directory_path() / "kr5_io_exact.csv";
  save_csv(table, file);
  const Table back = load_csv(file);
  std::filesystem::remove(file);
  REQUIRE(back.columns == table.columns);
  REQUIRE(back.values.rows() == 400);
  CHECK(std::memcmp(back.values.data(), table.values.data(), sizeof(double) * 1200) == 0);
}

TEST_CASE("the shortest text of each number is written") {
  const auto file = std::filesystem::temp_directory_path() / "kr5_io_short.csv";
  save_csv({{"a", "b"}, Eigen::RowVector2d(0.1, 25.0)}, file);
  CHECK(read_text(file) == "a,b\n0.1,25\n");
  std::filesystem::remove(file);
}

TEST_CASE("spreadsheets' marks, blanks, plus signs and missing last newlines are taken") {
  const Table table = parse_csv("\xEF\xBB\xBFt, z\r\n0,+1.5\r\n\r\n 1 , -2e-3", "log.csv");
  CHECK(table.columns == std::vector<std::string>{"t", "z"});
  CHECK(table.values == (Eigen::Matrix2d() << 0, 1.5, 1, -2e-3).finished());
  CHECK(table.column("z")[1] == -2e-3);
  CHECK_THROWS_WITH(table.column("x"), Contains("no column 'x'; there are t, z"));
}

TEST_CASE("semicolons, tabs and bars part columns, then with decimal commas or points") {
  const Eigen::Matrix2d values = (Eigen::Matrix2d() << 0, 1.5, 1, -2e-3).finished();
  for (const char* text : {"t;z\n0;1,5\n1;-2e-3\n", "t\tz\n0\t1,5\n1\t-0,002\n", "t|z\n0|1.5\n1|-2e-3\n"}) {
    const Table table = parse_csv(text, "log.csv");
    CAPTURE(text);
    CHECK(table.columns == std::vector<std::string>{"t", "z"});
    CHECK(table.values == values);
  }
  CHECK_THAT(complaint("t;z\n0;1,5,2\n"), Contains("log.csv:2: z: found '1,5,2'"));
  CHECK_THAT(complaint("t;z\n0;1;5\n"), Contains("log.csv:2: found 3 values, expected 2"));
  CHECK_THAT(complaint("t,z\n0;1,5\n"), Contains("log.csv:2"));
}

TEST_CASE("a bad header is refused with line and column") {
  CHECK_THAT(complaint(""), Contains("log.csv: found an empty file"));
  CHECK_THAT(complaint("\n\n"), Contains("log.csv: found an empty file"));
  CHECK_THAT(complaint("t,z\n"), Contains("log.csv:1: found a header without rows"));
  CHECK_THAT(complaint("t,z,t\n1,2,3\n"), Contains("log.csv:1: column 3: found 't' a second time"));
  CHECK_THAT(complaint("t,,z\n1,2,3\n"), Contains("log.csv:1: column 2: found no name"));
  CHECK_THAT(complaint("1,2\n3,4\n"), Contains("log.csv:1: column 1: found the number '1'"));
}

TEST_CASE("bad rows are refused with line and column, all of them at once") {
  CHECK_THAT(complaint("t,z\n0,1\n1\n"),
             Contains("log.csv:3: found 1 value, expected 2 as in the header; is the file cut off?"));
  CHECK_THAT(complaint("t,z\n0,1,2\n1,2\n"), Contains("log.csv:2: found 3 values, expected 2 as in the header"));
  CHECK_THAT(complaint("t,z\n0,nan\n"), Contains("log.csv:2: z: found 'nan', expected a finite number"));
  CHECK_THAT(complaint("t,z\n0,inf\n"), Contains("log.csv:2: z: found 'inf'"));
  CHECK_THAT(complaint("t,z\n0,\n"), Contains("log.csv:2: z: found ''"));
  CHECK_THAT(complaint("t,z\n0,1.2.3\n"), Contains("log.csv:2: z: found '1.2.3'"));
  CHECK_THAT(complaint("t,z\n0,1e999\n"), Contains("log.csv:2: z: found '1e999'"));
  const std::string both = complaint("t,z\n0,a\n1,2\n2\n");
  CHECK_THAT(both, Contains("log.csv:2: z: found 'a'") && Contains("log.csv:4: found 1 value"));
}

TEST_CASE("good rows keep their line when others are left out") {
  const ParsedCsv parsed = try_parse_csv("t,z\n0,1\n\nx,2\n3,4\n", "log.csv");
  CHECK(parsed.diagnostics.size() == 1);
  CHECK(parsed.lines == std::vector<int>{2, 5});
  CHECK(parsed.table.values(1, 1) == 4);
}

TEST_CASE("a table whose names and values disagree is not written") {
  CHECK_THROWS_AS(save_csv({{"a"}, Eigen::RowVector2d(1, 2)}, "unused.csv"), InvalidArgument);
}

TEST_CASE("bytes that are no text are refused, and what is echoed stays short and is text") {
  const ParsedCsv utf16 = try_parse_csv(std::string("\xFF\xFEt\0,\0z\0\n\0", 10), "log.csv");
  REQUIRE(utf16.diagnostics.size() == 1);
  CHECK(utf16.diagnostics[0].expected == "a text file saved as UTF-8");
  CHECK(try_parse_csv("t,\xE4\n0,1\n", "log.csv").diagnostics.size() == 1);  // Latin-1
  const ParsedCsv huge = try_parse_csv("t\n" + std::string(1 << 20, 'x') + "\n", "log.csv");
  REQUIRE(huge.diagnostics.size() == 1);
  CHECK(huge.diagnostics[0].found.size() < 100);
}

TEST_CASE("a hundred thousand columns are read, and one that is there twice is found among them") {
  std::string header = "c0", row = "0";
  for (int i = 1; i < 100'000; ++i) header += ",c" + std::to_string(i), row += ",0";
  CHECK(try_parse_csv(header + "\n" + row + "\n", "wide.csv").table.values.cols() == 100'000);
  CHECK(try_parse_csv(header + ",c7\n", "wide.csv").diagnostics.size() == 1);
}

}  // namespace csv_test

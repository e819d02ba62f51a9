// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

namespace effect_laws_test {

using namespace kr5;
namespace fs = std::filesystem;

namespace {

const fs::path root = fs::path(KR5_TEST_DIR).parent_path();

std::string text_of(const fs::path& file) {
  std::ostringstream out;
  out << std::ifstream(file).rdbuf();
  return out.str();
}

std::vector<fs::path> sources_in(const fs::path& folder) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::recursive_directory_iterator(root / folder))
    if (entry.path().extension() == ".cpp" || entry.path().extension() == ".hpp") out.push_back(entry.path());
  REQUIRE_FALSE(out.empty());
  return out;
}

}  // namespace

TEST_CASE("every effect of the catalogue has one function of its name among the laws") {
  std::string declarations;
  for (const fs::path& file : sources_in("libkr5/include/kr5/physics")) declarations += text_of(file);
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    const std::regex declaration("\\b" + effect.id + "\\(");
    const auto first = std::sregex_iterator(declarations.begin(), declarations.end(), declaration);
    CAPTURE(effect.id);
    CHECK(std::distance(first, std::sregex_iterator()) == 1);
  }
}

TEST_CASE("no simulator reads an effect itself: both have the laws of one place") {
  const std::regex read(R"((\.|->)\s*effects\b)");  // also a reference to all of them
  // A scene has effects of its own, which it gives to a cell.
  const std::regex passed_on(R"(\bif \(scene\.effects\)|\bcell\.effects = [^;]*;|\bself\.effects\b)");
  for (const char* folder : {"libkr5/src/predict", "libkr5/include/kr5/predict", "sim/src", "sim/include"})
    for (const fs::path& file : sources_in(folder)) {
      CAPTURE(file.string());
      const std::string text = std::regex_replace(text_of(file), passed_on, "");
      CHECK_FALSE(std::regex_search(text, read));
    }
  std::string laws;
  for (const fs::path& file : sources_in("libkr5/src/physics")) laws += text_of(file);
  CHECK(std::regex_search(laws, read));  // the expression finds what it looks for
  CHECK(std::regex_search("const auto& e = cell.effects; e.number(", read));
  CHECK(std::regex_search("cell->effects", read));
}

}  // namespace effect_laws_test

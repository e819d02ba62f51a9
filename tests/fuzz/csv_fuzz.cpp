// Any bytes as CSV: refused with IoError, or a table of finite numbers under distinct names.
#include <cstdint>
#include <cstdlib>
#include <set>
#include <string_view>

#include <kr5/core/error.hpp>
#include <kr5/io/csv.hpp>

using namespace kr5;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const io::Table table = io::parse_csv(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz");
    const std::set<std::string> names(table.columns.begin(), table.columns.end());
    if (!table.values.allFinite() || table.values.rows() == 0 || names.size() != table.columns.size() ||
        table.values.cols() != static_cast<Eigen::Index>(names.size()))
      std::abort();
  } catch (const IoError&) {
  }
  return 0;
}

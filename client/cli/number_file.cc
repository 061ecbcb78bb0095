#include "client/cli/number_file.h"

#include <cmath>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace strata::cli {
namespace {

// The numbers of a line; empty if one of its words is none.
std::vector<double> NumbersOf(const std::string& line) {
  std::vector<double> numbers;
  for (const absl::string_view word :
       absl::StrSplit(line, absl::ByAnyChar(",; \t\r"), absl::SkipEmpty())) {
    double number = 0.0;
    if (!absl::SimpleAtod(word, &number) || !std::isfinite(number)) {
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

absl::StatusOr<std::vector<std::vector<double>>> ReadNumberFile(const std::string& path,
                                                                std::size_t min_count,
                                                                std::size_t max_count) {
  std::ifstream file(path);
  if (!file) {
    return absl::NotFoundError(absl::StrCat(path, ": cannot be opened"));
  }
  std::vector<std::vector<double>> rows;
  std::string line;
  bool first = true;
  for (int number = 1; std::getline(file, line); ++number) {
    const absl::string_view text = absl::StripAsciiWhitespace(line);
    if (text.empty() || text.front() == '#') {
      continue;
    }
    std::vector<double> numbers = NumbersOf(line);
    const bool header = first && numbers.empty() && absl::ascii_isalpha(text.front());
    first = false;
    if (header) {
      continue;
    }
    if (numbers.size() < min_count || numbers.size() > max_count) {
      const std::string count = min_count == max_count ? absl::StrCat(min_count)
                                                       : absl::StrCat(min_count, " to ", max_count);
      return absl::InvalidArgumentError(absl::StrCat(
          path, ":", number, ": expected ", count, " numbers, got \"", text.substr(0, 60), "\""));
    }
    rows.push_back(std::move(numbers));
  }
  return rows;
}

}  // namespace strata::cli

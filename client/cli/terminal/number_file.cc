#include "client/cli/terminal/number_file.h"

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

#include "client/formats/file_bytes.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

constexpr absl::string_view kByteOrderMark = "\xef\xbb\xbf";

// The numbers of a line; empty if one of its words is none.
std::vector<double> NumbersOf(absl::string_view line) {
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
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  TextCursor cursor(absl::StripPrefix(bytes, kByteOrderMark));
  std::vector<std::vector<double>> rows;
  bool first = true;
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const absl::string_view text = absl::StripAsciiWhitespace(*line);
    if (text.empty() || text.front() == '#') {
      continue;
    }
    std::vector<double> numbers = NumbersOf(text);
    const bool header = first && numbers.empty() && absl::ascii_isalpha(text.front());
    first = false;
    if (header) {
      continue;
    }
    if (numbers.size() < min_count || numbers.size() > max_count) {
      const std::string count = min_count == max_count ? absl::StrCat(min_count)
                                                       : absl::StrCat(min_count, " to ", max_count);
      return Annotate(cursor.Error(absl::StrCat(
                          "expected ", count, " numbers, found '", text.substr(0, 60), "'")),
                      path);
    }
    rows.push_back(std::move(numbers));
  }
  return rows;
}

}  // namespace strata::cli

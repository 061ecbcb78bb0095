#include "client/formats/motion/csv_columns.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "client/formats/file_bytes.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

std::vector<absl::string_view> CellsOf(absl::string_view line) {
  std::vector<absl::string_view> cells = absl::StrSplit(line, ',');
  for (absl::string_view& cell : cells) cell = absl::StripAsciiWhitespace(cell);
  return cells;
}

bool SaysNothing(absl::string_view line) {
  const absl::string_view text = absl::StripAsciiWhitespace(line);
  return text.empty() || absl::StartsWith(text, "#");
}

std::optional<absl::string_view> NextRow(TextCursor& cursor) {
  std::optional<absl::string_view> line = cursor.NextLine();
  while (line.has_value() && SaysNothing(*line)) line = cursor.NextLine();
  return line;
}

// Where each of `columns` stands.
absl::StatusOr<std::vector<std::size_t>> PlacesOf(const std::vector<absl::string_view>& header,
                                                  const std::vector<absl::string_view>& columns) {
  std::vector<std::size_t> places;
  for (const absl::string_view column : columns) {
    const auto found = std::find(header.begin(), header.end(), column);
    if (found == header.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("has no column '", column, "'; needed are ", absl::StrJoin(columns, ", ")));
    }
    places.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  return places;
}

absl::StatusOr<std::vector<double>> RowNumbers(const TextCursor& cursor,
                                               absl::string_view line,
                                               const std::vector<std::size_t>& places,
                                               const std::vector<absl::string_view>& columns) {
  const std::vector<absl::string_view> cells = CellsOf(line);
  std::vector<double> numbers;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const absl::string_view cell = places[i] < cells.size() ? cells[places[i]] : "";
    const std::optional<double> number = ParseNumber(cell);
    if (!number.has_value() || !std::isfinite(*number)) {
      return cursor.Error(absl::StrCat("expected a number as ", columns[i], ", got '", cell, "'"));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

absl::StatusOr<std::vector<std::vector<double>>> ParseColumns(
    absl::string_view text, const std::vector<absl::string_view>& columns) {
  TextCursor cursor(text);
  const std::optional<absl::string_view> header = NextRow(cursor);
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::size_t> places,
                          PlacesOf(CellsOf(header.value_or("")), columns));
  std::vector<std::vector<double>> rows;
  while (const std::optional<absl::string_view> line = NextRow(cursor)) {
    absl::StatusOr<std::vector<double>> numbers = RowNumbers(cursor, *line, places, columns);
    // A robot that lost its power was writing its last line.
    const bool is_cut = line->data() + line->size() == text.data() + text.size();
    if (!numbers.ok() && is_cut && !rows.empty()) break;
    STRATA_RETURN_IF_ERROR(numbers.status());
    rows.push_back(*std::move(numbers));
  }
  return rows;
}

}  // namespace

std::vector<std::string> CsvHeader(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && SaysNothing(line)) {
  }
  if (SaysNothing(line)) return {};
  const std::vector<absl::string_view> cells = CellsOf(line);
  return {cells.begin(), cells.end()};
}

bool HasColumns(const std::vector<std::string>& header,
                const std::vector<absl::string_view>& columns) {
  return std::all_of(columns.begin(), columns.end(), [&](absl::string_view column) {
    return std::find(header.begin(), header.end(), column) != header.end();
  });
}

absl::StatusOr<std::vector<std::vector<double>>> ReadCsvColumns(
    const std::filesystem::path& path, const std::vector<absl::string_view>& columns) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  absl::StatusOr<std::vector<std::vector<double>>> rows = ParseColumns(bytes, columns);
  if (!rows.ok()) return Annotate(rows.status(), path.string());
  return rows;
}

}  // namespace strata

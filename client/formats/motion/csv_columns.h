// Columns of a CSV file by the names in its first line.
#ifndef STRATA_CLIENT_FORMATS_MOTION_CSV_COLUMNS_H_
#define STRATA_CLIENT_FORMATS_MOTION_CSV_COLUMNS_H_

#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// The names in the first line; empty if the file cannot be read or is empty.
std::vector<std::string> CsvHeader(const std::filesystem::path& path);

bool HasColumns(const std::vector<std::string>& header,
                const std::vector<absl::string_view>& columns);

// A row a line, its numbers in the order of `columns`; other columns may hold anything. Comment
// lines ('#') and empty ones are left out. As ReadFileBytes(); INVALID_ARGUMENT naming the file and
// the missing column, or the line and what stands there in place of a finite number.
absl::StatusOr<std::vector<std::vector<double>>> ReadCsvColumns(
    const std::filesystem::path& path, const std::vector<absl::string_view>& columns);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_CSV_COLUMNS_H_

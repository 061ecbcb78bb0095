// Text files with some numbers on each line.
#ifndef STRATA_CLIENT_CLI_TERMINAL_NUMBER_FILE_H_
#define STRATA_CLIENT_CLI_TERMINAL_NUMBER_FILE_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace strata::cli {

// Lines of `min_count` to `max_count` finite numbers separated by commas, semicolons or blanks.
// Empty lines, lines that start with '#' and a first line of words (a header) are left out.
// As ReadFileBytes for a file that cannot be read; INVALID_ARGUMENT naming file and line.
absl::StatusOr<std::vector<std::vector<double>>> ReadNumberFile(const std::string& path,
                                                                std::size_t min_count,
                                                                std::size_t max_count);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_TERMINAL_NUMBER_FILE_H_

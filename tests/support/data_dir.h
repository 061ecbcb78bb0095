// Where the recorded data lie that tests, benchmarks and experiments read.
#ifndef STRATA_TESTS_SUPPORT_DATA_DIR_H_
#define STRATA_TESTS_SUPPORT_DATA_DIR_H_

#include <filesystem>
#include <optional>
#include <string>

namespace strata::testing {

// `folder` under $STRATA_DATA (default: ../shared/data beside the source tree); nullopt where it is
// absent.
std::optional<std::filesystem::path> FindData(const std::string& folder);

}  // namespace strata::testing

// Skips the test with a clear message where the data folder is absent; otherwise declares
// `variable`, its place.
#define STRATA_REQUIRE_DATA(variable, folder)                                              \
  const auto variable##_found = ::strata::testing::FindData(folder);                       \
  if (!variable##_found.has_value()) {                                                     \
    GTEST_SKIP() << "no recorded data: set STRATA_DATA to a folder that holds " << folder; \
  }                                                                                        \
  const std::filesystem::path& variable = *variable##_found

#endif  // STRATA_TESTS_SUPPORT_DATA_DIR_H_

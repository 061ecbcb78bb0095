// The program as its users have it, on a database in a temporary directory.
#ifndef STRATA_TESTS_CLIENT_CLI_STRATA_FIXTURE_H_
#define STRATA_TESTS_CLIENT_CLI_STRATA_FIXTURE_H_

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {

class StrataTest : public ::testing::Test {
 protected:
  using json = nlohmann::json;

  // `arguments` on the embedded database with JSON output.
  Ran Run(std::vector<std::string> arguments) const;
  json RunOk(const std::vector<std::string>& arguments) const;
  std::string Write(const std::string& name, const std::string& bytes) const;
  static std::string Contents(const std::string& file);
  // A drive over a floor between walls as scans/scan0.pcd … and poses.txt (index-tum, exact).
  void WriteDrive(int scans);
  json Import(const std::vector<std::string>& more = {}) const;

  testing::TempDir dir_;
  std::string database_ = (dir_.path() / "db").string();
  std::string scans_;
  std::string poses_;
};

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_STRATA_FIXTURE_H_

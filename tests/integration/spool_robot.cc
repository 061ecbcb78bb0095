// A robot that is killed now and then: SPOOL SERVER FIRST LAST POINTS.
// Adds the numbered scans FIRST to LAST to its spool and says so, line by line, while it sends.
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "absl/time/clock.h"

#include "client/sdk/client.h"
#include "client/sdk/spool.h"
#include "core/common/status.h"
#include "tests/integration/numbered_scans.h"

namespace strata::testing {
namespace {

absl::Status Run(char** arguments) {
  STRATA_ASSIGN_OR_RETURN(const auto spool, Spool::Open(arguments[1]));
  ClientOptions options;
  options.target = arguments[2];
  STRATA_ASSIGN_OR_RETURN(const auto database, Connect(options));
  const SpoolSender sender(*spool, *database);
  const std::uint64_t last = std::strtoull(arguments[4], nullptr, 10);
  for (std::uint64_t i = std::strtoull(arguments[3], nullptr, 10); i <= last; ++i) {
    const PointCloud cloud = NumberedCloud(i, std::strtoull(arguments[5], nullptr, 10));
    STRATA_RETURN_IF_ERROR(spool->Add("world", NumberedHeader(i, cloud), cloud));
    std::cout << i << std::endl;
  }
  while (spool->status().waiting > 0) absl::SleepFor(absl::Milliseconds(5));
  return absl::OkStatus();
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  if (argc != 6) return 2;
  const absl::Status done = strata::testing::Run(argv);
  if (!done.ok()) std::cerr << done << std::endl;
  return done.ok() ? 0 : 1;
}

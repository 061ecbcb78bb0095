// The conformance suite against the engine in the process.
#include "tests/support/database_suite/database_suite.h"

#include <utility>

#include "core/engine/engine.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

std::unique_ptr<api::Database> Open(const std::filesystem::path& directory) {
  EngineOptions options;
  options.directory = directory;
  auto engine = OpenEngine(options);
  EXPECT_THAT(engine, IsOk());
  return engine.ok() ? *std::move(engine) : nullptr;
}

INSTANTIATE_TEST_SUITE_P(Engine,
                         DatabaseSuite,
                         ::testing::Values(DatabaseMaker{"InProcess", Open}),
                         DatabaseMakerName);

}  // namespace
}  // namespace strata::testing

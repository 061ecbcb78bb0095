// The conformance suite against the engine in the process; with STRATA_STORE=postgresql its maps
// are in a database.
#include "tests/support/database_suite/database_suite.h"

#include <cstdlib>
#include <utility>

#include "absl/strings/string_view.h"

#include "core/engine/engine.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

std::unique_ptr<api::Database> Open(const std::filesystem::path& directory) {
  EngineOptions options;
  options.directory = directory;
  if (const char* store = std::getenv("STRATA_STORE"); store != nullptr && *store != '\0') {
    EXPECT_EQ(absl::string_view(store), "postgresql") << "STRATA_STORE";
    const auto cluster = SharedPostgresCluster();
    EXPECT_THAT(cluster, IsOk());
    if (!cluster.ok()) return nullptr;
    options.store = (*cluster)->AddressOfOwn(directory.string());
    EXPECT_FALSE(options.store.empty());
  }
  auto engine = OpenEngine(options);
  EXPECT_THAT(engine, IsOk());
  return engine.ok() ? *std::move(engine) : nullptr;
}

// Where there is no PostgreSQL 15 to run.
class NeedsStore : public ::testing::Environment {
 public:
  void SetUp() override {
    const char* store = std::getenv("STRATA_STORE");
    if (store == nullptr || *store == '\0') return;
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
  }
};
const auto* const kNeedsStore = ::testing::AddGlobalTestEnvironment(new NeedsStore());

INSTANTIATE_TEST_SUITE_P(Engine,
                         DatabaseSuite,
                         ::testing::Values(DatabaseMaker{"InProcess", Open}),
                         DatabaseMakerName);

}  // namespace
}  // namespace strata::testing

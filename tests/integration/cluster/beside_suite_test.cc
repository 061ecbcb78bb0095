// The conformance suite by a server that takes no maps, beside one on the same database that does
// and runs no jobs of workers, which nobody asks for anything; and by that one.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/engine/engine.h"
#include "server/server.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

// An engine behind a server.
struct Served {
  Served(const std::filesystem::path& directory,
         const std::string& store,
         const std::string& name,
         bool integrates,
         bool works) {
    EngineOptions engine_options;
    engine_options.directory = directory;
    engine_options.store = store;
    engine_options.server_name = name;
    engine_options.integrates = integrates;
    engine_options.works = works;
    // Every upload waits for the owner's next look at what came in beside it.
    engine_options.look_interval = absl::Milliseconds(20);
    auto opened = OpenEngine(engine_options);
    EXPECT_THAT(opened, IsOk());
    if (!opened.ok()) return;
    engine = *std::move(opened);
    server::ServerOptions server_options;
    server_options.listen = "127.0.0.1:0";
    auto started = server::Server::Start(*engine, server_options);
    EXPECT_THAT(started, IsOk());
    if (started.ok()) server = *std::move(started);
  }

  std::unique_ptr<api::Database> engine;
  std::unique_ptr<server::Server> server;
};

class DatabaseBesideItsOwner final : public api::Database {
 public:
  DatabaseBesideItsOwner(const std::filesystem::path& directory, bool ask_owner) {
    const auto cluster = SharedPostgresCluster();
    EXPECT_THAT(cluster, IsOk());
    const std::string store = (*cluster)->AddressOfOwn(directory.string());
    // Whose name is no address: its client is sent nowhere.
    owner_.emplace(directory / "owner", store, "owner", /*integrates=*/true, /*works=*/false);
    other_.emplace(directory / "other", store, "", /*integrates=*/false, /*works=*/true);
    ClientOptions options;
    options.target = (ask_owner ? *owner_ : *other_).server->address();
    auto client = Connect(options);
    EXPECT_THAT(client, IsOk());
    client_ = *std::move(client);
  }

  api::Maps& maps() override { return client_->maps(); }
  api::Scans& scans() override { return client_->scans(); }
  api::Tiles& tiles() override { return client_->tiles(); }
  api::Planning& planning() override { return client_->planning(); }
  api::Jobs& jobs() override { return client_->jobs(); }
  api::PoseGraph& posegraph() override { return client_->posegraph(); }
  api::Classifiers& classifiers() override { return client_->classifiers(); }
  api::Models& models() override { return client_->models(); }
  api::Objects& objects() override { return client_->objects(); }

 private:
  // In the order they need each other.
  std::optional<Served> owner_;
  std::optional<Served> other_;
  std::unique_ptr<api::Database> client_;
};

// Where there is no PostgreSQL 15 to run.
class NeedsStore : public ::testing::Environment {
 public:
  void SetUp() override {
    const auto cluster = SharedPostgresCluster();
    if (absl::IsFailedPrecondition(cluster.status())) GTEST_SKIP() << cluster.status().message();
  }
};
const auto* const kNeedsStore = ::testing::AddGlobalTestEnvironment(new NeedsStore());

// While the engine looks at all maps as often as it can.
TEST(BesideTheOwnerTest, AMapThatWasJustAskedForIsListed) {
  const TempDir directory;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto cluster, SharedPostgresCluster());
  const auto open = [&](const char* name) {
    EngineOptions options;
    options.directory = directory.path() / name;
    options.store = cluster->AddressOfOwn(directory.path().string());
    options.server_name = name;
    options.look_interval = absl::Microseconds(1);
    return OpenEngine(options);
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto owner, open("owner"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto other, open("other"));
  for (std::size_t k = 1; k <= 40; ++k) {
    const std::string name = absl::StrCat("map", k);
    STRATA_ASSERT_OK(owner->maps().Create({}, name, {}));
    STRATA_ASSERT_OK(other->maps().Get({}, name));
    STRATA_ASSERT_OK_AND_ASSIGN(const auto maps, other->maps().List({}));
    EXPECT_EQ(maps.size(), k);
  }
}

INSTANTIATE_TEST_SUITE_P(BesideTheOwner,
                         DatabaseSuite,
                         ::testing::Values(DatabaseMaker{
                             "Beside",
                             [](const auto& path) {
                               return std::make_unique<DatabaseBesideItsOwner>(path, false);
                             }}),
                         DatabaseMakerName);

// Whose jobs a worker runs.
INSTANTIATE_TEST_SUITE_P(TheOwner,
                         DatabaseSuite,
                         ::testing::Values(DatabaseMaker{
                             "Worked",
                             [](const auto& path) {
                               return std::make_unique<DatabaseBesideItsOwner>(path, true);
                             }}),
                         DatabaseMakerName);

}  // namespace
}  // namespace strata::testing

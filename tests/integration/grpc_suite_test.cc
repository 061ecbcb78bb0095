// The conformance suite over gRPC: an engine behind a server in this process, and a client.
#include <utility>

#include "client/sdk/client.h"
#include "core/engine/engine.h"
#include "server/server.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class ServedDatabase final : public api::Database {
 public:
  explicit ServedDatabase(const std::filesystem::path& directory) {
    EngineOptions engine_options;
    engine_options.directory = directory;
    auto engine = OpenEngine(engine_options);
    EXPECT_THAT(engine, IsOk());
    engine_ = *std::move(engine);
    server::ServerOptions server_options;
    server_options.listen = "127.0.0.1:0";
    auto server = server::Server::Start(*engine_, server_options);
    EXPECT_THAT(server, IsOk());
    server_ = *std::move(server);
    ClientOptions client_options;
    client_options.target = server_->address();
    auto client = Connect(client_options);
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
  std::unique_ptr<api::Database> engine_;
  std::unique_ptr<server::Server> server_;
  std::unique_ptr<api::Database> client_;
};

INSTANTIATE_TEST_SUITE_P(
    OverGrpc,
    DatabaseSuite,
    ::testing::Values(DatabaseMaker{
        "Served", [](const auto& path) { return std::make_unique<ServedDatabase>(path); }}),
    DatabaseMakerName);

}  // namespace
}  // namespace strata::testing

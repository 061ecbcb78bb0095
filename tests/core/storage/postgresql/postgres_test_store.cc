// A map in a database of a server of the program's own, for the contract suite.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "tests/core/storage/contract/test_store.h"
#include "tests/support/postgres_cluster.h"

namespace strata::testing {
namespace {

class PostgresTestStore final : public TestStore {
 public:
  PostgresTestStore(std::string where, PostgresMaps maps, std::string name)
      : where_(std::move(where)), maps_(std::move(maps)), name_(std::move(name)) {}

  absl::Status Create(const MapParameters& parameters,
                      absl::Time created,
                      std::uint64_t clock) override {
    return maps_.Create(name_, parameters, created, clock);
  }
  absl::StatusOr<std::unique_ptr<MapStorage>> Open() override { return maps_.Open(name_); }
  absl::StatusOr<std::unique_ptr<MapStorage>> Import(const std::filesystem::path& file) override {
    const std::string imported = absl::StrCat(name_, " imported");
    STRATA_RETURN_IF_ERROR(maps_.Import(imported, file, Stop()));
    return maps_.Open(imported);
  }
  absl::Status TakeAway() override { return maps_.Delete(name_); }
  absl::Status DamagePoses(absl::string_view bytes) override {
    return Update(
        "UPDATE truth_pose SET pose = $1 WHERE map = (SELECT map FROM map_place WHERE name = $2)",
        bytes);
  }
  absl::Status DamageHeaders(absl::string_view bytes) override {
    return Update(
        "UPDATE truth_scan SET header = $1 WHERE map = (SELECT map FROM map_place WHERE name = $2)",
        bytes);
  }

 private:
  absl::Status Update(const char* sql, absl::string_view bytes) const {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connection::Open(where_));
    return connection->Change(sql, Bytea{bytes}, name_).status();
  }

  std::string where_;
  PostgresMaps maps_;
  std::string name_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<TestStore>> MakeTestStore(const std::filesystem::path&) {
  static std::atomic<int> last = 0;
  STRATA_ASSIGN_OR_RETURN(PostgresCluster* const cluster, SharedPostgresCluster());
  STRATA_ASSIGN_OR_RETURN(PostgresMaps maps,
                          PostgresMaps::Connect(PostgresOptions{.where = cluster->Address()}));
  return std::make_unique<PostgresTestStore>(
      cluster->Address(), std::move(maps), absl::StrCat("it's map ", ++last));
}

}  // namespace strata::testing

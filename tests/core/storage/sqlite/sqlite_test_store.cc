// A map in a file, for the contract suite.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/map_file.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "tests/core/storage/contract/test_store.h"

namespace strata::testing {
namespace {

class SqliteTestStore final : public TestStore {
 public:
  explicit SqliteTestStore(std::filesystem::path file) : file_(std::move(file)) {}

  absl::Status Create(const MapParameters& parameters,
                      absl::Time created,
                      std::uint64_t clock) override {
    return CreateSqliteMap(file_, parameters, created, clock);
  }
  absl::StatusOr<std::unique_ptr<MapStorage>> Open() override {
    return OpenSqliteStorage(file_, {});
  }
  absl::StatusOr<std::unique_ptr<MapStorage>> Import(const std::filesystem::path& file) override {
    std::filesystem::path imported = file_;
    imported += ".imported";
    STRATA_RETURN_IF_ERROR(CopySqliteMap(file, imported, 0, Stop()));
    return OpenSqliteStorage(imported, {});
  }
  absl::Status TakeAway() override {
    std::filesystem::remove(file_);
    return absl::OkStatus();
  }
  absl::Status DamagePoses(absl::string_view bytes) override {
    return Update("UPDATE truth_pose SET pose = ?1", bytes);
  }
  absl::Status DamageHeaders(absl::string_view bytes) override {
    return Update("UPDATE truth_scan SET header = ?1", bytes);
  }

 private:
  absl::Status Update(const char* sql, absl::string_view bytes) const {
    STRATA_ASSIGN_OR_RETURN(Database database, Database::Open(file_, Database::Mode::kWrite));
    STRATA_ASSIGN_OR_RETURN(Statement statement, database.Prepare(sql));
    return statement.Bind(Blob{bytes}).Run();
  }

  std::filesystem::path file_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<TestStore>> MakeTestStore(const std::filesystem::path& directory) {
  return std::make_unique<SqliteTestStore>(directory / "map.strata");
}

}  // namespace strata::testing

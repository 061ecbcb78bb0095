// The maps of one PostgreSQL database (core/storage/FORMAT.md).
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

struct PostgresOptions {
  // "postgresql://USER@HOST/DATABASE", or any other that libpq takes; its tables are made where
  // they lack, in the first schema of the search path.
  std::string where;
  std::size_t max_connections = 32;
};

// What a map's rows say of it, whether somebody has it open or not.
struct MapAtRest {
  MapInfo info;  // with its name
  std::uint64_t clock = 0;
  // Scans or jobs wait, or what is derived is incomplete or of another format.
  bool has_work = false;
};

// Thread-safe.
class PostgresMaps {
 public:
  // Carries out deletions that were cut short, too. The errors of Connection::Open();
  // FAILED_PRECONDITION for tables of another format.
  static absl::StatusOr<PostgresMaps> Connect(const PostgresOptions& options);

  // Sorted.
  absl::StatusOr<std::vector<std::string>> List() const;
  // All maps, a thousand a query, in no order; an error of one of them is of its rows. CANCELLED,
  // DEADLINE_EXCEEDED by `stop`.
  absl::Status Survey(
      const Stop& stop,
      absl::FunctionRef<void(absl::StatusOr<MapAtRest> map, const std::string& name)> tell) const;
  // All or nothing, its clock at `clock`. ALREADY_EXISTS.
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created,
                      std::uint64_t clock = 0) const;
  // NOT_FOUND; DATA_LOSS if the map's own row is damaged. Outlives this object. Others may have the
  // map open, too, and write it between two commits.
  absl::StatusOr<std::unique_ptr<MapStorage>> Open(absl::string_view name) const;
  // The same, alone: whoever had opened it so before can not write any more (UNAVAILABLE), since
  // every commit asks.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenAlone(absl::string_view name) const;
  // The latest clock of a map that was deleted; 0: none was.
  absl::StatusOr<std::uint64_t> RemovedClock() const;
  // Whoever has it open can neither read nor write it any more. Its rows go after its name, so that
  // what is left when this ends with an error is deleted by the next Connect(). NOT_FOUND.
  absl::Status Delete(absl::string_view name) const;

 private:
  explicit PostgresMaps(std::shared_ptr<ConnectionPool> pool) : pool_(std::move(pool)) {}
  // The thousand rows behind the map with the number `last`.
  absl::StatusOr<Rows> SurveyAfter(std::int64_t last) const;
  absl::StatusOr<std::int64_t> Find(absl::string_view name) const;
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenAs(absl::string_view name,
                                                     std::int64_t owner) const;
  absl::Status TakeOver(OpenedMap& map) const;
  absl::Status DeleteRows(std::int64_t map) const;

  std::shared_ptr<ConnectionPool> pool_;
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_

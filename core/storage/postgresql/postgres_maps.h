// The maps of one PostgreSQL database (core/storage/FORMAT.md).
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

struct PostgresOptions {
  // "postgresql://USER@HOST/DATABASE", or any other that libpq takes; its tables are made where
  // they lack, in the first schema of the search path.
  std::string where;
  std::size_t max_connections = 32;
};

// Thread-safe. Every map may be open once in all processes together: nothing here keeps a second
// one out (docs/decisions/0196).
class PostgresMaps {
 public:
  // Carries out deletions that were cut short, too. The errors of Connection::Open();
  // FAILED_PRECONDITION for tables of another format.
  static absl::StatusOr<PostgresMaps> Connect(const PostgresOptions& options);

  // Sorted.
  absl::StatusOr<std::vector<std::string>> List() const;
  // All or nothing, its clock at `clock`. ALREADY_EXISTS.
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created,
                      std::uint64_t clock = 0) const;
  // NOT_FOUND; DATA_LOSS if the map's own row is damaged. Outlives this object.
  absl::StatusOr<std::unique_ptr<MapStorage>> Open(absl::string_view name) const;
  // Whoever has it open can neither read nor write it any more. Its rows go after its name, so that
  // what is left when this ends with an error is deleted by the next Connect(). NOT_FOUND.
  absl::Status Delete(absl::string_view name) const;

 private:
  explicit PostgresMaps(std::shared_ptr<ConnectionPool> pool) : pool_(std::move(pool)) {}
  absl::StatusOr<std::int64_t> Find(absl::string_view name) const;
  absl::Status DeleteRows(std::int64_t map) const;

  std::shared_ptr<ConnectionPool> pool_;
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_

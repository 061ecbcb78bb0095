// What changed in a map, for those who watch it at a server that has not got it: written by the one
// that has, with what it publishes.
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/postgresql/postgres_writer.h"

namespace strata {
namespace {

// Of one commit. Where there are more it is as if everything had changed, which is sooner read.
constexpr std::size_t kMostChanges = 1 << 16;
// What is old is looked for once in so many commits that change something.
constexpr unsigned kTrimEvery = 64;

}  // namespace

absl::StatusOr<StoredChanges> PostgresReader::ListChanges(std::uint64_t since) {
  StoredChanges all;
  STRATA_RETURN_IF_ERROR(OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows kept,
        Ask("SELECT 1 FROM derived_state WHERE map = $1 AND changes_after <= $2", since));
    all.complete = kept.Next();
    if (!all.complete) return absl::OkStatus();
    STRATA_ASSIGN_OR_RETURN(
        Rows row,
        Ask("SELECT at, trajectory, sequence, x, y, version, gone, inferred FROM (SELECT at, n, "
            "trajectory, sequence, x, y, version, gone, inferred FROM map_change WHERE map = $1 "
            "AND at > $2 UNION ALL "
            "SELECT number, 0, trajectory, sequence, 0, 0, 0, 0, 0 FROM truth_scan WHERE map = $1 "
            "AND "
            "number > $2) AS c ORDER BY at, n",
            since));
    all.changes.reserve(static_cast<std::size_t>(row.size()));
    while (row.Next()) {
      StoredChange& change = all.changes.emplace_back();
      change.commit_sequence = row.Unsigned(0);
      change.scan = {row.Text(1), row.Unsigned(2)};
      change.tile = {
          0, static_cast<std::int32_t>(row.Int(3)), static_cast<std::int32_t>(row.Int(4))};
      change.version = row.Unsigned(5);
      change.gone = row.Bool(6);
      change.inferred = row.Bool(7);
    }
    return absl::OkStatus();
  }));
  return all;
}

// Names of trajectories have no line ends.
absl::Status PostgresWriter::PutChanges(const std::vector<StoredChange>& changes) {
  if (changes.empty()) return absl::OkStatus();
  const std::uint64_t at = changes.back().commit_sequence;
  if (changes.size() > kMostChanges) return ForgetChanges(at);
  std::string trajectories;
  std::vector<std::int64_t> sequences, x, y, versions, gone, inferred;
  for (const StoredChange& change : changes) {
    absl::StrAppend(&trajectories, change.scan.trajectory, "\n");
    sequences.push_back(static_cast<std::int64_t>(change.scan.sequence));
    x.push_back(change.tile.x);
    y.push_back(change.tile.y);
    versions.push_back(static_cast<std::int64_t>(change.version));
    gone.push_back(change.gone ? 1 : 0);
    inferred.push_back(change.inferred ? 1 : 0);
  }
  trajectories.pop_back();
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO map_change (map, at, n, trajectory, sequence, x, y, version, gone, "
             "inferred) SELECT $1, $2, c.n, coalesce(c.trajectory, ''), c.sequence, c.x, c.y, "
             "c.version, c.gone, c.inferred FROM unnest(string_to_array($3, E'\\n'), $4, $5, $6, "
             "$7, $8, $9) WITH ORDINALITY AS c (trajectory, sequence, x, y, version, gone, "
             "inferred, n)",
             at,
             trajectories,
             sequences,
             x,
             y,
             versions,
             gone,
             inferred));
  return ++puts_of_changes_ % kTrimEvery == 0 ? TrimChanges() : absl::OkStatus();
}

absl::Status PostgresWriter::ForgetChanges(std::uint64_t commit_sequence) {
  STRATA_RETURN_IF_ERROR(RunSql("DELETE FROM map_change WHERE map = $1"));
  return RunSql("UPDATE derived_state SET changes_after = $2 WHERE map = $1", commit_sequence);
}

absl::Status PostgresWriter::TrimChanges() {
  return RunSql(
      "WITH old AS (DELETE FROM map_change WHERE map = $1 AND at <= (SELECT max(at) FROM "
      "map_change WHERE map = $1 AND made < clock_timestamp() - interval '1 hour') RETURNING at) "
      "UPDATE derived_state SET changes_after = greatest(changes_after, (SELECT max(at) FROM old)) "
      "WHERE map = $1 AND EXISTS (SELECT FROM old)");
}

}  // namespace strata

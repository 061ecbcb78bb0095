#include "core/engine/doors/map_numbers.h"

#include "absl/time/time.h"

#include "core/common/steady_time.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

absl::Duration PendingAge(Map& map, StorageReader& reader) {
  ScanQuery query;
  query.state = ScanState::kPending;
  query.skip_damaged = true;  // it waits for ever, and verify names it
  query.limit = 1;
  const auto oldest = reader.ListScans(query, map.core().snapshots().current().epoch);
  if (!oldest.ok() || oldest->empty()) return absl::ZeroDuration();
  return SteadyNow() - map.worker().WaitingSince(oldest->front().scan.number);
}

}  // namespace

MapNumbers NumbersOfMap(Map& map, const std::filesystem::path& file) {
  MapNumbers numbers;
  numbers.map = map.core().name();
  AddFileBytes(file, numbers);
  const WriterNumbers writer = map.core().writer().numbers();
  numbers.commits = writer.commits;
  numbers.commit_parts = writer.parts;
  numbers.commit_time = writer.time;
  numbers.queued_bytes = writer.queued_bytes;
  AddJobs(map.jobs().List(), numbers);
  const auto reader = map.core().Reader();
  if (!reader.ok()) return numbers;
  AddContents(**reader, map.core().snapshots().current().tile_version, numbers).IgnoreError();
  if (numbers.scans_pending > 0) numbers.pending_age = PendingAge(map, **reader);
  return numbers;
}

void AddCounts(const MapNumbers& before, MapNumbers& numbers) {
  numbers.commits += before.commits;
  numbers.commit_parts += before.commit_parts;
  numbers.commit_time += before.commit_time;
}

}  // namespace strata

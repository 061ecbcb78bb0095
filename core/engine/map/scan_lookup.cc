#include "core/engine/map/scan_lookup.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {

absl::Status ForEachScan(StorageReader& reader,
                         ScanQuery query,
                         std::uint64_t epoch,
                         absl::FunctionRef<void(PosedScan)> body) {
  for (bool more = true; more;) {
    STRATA_ASSIGN_OR_RETURN(std::vector<PosedScan> page, reader.ListScans(query, epoch));
    more = page.size() == query.limit;
    if (!page.empty()) query.after = page.back().scan.number;
    for (PosedScan& posed : page) body(std::move(posed));
  }
  return absl::OkStatus();
}

absl::Status ForEachPosedScan(StorageReader& reader,
                              const ScanQuery& query,
                              std::uint64_t epoch,
                              absl::FunctionRef<void(PosedScan)> body) {
  return ForEachScan(reader, query, epoch, [&](PosedScan posed) {
    if (posed.pose.has_value()) body(std::move(posed));
  });
}

absl::StatusOr<bool> IsThere(StorageReader& reader, ScanNumber number, std::uint64_t epoch) {
  const absl::Status found = reader.GetScan(number, epoch).status();
  if (absl::IsNotFound(found)) return false;
  STRATA_RETURN_IF_ERROR(found);
  return true;
}

absl::StatusOr<PosedScan> GetScanById(StorageReader& reader,
                                      const ScanId& id,
                                      std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(std::optional<PosedScan> posed, reader.FindScan(id, epoch));
  if (posed.has_value()) return *std::move(posed);
  return absl::NotFoundError(absl::StrCat("scan ", id.ToString(), " does not exist"));
}

}  // namespace strata

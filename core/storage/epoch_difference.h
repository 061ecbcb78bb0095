// What StorageWriter::RestoreConstraints() has to change, worked out for every store.
#ifndef STRATA_CORE_STORAGE_EPOCH_DIFFERENCE_H_
#define STRATA_CORE_STORAGE_EPOCH_DIFFERENCE_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

#include "core/storage/records.h"
#include "core/storage/storage.h"

namespace strata {

// Each by id.
struct EpochDifference {
  std::vector<std::uint64_t> ended_constraints;  // of optimize jobs: in `now`, not in `then`
  std::vector<std::uint64_t> ended_planes;
  std::vector<ConstraintRecord> restored_constraints;  // in `then`, not in `now`
  std::vector<PlaneRecord> restored_planes;
};

absl::StatusOr<EpochDifference> DifferenceOfEpochs(StorageReader& reader,
                                                   std::uint64_t then,
                                                   std::uint64_t now);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_EPOCH_DIFFERENCE_H_

// A map's file as it is at one moment, while it goes on changing.
#ifndef STRATA_CORE_ENGINE_DOORS_BACKUP_H_
#define STRATA_CORE_ENGINE_DOORS_BACKUP_H_

#include <filesystem>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

#include "core/api/maps.h"
#include "core/common/stop.h"

namespace strata {

// As api::Maps::Backup. `copy` makes one in a file that is not there (StorageReader::CopyTo());
// `temporary` is where the copy lies until it is delivered, under no name as
// soon as it is whole; what a crash leaves of it, the next start of the directory removes.
absl::Status BackUp(absl::FunctionRef<absl::Status(const std::filesystem::path&)> copy,
                    const std::filesystem::path& temporary,
                    const Stop& stop,
                    absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_BACKUP_H_

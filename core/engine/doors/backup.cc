#include "core/engine/doors/backup.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"

#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;

absl::Status Deliver(std::ifstream& file,
                     std::uint64_t total_bytes,
                     const Stop& stop,
                     absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) {
  ContentHasher hasher;
  api::BackupPiece piece;
  piece.total_bytes = total_bytes;
  for (std::uint64_t left = total_bytes; left > 0; left -= piece.bytes.size()) {
    STRATA_RETURN_IF_ERROR(stop.status());
    piece.bytes.resize(static_cast<std::size_t>(std::min(left, kPieceBytes)));
    if (!file.read(piece.bytes.data(), static_cast<std::streamsize>(piece.bytes.size()))) {
      return absl::DataLossError("backup: the copy cannot be read back");
    }
    hasher.Add(piece.bytes);
    if (left == piece.bytes.size()) piece.content_hash = hasher.HexDigest();
    STRATA_RETURN_IF_ERROR(sink(piece));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status BackUp(absl::FunctionRef<absl::Status(const fs::path&)> copy,
                    const fs::path& temporary,
                    const Stop& stop,
                    absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) {
  std::error_code error;
  fs::remove(temporary, error);
  const absl::Status copied = copy(temporary);
  std::ifstream file;
  std::uintmax_t total_bytes = 0;
  if (copied.ok()) {
    total_bytes = fs::file_size(temporary, error);
    file.open(temporary, std::ios::binary);
  }
  std::error_code removed;
  fs::remove(temporary, removed);  // what is open stays readable
  STRATA_RETURN_IF_ERROR(copied);
  if (error || !file.is_open()) return absl::DataLossError("backup: the copy cannot be read back");
  return Deliver(file, total_bytes, stop, sink);
}

}  // namespace strata

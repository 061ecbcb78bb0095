#include "tests/support/faults/faulty_disk.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <system_error>

#include <sqlite3.h>

namespace strata::testing {
namespace {

using Kind = DiskOperation::Kind;

int CodeOf(DiskFault fault, Kind kind) {
  switch (fault) {
    case DiskFault::kFull:
      return SQLITE_FULL;
    case DiskFault::kWrite:
      return SQLITE_IOERR_WRITE;
    case DiskFault::kSync:
      return SQLITE_IOERR_FSYNC;
    case DiskFault::kRead:
      return SQLITE_IOERR_READ;
    case DiskFault::kOpen:
      return SQLITE_CANTOPEN;
    case DiskFault::kDelete:
      return SQLITE_IOERR_DELETE;
    case DiskFault::kTruncate:
      return SQLITE_IOERR_TRUNCATE;
    case DiskFault::kShm:
      return kind == Kind::kShmMap ? SQLITE_IOERR_SHMMAP : SQLITE_IOERR_SHMLOCK;
  }
  return SQLITE_IOERR;
}

bool Concerns(DiskFault fault, Kind kind) {
  switch (fault) {
    case DiskFault::kFull:
    case DiskFault::kWrite:
      return kind == Kind::kWrite;
    case DiskFault::kSync:
      return kind == Kind::kSync;
    case DiskFault::kRead:
      return kind == Kind::kRead;
    case DiskFault::kOpen:
      return kind == Kind::kOpen;
    case DiskFault::kDelete:
      return kind == Kind::kDelete;
    case DiskFault::kTruncate:
      return kind == Kind::kTruncate;
    case DiskFault::kShm:
      return kind == Kind::kShmMap || kind == Kind::kShmLock;
  }
  return false;
}

}  // namespace

FaultyDisk::FaultyDisk()
    : shim_([this](const DiskOperation& operation) { return Before(operation); }) {}

int FaultyDisk::Before(const DiskOperation& operation) {
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < kDiskFaults; ++i) {
    const auto fault = static_cast<DiskFault>(i);
    if (!Concerns(fault, operation.kind)) continue;
    ++operations_[static_cast<std::size_t>(i)];
    if (fault == fault_ && FailsNow()) return CodeOf(fault, operation.kind);
  }
  if (TakeRoom(operation)) return SQLITE_OK;
  ++failed_;
  return SQLITE_FULL;
}

bool FaultyDisk::FailsNow() {
  if (times_ <= 0) return false;
  if (left_-- > 0) return false;
  --times_;
  ++failed_;
  return true;
}

bool FaultyDisk::TakeRoom(const DiskOperation& operation) {
  std::int64_t growth = 0;
  if (operation.kind == Kind::kWrite) {
    growth = std::max<std::int64_t>(0, operation.offset + operation.count - operation.size);
  } else if (operation.kind == Kind::kTruncate) {
    growth = operation.offset - operation.size;
  } else if (operation.kind == Kind::kDelete) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(operation.file, error);
    if (!error) growth = -static_cast<std::int64_t>(size);
  }
  if (growth > room_) return false;
  room_ -= growth;
  grown_ += std::max<std::int64_t>(0, growth);
  return true;
}

void FaultyDisk::Fail(DiskFault fault, std::int64_t sound, std::int64_t times) {
  const std::lock_guard lock(mutex_);
  fault_ = fault;
  left_ = sound;
  times_ = times;
}

void FaultyDisk::LeaveRoom(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  room_ = bytes;
}

void FaultyDisk::Mend() {
  const std::lock_guard lock(mutex_);
  times_ = 0;
  room_ = INT64_MAX / 2;
}

std::int64_t FaultyDisk::failed() const {
  const std::lock_guard lock(mutex_);
  return failed_;
}

std::int64_t FaultyDisk::operations(DiskFault fault) const {
  const std::lock_guard lock(mutex_);
  return operations_[static_cast<std::size_t>(fault)];
}

std::int64_t FaultyDisk::grown() const {
  const std::lock_guard lock(mutex_);
  return grown_;
}

}  // namespace strata::testing

#include "tests/support/faulty_disk.h"

#include <atomic>
#include <cstdint>

#include <gtest/gtest.h>
#include <sqlite3.h>

namespace strata::testing {
namespace {

// What fails: the operations of one kind with numbers in [begin, end).
struct Plan {
  std::atomic<DiskFault> fault{DiskFault::kWrite};
  std::atomic<std::int64_t> left{0};   // sound operations before the first that fails
  std::atomic<std::int64_t> times{0};  // that fail then
  std::atomic<std::int64_t> failed{0};
} plan;

bool FailsNow(bool is_sync) {
  if (plan.times.load() <= 0 || (plan.fault.load() == DiskFault::kSync) != is_sync) return false;
  if (plan.left.fetch_sub(1) > 0) return false;
  if (plan.times.fetch_sub(1) <= 0) return false;
  plan.failed.fetch_add(1);
  return true;
}

// A file and, right behind it, the real one.
struct File {
  sqlite3_file base;
  sqlite3_file* real;
};

sqlite3_file* Real(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real; }

int Write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 offset) {
  if (FailsNow(false))
    return plan.fault.load() == DiskFault::kFull ? SQLITE_FULL : SQLITE_IOERR_WRITE;
  return Real(file)->pMethods->xWrite(Real(file), bytes, count, offset);
}
int Sync(sqlite3_file* file, int flags) {
  if (FailsNow(true)) return SQLITE_IOERR_FSYNC;
  return Real(file)->pMethods->xSync(Real(file), flags);
}

// The rest is handed on.
int Close(sqlite3_file* file) { return Real(file)->pMethods->xClose(Real(file)); }
int Read(sqlite3_file* file, void* bytes, int count, sqlite3_int64 offset) {
  return Real(file)->pMethods->xRead(Real(file), bytes, count, offset);
}
int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  return Real(file)->pMethods->xTruncate(Real(file), size);
}
int FileSize(sqlite3_file* file, sqlite3_int64* size) {
  return Real(file)->pMethods->xFileSize(Real(file), size);
}
int Lock(sqlite3_file* file, int lock) { return Real(file)->pMethods->xLock(Real(file), lock); }
int Unlock(sqlite3_file* file, int lock) { return Real(file)->pMethods->xUnlock(Real(file), lock); }
int CheckReservedLock(sqlite3_file* file, int* reserved) {
  return Real(file)->pMethods->xCheckReservedLock(Real(file), reserved);
}
int FileControl(sqlite3_file* file, int operation, void* argument) {
  return Real(file)->pMethods->xFileControl(Real(file), operation, argument);
}
int SectorSize(sqlite3_file* file) { return Real(file)->pMethods->xSectorSize(Real(file)); }
int DeviceCharacteristics(sqlite3_file* file) {
  return Real(file)->pMethods->xDeviceCharacteristics(Real(file));
}
int ShmMap(sqlite3_file* file, int region, int size, int extend, void volatile** memory) {
  return Real(file)->pMethods->xShmMap(Real(file), region, size, extend, memory);
}
int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
  return Real(file)->pMethods->xShmLock(Real(file), offset, count, flags);
}
void ShmBarrier(sqlite3_file* file) { Real(file)->pMethods->xShmBarrier(Real(file)); }
int ShmUnmap(sqlite3_file* file, int remove) {
  return Real(file)->pMethods->xShmUnmap(Real(file), remove);
}

constexpr sqlite3_io_methods kMethods = {2,  // without memory-mapped reads
                                         Close,
                                         Read,
                                         Write,
                                         Truncate,
                                         Sync,
                                         FileSize,
                                         Lock,
                                         Unlock,
                                         CheckReservedLock,
                                         FileControl,
                                         SectorSize,
                                         DeviceCharacteristics,
                                         ShmMap,
                                         ShmLock,
                                         ShmBarrier,
                                         ShmUnmap,
                                         nullptr,
                                         nullptr};

sqlite3_vfs* real_disk = nullptr;
sqlite3_vfs disk;

int Open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  auto* const opened = reinterpret_cast<File*>(file);
  opened->real = reinterpret_cast<sqlite3_file*>(opened + 1);
  opened->base.pMethods = nullptr;
  const int code = real_disk->xOpen(real_disk, name, opened->real, flags, flags_out);
  if (opened->real->pMethods != nullptr) opened->base.pMethods = &kMethods;
  return code;
}

}  // namespace

FaultyDisk::FaultyDisk() {
  Mend();
  plan.failed = 0;
  real_disk = sqlite3_vfs_find(nullptr);
  disk = *real_disk;
  disk.zName = "faulty";
  disk.pNext = nullptr;
  disk.szOsFile = real_disk->szOsFile + static_cast<int>(sizeof(File));
  disk.xOpen = Open;
  EXPECT_EQ(sqlite3_vfs_register(&disk, 1), SQLITE_OK);
}

FaultyDisk::~FaultyDisk() {
  sqlite3_vfs_unregister(&disk);
  sqlite3_vfs_register(real_disk, 1);
}

void FaultyDisk::Fail(DiskFault fault, std::int64_t sound, std::int64_t times) {
  plan.times = 0;
  plan.fault = fault;
  plan.left = sound;
  plan.times = times;
}

void FaultyDisk::Mend() { plan.times = 0; }

std::int64_t FaultyDisk::failed() const { return plan.failed; }

}  // namespace strata::testing

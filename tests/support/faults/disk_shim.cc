#include "tests/support/faults/disk_shim.h"

#include <cstdlib>
#include <string>
#include <utility>

#include <sqlite3.h>

namespace strata::testing {
namespace {

using Kind = DiskOperation::Kind;

DiskShim::Before before_hook;
DiskShim::After after_hook;

// A file and, right behind it, the real one. SQLite keeps the name as long as the file is open.
struct File {
  sqlite3_file base;
  const char* name;
  sqlite3_file* real;
};

sqlite3_file* Real(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real; }

std::string NameOf(const char* name) { return name == nullptr ? "" : name; }

std::int64_t SizeOf(sqlite3_file* file) {
  sqlite3_int64 size = 0;
  return Real(file)->pMethods->xFileSize(Real(file), &size) == SQLITE_OK ? size : 0;
}

template <typename Perform>
int Pass(const DiskOperation& operation, Perform perform) {
  if (const int code = before_hook(operation); code != SQLITE_OK) return code;
  const int code = perform();
  if (code == SQLITE_OK && after_hook) after_hook(operation);
  return code;
}

DiskOperation On(sqlite3_file* file, Kind kind) {
  return {.kind = kind, .file = NameOf(reinterpret_cast<File*>(file)->name)};
}

int Read(sqlite3_file* file, void* bytes, int count, sqlite3_int64 offset) {
  DiskOperation operation = On(file, Kind::kRead);
  operation.offset = offset;
  operation.count = count;
  return Pass(operation,
              [&] { return Real(file)->pMethods->xRead(Real(file), bytes, count, offset); });
}
int Write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 offset) {
  DiskOperation operation = On(file, Kind::kWrite);
  operation.offset = offset;
  operation.count = count;
  operation.size = SizeOf(file);
  return Pass(operation,
              [&] { return Real(file)->pMethods->xWrite(Real(file), bytes, count, offset); });
}
int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  DiskOperation operation = On(file, Kind::kTruncate);
  operation.offset = size;
  operation.size = SizeOf(file);
  return Pass(operation, [&] { return Real(file)->pMethods->xTruncate(Real(file), size); });
}
int Sync(sqlite3_file* file, int flags) {
  return Pass(On(file, Kind::kSync),
              [&] { return Real(file)->pMethods->xSync(Real(file), flags); });
}
int ShmMap(sqlite3_file* file, int region, int size, int extend, void volatile** memory) {
  return Pass(On(file, Kind::kShmMap), [&] {
    return Real(file)->pMethods->xShmMap(Real(file), region, size, extend, memory);
  });
}
int ShmLock(sqlite3_file* file, int offset, int count, int flags) {
  const auto perform = [&] {
    return Real(file)->pMethods->xShmLock(Real(file), offset, count, flags);
  };
  return (flags & SQLITE_SHM_LOCK) == 0 ? perform() : Pass(On(file, Kind::kShmLock), perform);
}

// The rest is handed on.
int Close(sqlite3_file* file) { return Real(file)->pMethods->xClose(Real(file)); }
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
  opened->name = name;
  opened->real = reinterpret_cast<sqlite3_file*>(opened + 1);
  opened->real->pMethods = nullptr;
  opened->base.pMethods = nullptr;
  const int code = Pass({.kind = Kind::kOpen, .file = NameOf(name)}, [&] {
    return real_disk->xOpen(real_disk, name, opened->real, flags, flags_out);
  });
  if (opened->real->pMethods != nullptr) opened->base.pMethods = &kMethods;
  return code;
}

int Delete(sqlite3_vfs*, const char* name, int sync_directory) {
  return Pass({.kind = Kind::kDelete, .file = NameOf(name)},
              [&] { return real_disk->xDelete(real_disk, name, sync_directory); });
}

}  // namespace

DiskShim::DiskShim(Before before, After after) {
  before_hook = std::move(before);
  after_hook = std::move(after);
  real_disk = sqlite3_vfs_find(nullptr);
  disk = *real_disk;
  disk.zName = "shim";
  disk.pNext = nullptr;
  disk.szOsFile = real_disk->szOsFile + static_cast<int>(sizeof(File));
  disk.xOpen = Open;
  disk.xDelete = Delete;
  if (sqlite3_vfs_register(&disk, 1) != SQLITE_OK) std::abort();
}

DiskShim::~DiskShim() {
  sqlite3_vfs_unregister(&disk);
  sqlite3_vfs_register(real_disk, 1);
}

}  // namespace strata::testing

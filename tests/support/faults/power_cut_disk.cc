#include "tests/support/faults/power_cut_disk.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <system_error>

#include <dlfcn.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

namespace strata::testing {
namespace {

namespace fs = std::filesystem;
using Kind = DiskOperation::Kind;

constexpr std::int64_t kPage = 4096;
constexpr std::size_t kSector = 512;

std::atomic<PowerCutDisk*> watching{nullptr};

std::string ReadAt(int fd, std::int64_t begin, std::int64_t count) {
  std::string bytes(static_cast<std::size_t>(count), '\0');
  const ssize_t got = ::pread(fd, bytes.data(), bytes.size(), begin);
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
}

std::int64_t SizeOf(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 ? status.st_size : 0;
}

// The page of `bytes` that begins at `begin`, filled up with zeros.
std::string PageOf(const std::string& bytes, std::int64_t begin) {
  std::string page;
  if (static_cast<std::size_t>(begin) < bytes.size()) {
    page = bytes.substr(static_cast<std::size_t>(begin), kPage);
  }
  page.resize(kPage, '\0');
  return page;
}

void PutPage(std::string& bytes, std::int64_t begin, const std::string& page) {
  const auto at = static_cast<std::size_t>(begin);
  if (at >= bytes.size()) return;
  const std::size_t count = std::min(page.size(), bytes.size() - at);
  bytes.replace(at, count, page, 0, count);
}

}  // namespace

PowerCutDisk::PowerCutDisk(const fs::path& directory) : directory_(directory) {
  durable_names_ = ListNames();
  shim_ = std::make_unique<DiskShim>([this](const DiskOperation& done) { return Before(done); },
                                     [this](const DiskOperation& done) { After(done); });
  watching = this;
}

PowerCutDisk::~PowerCutDisk() {
  watching = nullptr;
  shim_.reset();
  for (const auto& [inode, file] : files_) ::close(file.fd);
}

void PowerCutDisk::CutAfter(std::int64_t sound, std::uint64_t seed, const fs::path& survivors) {
  const std::lock_guard lock(mutex_);
  left_ = sound;
  random_.seed(seed);
  survivors_ = survivors;
}

bool PowerCutDisk::is_cut() const {
  const std::lock_guard lock(mutex_);
  return cut_;
}

std::int64_t PowerCutDisk::operations() const {
  const std::lock_guard lock(mutex_);
  return operations_;
}

void PowerCutDisk::IgnoreSyncs() {
  const std::lock_guard lock(mutex_);
  ignore_syncs_ = true;
}

bool PowerCutDisk::Count() {
  if (cut_) return false;
  ++operations_;
  if (left_-- > 0) return true;
  cut_ = true;
  WriteSurvivors();
  return false;
}

int PowerCutDisk::Before(const DiskOperation& operation) {
  const std::lock_guard lock(mutex_);
  switch (operation.kind) {
    case Kind::kRead:
    case Kind::kShmMap:
    case Kind::kShmLock:
      return cut_ ? SQLITE_IOERR : SQLITE_OK;
    default:
      return Count() ? SQLITE_OK : SQLITE_IOERR;
  }
}

void PowerCutDisk::After(const DiskOperation& operation) {
  const std::lock_guard lock(mutex_);
  if (cut_) return;
  File* const file = Find(operation.file, operation.kind == Kind::kOpen);
  if (file == nullptr) return;
  if (operation.kind == Kind::kWrite) {
    NotePages(*file, operation.offset, operation.offset + operation.count);
  } else if (operation.kind == Kind::kTruncate) {
    NotePages(*file, operation.offset, operation.size);
  } else if (operation.kind == Kind::kSync && !ignore_syncs_) {
    MakeDurable(*file);
  }
}

bool PowerCutDisk::SyncDescriptor(int fd) {
  struct stat synced {};
  struct stat own {};
  if (::fstat(fd, &synced) != 0 || ::stat(directory_.c_str(), &own) != 0) return true;
  if (synced.st_ino != own.st_ino || synced.st_dev != own.st_dev) return true;
  const std::lock_guard lock(mutex_);
  if (!Count()) return false;
  if (!ignore_syncs_) durable_names_ = ListNames();
  return true;
}

PowerCutDisk::Names PowerCutDisk::ListNames() const {
  Names names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_, error)) {
    struct stat status {};
    if (::stat(entry.path().c_str(), &status) == 0) {
      names[entry.path().filename().string()] = status.st_ino;
    }
  }
  return names;
}

PowerCutDisk::File* PowerCutDisk::Find(const std::string& path, bool add) {
  struct stat status {};
  if (path.empty() || fs::path(path).parent_path() != directory_) return nullptr;
  if (::stat(path.c_str(), &status) != 0) return nullptr;
  if (const auto it = files_.find(status.st_ino); it != files_.end()) return &it->second;
  if (!add) return nullptr;
  File& file = files_[status.st_ino];
  file.fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  file.size = SizeOf(file.fd);
  file.durable = ReadAt(file.fd, 0, file.size);
  file.sizes = {file.size};
  return &file;
}

void PowerCutDisk::NotePages(File& file, std::int64_t begin, std::int64_t end) {
  for (std::int64_t page = begin / kPage * kPage; page < end; page += kPage) {
    Versions& versions = file.pages[page];
    if (versions.empty()) versions.push_back(PageOf(file.durable, page));
    versions.push_back(PageOf(ReadAt(file.fd, page, kPage), 0));
  }
  file.size = SizeOf(file.fd);
  if (file.sizes.back() != file.size) file.sizes.push_back(file.size);
}

void PowerCutDisk::MakeDurable(File& file) {
  file.durable.resize(static_cast<std::size_t>(file.size), '\0');
  for (const auto& [page, versions] : file.pages) PutPage(file.durable, page, versions.back());
  file.pages.clear();
  file.sizes = {file.size};
}

std::size_t PowerCutDisk::Choose(std::size_t count) {
  return static_cast<std::size_t>(random_() % count);
}

std::string PowerCutDisk::Survivor(const File& file) {
  std::string bytes = file.durable;
  bytes.resize(static_cast<std::size_t>(file.sizes[Choose(file.sizes.size())]), '\0');
  for (const auto& [page, versions] : file.pages) {
    std::string kept = versions[Choose(versions.size())];
    if (Choose(4) == 0) {
      for (std::size_t at = 0; at < kept.size(); at += kSector) {
        kept.replace(at, kSector, versions[Choose(versions.size())], at, kSector);
      }
    }
    PutPage(bytes, page, kept);
  }
  return bytes;
}

void PowerCutDisk::WriteSurvivors() {
  fs::create_directories(survivors_);
  const Names now = ListNames();
  Names names = now;
  names.insert(durable_names_.begin(), durable_names_.end());
  const auto inode_in = [](const Names& in, const std::string& name) {
    const auto it = in.find(name);
    return it == in.end() ? ino_t{0} : it->second;
  };
  for (const auto& [name, unused] : names) {
    const ino_t before = inode_in(durable_names_, name);
    const ino_t after = inode_in(now, name);
    const ino_t kept = before == after || Choose(2) == 0 ? after : before;
    if (kept == 0) continue;
    std::ofstream out(survivors_ / name, std::ios::binary);
    if (const auto file = files_.find(kept); file != files_.end()) {
      const std::string bytes = Survivor(file->second);
      out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    } else if (name.ends_with("-shm")) {
      for (int i = 0; i < 4096; ++i) out.put(static_cast<char>(random_()));
    }
  }
}

}  // namespace strata::testing

namespace {

using SyncFunction = int (*)(int);

int SyncUnlessCut(const char* name, int fd) {
  const auto sync = reinterpret_cast<SyncFunction>(::dlsym(RTLD_NEXT, name));
  strata::testing::PowerCutDisk* const disk = strata::testing::watching;
  if (disk == nullptr || disk->SyncDescriptor(fd)) return sync(fd);
  errno = EIO;
  return -1;
}

}  // namespace

// In place of the C library's, for SQLite and the engine alike: the only way to see when a
// directory is synced.
extern "C" int fsync(int fd) { return SyncUnlessCut("fsync", fd); }
extern "C" int fdatasync(int fd) { return SyncUnlessCut("fdatasync", fd); }

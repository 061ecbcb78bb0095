#include "core/engine/map/directory.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/random/random.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/common/status.h"
#include "core/storage/sqlite/map_file.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/world/names.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kSuffix = ".strata";
// Map names never begin with a dot, so no prefix can meet a map.
constexpr char kMakingPrefix[] = ".making-";
constexpr char kCopyPrefix[] = ".copy-";
constexpr char kLockName[] = ".lock";
constexpr char kClockName[] = ".clock";
constexpr char kIdentityName[] = ".identity";
// Endings of the files of a map, its own first.
constexpr std::array<const char*, 4> kSuffixes = {"", "-wal", "-shm", "-journal"};

absl::Status ErrnoStatus(absl::string_view what, const fs::path& path) {
  const int error = errno;
  return absl::ErrnoToStatus(error, absl::StrCat(what, " ", path.string()));
}

absl::Status SyncDirectory(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return ErrnoStatus("cannot open directory", path);
  const int synced = ::fsync(fd);
  absl::Status status = synced == 0 ? absl::OkStatus() : ErrnoStatus("cannot sync directory", path);
  ::close(fd);
  return status;
}

fs::path WithSuffix(fs::path file, const char* suffix) { return file += suffix; }

// A journal without its database would be taken for that of the next map of the same name.
absl::Status RemoveWithJournals(const fs::path& file) {
  for (const char* suffix : kSuffixes) {
    std::error_code error;
    fs::remove(WithSuffix(file, suffix), error);
    if (error) {
      return absl::UnavailableError(
          absl::StrCat("cannot remove ", file.filename().string(), suffix, ": ", error.message()));
    }
  }
  return absl::OkStatus();
}

// Whether the file is the journal of a map file that is not there.
bool IsOrphan(const fs::path& file) {
  for (const absl::string_view suffix : kSuffixes) {
    absl::string_view map = file.native();
    if (!absl::ConsumeSuffix(&map, suffix) || !absl::EndsWith(map, kSuffix)) continue;
    std::error_code error;
    return !fs::exists(std::string(map), error) && !error;
  }
  return false;
}

absl::Status RemoveLeftovers(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    files.push_back(entry.path());
  }
  if (error) return absl::UnavailableError(absl::StrCat(directory.string(), ": ", error.message()));
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    const bool half_made =
        absl::StartsWith(name, kMakingPrefix) || absl::StartsWith(name, kCopyPrefix);
    if (half_made || IsOrphan(file)) fs::remove(file, error);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MapDirectory> MapDirectory::Open(const fs::path& path) {
  std::error_code error;
  if (fs::create_directories(path, error)) {
    fs::permissions(path, fs::perms::others_all, fs::perm_options::remove, error);
  }
  if (!fs::is_directory(path, error)) {
    return absl::InvalidArgumentError(
        absl::StrCat("directory ", path.string(), " cannot be made or is no directory"));
  }
  const fs::path lock_file = path / kLockName;
  const int lock = ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (lock < 0) return ErrnoStatus("cannot open", lock_file);
  MapDirectory directory(path, lock);
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("directory ", path.string(), " is in use by another process or engine"));
  }
  STRATA_RETURN_IF_ERROR(RemoveLeftovers(path));
  return directory;
}

MapDirectory::~MapDirectory() {
  if (lock_ >= 0) ::close(lock_);
}

fs::path MapDirectory::FileIn(const fs::path& directory, absl::string_view name) {
  return directory / absl::StrCat(name, kSuffix);
}

absl::StatusOr<std::string> MapDirectory::Identity() const {
  const fs::path file = path_ / kIdentityName;
  std::string identity;
  if (std::ifstream(file) >> identity) return identity;
  absl::BitGen random;
  identity = absl::StrCat(absl::Hex(absl::Uniform<std::uint64_t>(random), absl::kZeroPad16));
  std::ofstream(file, std::ios::trunc) << identity << '\n';
  std::string kept;
  if (std::ifstream(file) >> kept && kept == identity) return identity;
  return absl::UnavailableError(absl::StrCat("cannot write ", file.string()));
}

fs::path MapDirectory::CopyOf(absl::string_view name) const {
  return path_ / absl::StrCat(kCopyPrefix, name, kSuffix);
}

absl::Status MapDirectory::RemoveCopy(absl::string_view name) const {
  return RemoveWithJournals(CopyOf(name));
}

absl::StatusOr<std::vector<std::string>> MapDirectory::NamesIn(const fs::path& directory) {
  std::error_code error;
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension().string() == kSuffix && ValidateName("map name", name).ok()) {
      names.push_back(name);
    }
  }
  if (error) return absl::UnavailableError(absl::StrCat(directory.string(), ": ", error.message()));
  std::sort(names.begin(), names.end());
  return names;
}

absl::Status MapDirectory::MakeFile(
    absl::string_view name,
    absl::FunctionRef<absl::Status(const fs::path& file, std::uint64_t clock)> make) const {
  const fs::path file = FileOf(name);
  std::error_code error;
  if (fs::exists(file, error)) {
    return absl::AlreadyExistsError(absl::StrCat("map ", name, " exists"));
  }
  const fs::path making = path_ / absl::StrCat(kMakingPrefix, name, kSuffix);
  STRATA_RETURN_IF_ERROR(RemoveWithJournals(making));
  const std::uint64_t removed = RemovedClock();
  absl::Status made = make(making, removed == 0 ? 0 : removed + 1);
  if (made.ok()) {
    fs::rename(making, file, error);
    if (error) made = absl::UnavailableError(error.message());
  }
  if (!made.ok()) {
    RemoveWithJournals(making).IgnoreError();  // if this fails the next start does it
    return Annotate(made, absl::StrCat("cannot make map ", name));
  }
  absl::Status synced = SyncDirectory(path_);
  if (!synced.ok()) RemoveWithJournals(file).IgnoreError();
  return synced;
}

absl::Status MapDirectory::CreateFile(absl::string_view name,
                                      const MapParameters& parameters,
                                      absl::Time created) const {
  return MakeFile(name, [&](const fs::path& file, std::uint64_t clock) {
    return CreateSqliteMap(file, parameters, created, clock);
  });
}

absl::Status MapDirectory::ImportFile(absl::string_view name,
                                      const fs::path& from,
                                      const Stop& stop) const {
  return MakeFile(name, [&](const fs::path& file, std::uint64_t clock) {
    return CopySqliteMap(from, file, clock, stop);
  });
}

absl::Status MapDirectory::CheckRemovable(absl::string_view name) const {
  const fs::path file = FileOf(name);
  std::error_code error;
  if (!fs::exists(fs::symlink_status(file, error))) return absl::OkStatus();
  const absl::Status is_map = CheckIsSqliteMap(file);
  return is_map.ok() ? is_map : Annotate(is_map, "not deleted");
}

std::uint64_t MapDirectory::RemovedClock() const {
  std::uint64_t clock = 0;
  std::ifstream(path_ / kClockName) >> clock;
  return clock;
}

absl::Status MapDirectory::NoteRemovedClock(std::uint64_t clock) const {
  if (clock <= RemovedClock()) return absl::OkStatus();
  const fs::path making = path_ / absl::StrCat(kMakingPrefix, "clock");
  const int fd = ::open(making.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (fd < 0) return ErrnoStatus("cannot open", making);
  const std::string text = absl::StrCat(clock, "\n");
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                       ::fsync(fd) == 0;
  absl::Status noted = written ? absl::OkStatus() : ErrnoStatus("cannot write", making);
  ::close(fd);
  if (!noted.ok()) return noted;
  if (::rename(making.c_str(), (path_ / kClockName).c_str()) != 0) {
    return ErrnoStatus("cannot rename", making);
  }
  return SyncDirectory(path_);
}

absl::Status MapDirectory::RemoveFile(absl::string_view name, std::uint64_t clock) const {
  const absl::Status noted = NoteRemovedClock(clock);
  STRATA_RETURN_IF_ERROR(RemoveWithJournals(FileOf(name)));
  STRATA_RETURN_IF_ERROR(SyncDirectory(path_));
  return noted.ok() ? noted : NoteRemovedClock(clock);  // now that there is room for it
}

}  // namespace strata

#include "client/sdk/spool_directory.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "core/common/status.h"

namespace strata::sdk {
namespace {

namespace fs = std::filesystem;

absl::Status ErrnoStatus(absl::string_view what, const fs::path& path) {
  const int error = errno;
  const std::string message = absl::StrCat(what, " ", path.string());
  // A limit of the process, and to its caller no other than a full disk.
  if (error == EFBIG) return absl::ResourceExhaustedError(absl::StrCat(message, ": too large"));
  return absl::ErrnoToStatus(error, message);
}

class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0640)) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

absl::Status SyncDirectory(const fs::path& path) {
  const Descriptor directory(path, O_RDONLY | O_DIRECTORY);
  if (directory.get() < 0) return ErrnoStatus("cannot open directory", path);
  return ::fsync(directory.get()) == 0 ? absl::OkStatus()
                                       : ErrnoStatus("cannot sync directory", path);
}

absl::Status WriteAndSync(const fs::path& path, absl::string_view bytes) {
  const Descriptor file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (file.get() < 0) return ErrnoStatus("cannot make", path);
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return ErrnoStatus("cannot write", path);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file.get()) == 0 ? absl::OkStatus() : ErrnoStatus("cannot sync", path);
}

absl::Status Move(const fs::path& from, const fs::path& to) {
  return ::rename(from.c_str(), to.c_str()) == 0 ? absl::OkStatus()
                                                 : ErrnoStatus("cannot rename", from);
}

}  // namespace

absl::StatusOr<std::vector<SpoolFile>> ListSpoolFiles(const fs::path& folder) {
  std::vector<SpoolFile> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    std::uint64_t number = 0;
    if (entry.path().extension() != ".scan" ||
        !absl::SimpleAtoi(entry.path().stem().string(), &number)) {
      continue;
    }
    std::error_code gone;
    const std::uint64_t bytes = fs::file_size(entry.path(), gone);
    if (!gone) files.push_back({number, bytes});
  }
  if (error) return absl::NotFoundError(absl::StrCat(folder.string(), ": ", error.message()));
  std::sort(files.begin(), files.end(), [](const SpoolFile& a, const SpoolFile& b) {
    return a.number < b.number;
  });
  return files;
}

absl::StatusOr<SpoolDirectory> SpoolDirectory::Open(const fs::path& path) {
  std::error_code error;
  for (const char* folder : {"waiting", "refused", "damaged", "adding"}) {
    if (fs::create_directories(path / folder, error)) {
      fs::permissions(path / folder, fs::perms::others_all, fs::perm_options::remove, error);
    }
    if (!fs::is_directory(path / folder, error)) {
      return absl::InvalidArgumentError(
          absl::StrCat("spool ", path.string(), " cannot be made or is no directory"));
    }
  }
  const int lock = ::open((path / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (lock < 0) return ErrnoStatus("cannot open", path / ".lock");
  SpoolDirectory directory(path, lock);
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("spool ", path.string(), " is in use by another process"));
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(path / "adding", error)) {
    std::error_code ignored;
    fs::remove(entry.path(), ignored);
  }
  STRATA_RETURN_IF_ERROR(SyncDirectory(path));
  return directory;
}

SpoolDirectory::~SpoolDirectory() {
  if (lock_ >= 0) ::close(lock_);
}

fs::path SpoolDirectory::FileOf(absl::string_view folder, std::uint64_t number) const {
  return path_ / std::string(folder) / absl::StrFormat("%020d.scan", number);
}

absl::Status SpoolDirectory::Add(std::uint64_t number, absl::string_view bytes) const {
  const fs::path adding = FileOf("adding", number);
  absl::Status added = WriteAndSync(adding, bytes);
  if (added.ok()) added = Move(adding, FileOf("waiting", number));
  if (added.ok()) return SyncDirectory(path_ / "waiting");
  std::error_code ignored;
  fs::remove(adding, ignored);
  return added;
}

absl::Status SpoolDirectory::Remove(std::uint64_t number) const {
  // Not synced: a file that comes back is sent again, which changes nothing.
  const fs::path file = FileOf("waiting", number);
  return ::unlink(file.c_str()) == 0 ? absl::OkStatus() : ErrnoStatus("cannot remove", file);
}

absl::Status SpoolDirectory::SetAside(absl::string_view folder,
                                      std::uint64_t number,
                                      absl::string_view reason) const {
  fs::path why = FileOf(folder, number);
  why.replace_extension(".txt");
  // A full disk must not keep the scan in the way of the others.
  WriteAndSync(why, absl::StrCat(reason, "\n")).IgnoreError();
  STRATA_RETURN_IF_ERROR(Move(FileOf("waiting", number), FileOf(folder, number)));
  return SyncDirectory(path_ / std::string(folder));
}

}  // namespace strata::sdk

#include "client/formats/bags/bag_file.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace strata {
namespace {

absl::Status CannotRead(const std::string& name) {
  return absl::UnavailableError(absl::StrCat(name, ": cannot be read: ", std::strerror(errno)));
}

}  // namespace

absl::StatusOr<BagFile> BagFile::Open(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return CannotRead(path.string());
  struct stat about {};
  if (fstat(descriptor, &about) != 0) {
    const absl::Status status = CannotRead(path.string());
    close(descriptor);
    return status;
  }
  return BagFile(descriptor, static_cast<std::uint64_t>(about.st_size), path.string());
}

BagFile::BagFile(BagFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      name_(std::move(other.name_)) {}

BagFile::~BagFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

absl::Status BagFile::Read(std::uint64_t at, std::uint64_t count, std::string& bytes) const {
  const std::uint64_t there = at < size_ ? std::min(count, size_ - at) : 0;
  bytes.resize(static_cast<std::size_t>(there));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return CannotRead(name_);
    if (got == 0) break;  // it has become shorter
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return absl::OkStatus();
}

}  // namespace strata

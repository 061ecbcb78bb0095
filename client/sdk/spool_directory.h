// The files of a spool: written so that they survive loss of power, by one process at a time.
#ifndef STRATA_CLIENT_SDK_SPOOL_DIRECTORY_H_
#define STRATA_CLIENT_SDK_SPOOL_DIRECTORY_H_

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata::sdk {

struct SpoolFile {
  std::uint64_t number;
  std::uint64_t bytes;
};

// The scans in one folder of a spool, by number.
absl::StatusOr<std::vector<SpoolFile>> ListSpoolFiles(const std::filesystem::path& folder);

// DIR/.lock; DIR/waiting/N.scan, in the order of their numbers; DIR/refused/ and DIR/damaged/ with
// N.scan and its reason, N.txt; DIR/adding/ has what is not whole yet. Calls on different numbers
// may come from different threads.
class SpoolDirectory {
 public:
  // Makes what is not there and drops what was not whole. FAILED_PRECONDITION while another process
  // has it.
  static absl::StatusOr<SpoolDirectory> Open(const std::filesystem::path& path);
  ~SpoolDirectory();
  SpoolDirectory(SpoolDirectory&& other) noexcept
      : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}
  SpoolDirectory& operator=(SpoolDirectory&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // `folder` is "waiting", "refused" or "damaged".
  std::filesystem::path FileOf(absl::string_view folder, std::uint64_t number) const;
  // Returns once the file waits, and will after a loss of power. RESOURCE_EXHAUSTED on a full disk.
  absl::Status Add(std::uint64_t number, absl::string_view bytes) const;
  absl::Status Remove(std::uint64_t number) const;
  // Takes a waiting file out of the way, for a person to look at.
  absl::Status SetAside(absl::string_view folder,
                        std::uint64_t number,
                        absl::string_view reason) const;

 private:
  SpoolDirectory(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}

  std::filesystem::path path_;
  int lock_;  // held while this lives
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_SPOOL_DIRECTORY_H_

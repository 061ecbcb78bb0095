// Pieces of a file of any size, by their place.
#ifndef STRATA_CLIENT_FORMATS_BAGS_BAG_FILE_H_
#define STRATA_CLIENT_FORMATS_BAGS_BAG_FILE_H_

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace strata {

// Of a chunk, a message or what is made of one: files that say more are not believed.
inline constexpr std::uint64_t kMaxBagPieceBytes = std::uint64_t{1} << 30;

class BagFile {
 public:
  // UNAVAILABLE, naming the file and why.
  static absl::StatusOr<BagFile> Open(const std::filesystem::path& path);
  BagFile(BagFile&& other) noexcept;
  BagFile& operator=(BagFile&& other) = delete;
  ~BagFile();

  std::uint64_t size() const { return size_; }  // when it was opened
  const std::string& name() const { return name_; }
  // `bytes` becomes what is there, fewer than `count` at the file's end. REQUIRES: count ≤
  // kMaxBagPieceBytes + 1 MiB. UNAVAILABLE if the disk fails.
  absl::Status Read(std::uint64_t at, std::uint64_t count, std::string& bytes) const;

 private:
  BagFile(int descriptor, std::uint64_t size, std::string name)
      : descriptor_(descriptor), size_(size), name_(std::move(name)) {}

  int descriptor_;
  std::uint64_t size_;
  std::string name_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_BAG_FILE_H_

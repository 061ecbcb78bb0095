// A disk whose power is cut: what was not synced by then survives page by page, torn, or not at
// all.
#ifndef STRATA_TESTS_SUPPORT_FAULTS_POWER_CUT_DISK_H_
#define STRATA_TESTS_SUPPORT_FAULTS_POWER_CUT_DISK_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/support/faults/disk_shim.h"

namespace strata::testing {

// While it lives, it notes of every file that SQLite opens in `directory` what is durable and what
// was written since the file was last synced, and of the directory which names were there when it
// was last synced itself. One lives at a time. Thread-safe.
//
// At the cut a page of 4 KiB is, by chance, as it was at any moment since the last sync, or in
// every sector of 512 bytes another of these; a file is as long as at any such moment; a name that
// came, went or moved since the directory was synced did so or not, each for itself. Bytes that
// were synced and not written since stay, as disks promise them to SQLite
// (SQLITE_IOCAP_POWERSAFE_OVERWRITE). What remains of a log's index is noise.
class PowerCutDisk {
 public:
  explicit PowerCutDisk(const std::filesystem::path& directory);
  ~PowerCutDisk();
  PowerCutDisk(const PowerCutDisk&) = delete;
  PowerCutDisk& operator=(const PowerCutDisk&) = delete;

  // After `sound` more writes, truncations, syncs, removals and openings power is cut: what
  // survives, by `seed`, is written into `survivors`, and everything fails from then on.
  void CutAfter(std::int64_t sound, std::uint64_t seed, const std::filesystem::path& survivors);
  bool is_cut() const;
  // How many such operations there were.
  std::int64_t operations() const;
  // From now on a sync makes nothing durable, as with a disk that lies.
  void IgnoreSyncs();

  // Called for every fsync() and fdatasync() of the process; false: it fails.
  bool SyncDescriptor(int fd);

 private:
  // Contents a page has had since the file was synced, the durable one first.
  using Versions = std::vector<std::string>;
  struct File {
    int fd = -1;  // held, so that the file outlives its name
    std::string durable;
    std::int64_t size = 0;
    std::vector<std::int64_t> sizes;  // since it was synced, the durable one first
    std::map<std::int64_t, Versions> pages;
  };
  using Names = std::map<std::string, ino_t>;

  int Before(const DiskOperation& operation);
  void After(const DiskOperation& operation);
  // Whether the operation still happens.
  bool Count();
  Names ListNames() const;
  // nullptr for files elsewhere.
  File* Find(const std::string& path, bool add);
  void NotePages(File& file, std::int64_t begin, std::int64_t end);
  static void MakeDurable(File& file);
  void WriteSurvivors();
  std::string Survivor(const File& file);
  std::size_t Choose(std::size_t count);

  const std::filesystem::path directory_;
  mutable std::mutex mutex_;
  std::map<ino_t, File> files_;
  Names durable_names_;
  std::int64_t operations_ = 0;
  std::int64_t left_ = INT64_MAX / 2;
  bool cut_ = false;
  bool ignore_syncs_ = false;
  std::filesystem::path survivors_;
  std::mt19937_64 random_;
  std::unique_ptr<DiskShim> shim_;  // last: it calls the others
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTS_POWER_CUT_DISK_H_

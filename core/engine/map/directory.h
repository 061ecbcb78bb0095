// The directory of an engine: who owns it, and the files in it.
#ifndef STRATA_CORE_ENGINE_MAP_DIRECTORY_H_
#define STRATA_CORE_ENGINE_MAP_DIRECTORY_H_

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/world/map_info.h"

namespace strata {

// Locked for as long as it lives. Map names must be valid (ValidateName): they become file names.
class MapDirectory {
 public:
  // Makes the directory if needed, closed to others, and removes what a crash left of half-made and
  // half-deleted maps and of copies. FAILED_PRECONDITION if another engine has it.
  static absl::StatusOr<MapDirectory> Open(const std::filesystem::path& path);
  ~MapDirectory();
  MapDirectory(MapDirectory&& other) noexcept
      : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}
  MapDirectory& operator=(MapDirectory&&) = delete;

  // The file of a map, and the names of all, sorted, in a directory that nobody need have opened.
  static std::filesystem::path FileIn(const std::filesystem::path& directory,
                                      absl::string_view name);
  static absl::StatusOr<std::vector<std::string>> NamesIn(const std::filesystem::path& directory);
  std::filesystem::path FileOf(absl::string_view name) const { return FileIn(path_, name); }
  absl::StatusOr<std::vector<std::string>> ListNames() const { return NamesIn(path_); }
  // A name that no other directory has, made when it is first asked for and kept in it: whoever has
  // the directory is the successor of whoever had it before.
  absl::StatusOr<std::string> Identity() const;
  // Where a copy of the map is made: no map's file, and removed by the next Open().
  std::filesystem::path CopyOf(absl::string_view name) const;
  // What is left of one that is not made any more.
  absl::Status RemoveCopy(absl::string_view name) const;
  // All or nothing, also when the power fails. ALREADY_EXISTS. The map's clock begins behind those
  // of all maps that were removed, so that nobody takes it for one of them.
  absl::Status CreateFile(absl::string_view name,
                          const MapParameters& parameters,
                          absl::Time created) const;
  // The same of a copy of the map file `from`, whoever has that open, as of CopySqliteMap().
  absl::Status ImportFile(absl::string_view name,
                          const std::filesystem::path& from,
                          const Stop& stop) const;
  // FAILED_PRECONDITION for a file that no map was ever in; OK also where there is none.
  absl::Status CheckRemovable(absl::string_view name) const;
  // No connection may be open; one thread at a time. `clock`: where the map's stood; 0: unknown.
  absl::Status RemoveFile(absl::string_view name, std::uint64_t clock) const;

 private:
  MapDirectory(std::filesystem::path path, int lock) : path_(std::move(path)), lock_(lock) {}
  // Has `make` make a file in the directory, its clock at least at `clock`, and gives it its name.
  absl::Status MakeFile(absl::string_view name,
                        absl::FunctionRef<absl::Status(const std::filesystem::path& file,
                                                       std::uint64_t clock)> make) const;
  // The latest clock of a map that was removed; 0: none was.
  std::uint64_t RemovedClock() const;
  absl::Status NoteRemovedClock(std::uint64_t clock) const;

  std::filesystem::path path_;
  int lock_;  // file descriptor
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_DIRECTORY_H_

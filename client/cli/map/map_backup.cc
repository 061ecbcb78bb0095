// strata map backup
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <fcntl.h>
#include <unistd.h>

#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

namespace fs = std::filesystem;

struct BackupOptions {
  std::string map;
  std::string file;
  bool force = false;
};

// A file that takes its name only when it is whole and on the disk, and that others than user and
// group cannot read. Removed unless it did.
class NewFile {
 public:
  explicit NewFile(fs::path path) : path_(std::move(path)), part_(path_) {
    part_ += absl::StrCat(".", ::getpid(), ".part");
    file_ = ::open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
    if (file_ < 0) status_ = CannotWrite();
  }
  ~NewFile() {
    if (file_ >= 0) ::close(file_);
    std::error_code error;
    if (!named_) fs::remove(part_, error);
  }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  const absl::Status& status() const { return status_; }
  absl::Status Write(absl::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return CannotWrite();
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return absl::OkStatus();
  }
  absl::Status TakeName() {
    if (::fsync(file_) != 0 || ::rename(part_.c_str(), path_.c_str()) != 0) return CannotWrite();
    named_ = true;
    const fs::path directory = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
    const int entry = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (entry < 0) return CannotWrite();
    const bool synced = ::fsync(entry) == 0;
    const absl::Status status = synced ? absl::OkStatus() : CannotWrite();
    ::close(entry);
    return status;
  }

 private:
  absl::Status CannotWrite() const {
    return absl::FailedPreconditionError(
        absl::StrCat(path_.string(), ": cannot be written: ", std::strerror(errno)));
  }

  fs::path path_;
  fs::path part_;
  int file_ = -1;
  bool named_ = false;
  absl::Status status_;
};

absl::Status Backup(Context& context, const BackupOptions& options) {
  std::error_code error;
  if (!options.force && fs::exists(fs::symlink_status(options.file, error))) {
    return absl::AlreadyExistsError(absl::StrCat(options.file, " exists; --force writes over it"));
  }
  NewFile file(options.file);
  STRATA_RETURN_IF_ERROR(file.status());
  Progress progress(context.output.talk(), TalksToTerminal(), "backup");
  std::uint64_t written = 0;
  std::string content_hash;
  STRATA_RETURN_IF_ERROR(context.database.maps().Backup(
      context.call, options.map, [&](const api::BackupPiece& piece) -> absl::Status {
        STRATA_RETURN_IF_ERROR(file.Write(piece.bytes));
        written += piece.bytes.size();
        content_hash = piece.content_hash;
        progress.Update(static_cast<double>(written) / static_cast<double>(piece.total_bytes),
                        "copying");
        return absl::OkStatus();
      }));
  STRATA_RETURN_IF_ERROR(file.TakeName());
  progress.Clear();
  context.output.Object({{"map", options.map},
                         {"file", options.file},
                         {"bytes", written},
                         {"content_hash", content_hash}});
  return absl::OkStatus();
}

}  // namespace

void AddMapBackup(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<BackupOptions>();
  CLI::App* backup = commands.Verb(
      noun,
      "backup",
      "Write a map's file as it is now, while scans go on coming; put into the directory of a "
      "server that does not run, as NAME.strata, it is a map",
      "strata map backup campus campus.strata",
      [options](Context& context) { return Backup(context, *options); });
  AddMapName(backup, options->map);
  backup->add_option("FILE", options->file, "The file to write")
      ->type_name("FILE.strata")
      ->required();
  backup->add_flag("--force", options->force, "Write over a file that is there");
}

}  // namespace strata::cli

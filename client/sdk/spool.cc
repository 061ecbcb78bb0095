#include "client/sdk/spool.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

#include "client/sdk/spool_directory.h"
#include "client/sdk/spool_file.h"
#include "core/api/chunk_check.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "core/world/names.h"
#include "core/world/scan_hash.h"

namespace strata {
namespace {

// No later attempt can end otherwise.
bool RefusedForGood(const absl::Status& status) {
  return absl::IsInvalidArgument(status) || absl::IsAlreadyExists(status);
}

// The rest of the file, behind what the server has. `damaged` tells whose error it is.
absl::Status WriteRest(sdk::SpoolFileReader& file, api::ScanUpload& upload, bool& damaged) {
  const std::uint64_t held = upload.points_held();
  std::uint64_t first = 0;
  while (true) {
    const absl::StatusOr<std::optional<PointCloud>> piece = file.Next();
    damaged = !piece.ok();
    if (damaged) return piece.status();
    if (!piece->has_value()) return absl::OkStatus();
    const PointCloud& points = **piece;
    const std::uint64_t known =
        held > first ? std::min<std::uint64_t>(held - first, points.size()) : 0;
    first += points.size();
    if (known == points.size()) continue;
    STRATA_RETURN_IF_ERROR(
        upload.Write(known == 0 ? points : SliceOf(points, known, points.size())));
  }
}

absl::Status SendFile(const std::filesystem::path& path,
                      const api::Call& call,
                      api::Database& database,
                      bool& damaged) {
  absl::StatusOr<sdk::SpoolFileReader> file = sdk::SpoolFileReader::Open(path);
  damaged = !file.ok();
  if (damaged) return file.status();
  const sdk::SpooledScan& scan = file->scan();
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                          database.scans().Upload(call, scan.map, scan.header));
  STRATA_RETURN_IF_ERROR(WriteRest(*file, *upload, damaged));
  STRATA_ASSIGN_OR_RETURN(const ScanAck ack, upload->Finish());
  if (ack.content_hash == scan.header.content_hash) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("scan ",
                                          scan.header.id.ToString(),
                                          ": acknowledged with hash ",
                                          ack.content_hash,
                                          " instead of ",
                                          scan.header.content_hash,
                                          "; it is kept"));
}

absl::Status CheckCloud(const ScanHeader& header, const PointCloud& cloud) {
  if (!cloud.origin.isZero(0.0)) {
    return absl::InvalidArgumentError("cloud with an origin; fold it into the pose");
  }
  if (header.point_count != cloud.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat(cloud.size(), " points, but the header announced ", header.point_count));
  }
  for (std::size_t begin = 0; begin < cloud.size(); begin += api::kMaxPointsPerChunk) {
    const std::size_t end = std::min(cloud.size(), begin + api::kMaxPointsPerChunk);
    STRATA_RETURN_IF_ERROR(api::CheckChunk(SliceOf(cloud, begin, end), header, begin));
  }
  return absl::OkStatus();
}

}  // namespace

// The directory, and what is known of its files.
class Spool::Files {
 public:
  struct Entry {
    std::string map;
    ScanId id;
    std::uint64_t bytes = 0;
  };

  Files(sdk::SpoolDirectory directory, const SpoolOptions& options)
      : directory_(std::move(directory)), options_(options) {}

  const sdk::SpoolDirectory& directory() const { return directory_; }
  absl::Mutex& sending() ABSL_LOCK_RETURNED(sending_) { return sending_; }

  // Reads the heads of all files; what cannot be read is set aside.
  absl::Status Load();
  absl::Status Add(const Entry& entry, absl::string_view bytes);
  // The first behind `number`.
  std::optional<std::pair<std::uint64_t, Entry>> After(std::uint64_t number) const;
  absl::Status Sent(std::uint64_t number);
  absl::Status SetAside(bool damaged, std::uint64_t number, const absl::Status& why);
  void SetLastError(const absl::Status& error);
  SpoolStatus status() const;
  std::vector<ScanId> Waiting(absl::string_view map) const;

 private:
  absl::StatusOr<std::uint64_t> Reserve(std::uint64_t bytes);

  const sdk::SpoolDirectory directory_;
  const SpoolOptions options_;
  absl::Mutex sending_;
  mutable absl::Mutex mutex_;
  std::map<std::uint64_t, Entry> waiting_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t last_number_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;  // of all files, and of those being added
  SpoolStatus status_ ABSL_GUARDED_BY(mutex_);       // but for what waits
};

absl::Status Spool::Files::Load() {
  for (const char* folder : {"waiting", "refused", "damaged"}) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<sdk::SpoolFile> files,
                            sdk::ListSpoolFiles(directory_.path() / folder));
    absl::MutexLock lock(&mutex_);
    for (const auto& [number, bytes] : files) {
      bytes_ += bytes;
      last_number_ = std::max(last_number_, number);
    }
    if (folder == absl::string_view("refused")) status_.refused = files.size();
    if (folder == absl::string_view("damaged")) status_.damaged = files.size();
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<sdk::SpoolFile> waiting,
                          sdk::ListSpoolFiles(directory_.path() / "waiting"));
  for (const auto& [number, bytes] : waiting) {
    const auto file = sdk::SpoolFileReader::Open(directory_.FileOf("waiting", number));
    if (file.ok()) {
      absl::MutexLock lock(&mutex_);
      waiting_[number] = {file->scan().map, file->scan().header.id, bytes};
    } else if (absl::IsDataLoss(file.status())) {
      STRATA_RETURN_IF_ERROR(SetAside(true, number, file.status()));
    } else {
      return file.status();  // of a later version, or not to be read: nothing may be lost
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> Spool::Files::Reserve(std::uint64_t bytes) {
  absl::MutexLock lock(&mutex_);
  if (bytes_ + bytes > options_.max_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("spool is full: ",
                     bytes_,
                     " bytes lie there, and the scan has ",
                     bytes,
                     "; at most ",
                     options_.max_bytes,
                     ". Connect it to its server, or look into refused/ and damaged/"));
  }
  bytes_ += bytes;
  return ++last_number_;
}

absl::Status Spool::Files::Add(const Entry& entry, absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t number, Reserve(bytes.size()));
  const absl::Status added = directory_.Add(number, bytes);
  absl::MutexLock lock(&mutex_);
  if (added.ok()) {
    waiting_[number] = entry;
  } else {
    bytes_ -= bytes.size();
  }
  return added;
}

std::optional<std::pair<std::uint64_t, Spool::Files::Entry>> Spool::Files::After(
    std::uint64_t number) const {
  absl::MutexLock lock(&mutex_);
  const auto it = waiting_.upper_bound(number);
  if (it == waiting_.end()) return std::nullopt;
  return *it;
}

absl::Status Spool::Files::Sent(std::uint64_t number) {
  STRATA_RETURN_IF_ERROR(directory_.Remove(number));
  absl::MutexLock lock(&mutex_);
  bytes_ -= waiting_[number].bytes;
  waiting_.erase(number);
  ++status_.sent;
  return absl::OkStatus();
}

absl::Status Spool::Files::SetAside(bool damaged, std::uint64_t number, const absl::Status& why) {
  STRATA_RETURN_IF_ERROR(
      directory_.SetAside(damaged ? "damaged" : "refused", number, why.message()));
  absl::MutexLock lock(&mutex_);
  waiting_.erase(number);
  ++(damaged ? status_.damaged : status_.refused);
  return absl::OkStatus();
}

void Spool::Files::SetLastError(const absl::Status& error) {
  absl::MutexLock lock(&mutex_);
  status_.last_error = std::string(error.message());
}

SpoolStatus Spool::Files::status() const {
  absl::MutexLock lock(&mutex_);
  SpoolStatus status = status_;
  status.waiting = waiting_.size();
  for (const auto& [number, entry] : waiting_) status.waiting_bytes += entry.bytes;
  return status;
}

std::vector<ScanId> Spool::Files::Waiting(absl::string_view map) const {
  absl::MutexLock lock(&mutex_);
  std::vector<ScanId> ids;
  for (const auto& [number, entry] : waiting_) {
    if (entry.map == map) ids.push_back(entry.id);
  }
  return ids;
}

Spool::Spool(std::unique_ptr<Files> files) : files_(std::move(files)) {}
Spool::~Spool() = default;

absl::StatusOr<std::unique_ptr<Spool>> Spool::Open(const std::filesystem::path& directory,
                                                   const SpoolOptions& options) {
  if (options.max_bytes == 0) return absl::InvalidArgumentError("spool: max_bytes is 0");
  STRATA_ASSIGN_OR_RETURN(sdk::SpoolDirectory opened, sdk::SpoolDirectory::Open(directory));
  auto files = std::make_unique<Files>(std::move(opened), options);
  STRATA_RETURN_IF_ERROR(Annotate(files->Load(), absl::StrCat("spool ", directory.string())));
  return std::unique_ptr<Spool>(new Spool(std::move(files)));
}

absl::StatusOr<SpoolStatus> Spool::Look(const std::filesystem::path& directory) {
  const auto list = [&](const char* folder) { return sdk::ListSpoolFiles(directory / folder); };
  STRATA_ASSIGN_OR_RETURN(const auto waiting, list("waiting"));
  STRATA_ASSIGN_OR_RETURN(const auto refused, list("refused"));
  STRATA_ASSIGN_OR_RETURN(const auto damaged, list("damaged"));
  SpoolStatus status;
  status.waiting = waiting.size();
  for (const auto& file : waiting) status.waiting_bytes += file.bytes;
  status.refused = refused.size();
  status.damaged = damaged.size();
  return status;
}

absl::Status Spool::Add(absl::string_view map, const ScanHeader& header, const PointCloud& cloud) {
  const std::string what = absl::StrCat("scan ", header.id.ToString());
  STRATA_RETURN_IF_ERROR(ValidateName("map name", map));
  sdk::SpooledScan scan{std::string(map), header};
  scan.header.content_hash.clear();
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(scan.header));
  STRATA_RETURN_IF_ERROR(Annotate(CheckCloud(header, cloud), what));
  scan.header.content_hash = ContentHashOf(header, cloud);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, sdk::EncodeSpoolFile(scan, cloud));
  return Annotate(files_->Add({scan.map, header.id, bytes.size()}, bytes), what);
}

absl::Status Spool::Send(const api::Call& call, api::Database& database) {
  absl::MutexLock one_at_a_time(&files_->sending());
  absl::Status trouble;
  std::set<std::string> held_back;  // maps
  std::uint64_t last = 0;
  for (auto next = files_->After(last); next.has_value(); next = files_->After(last)) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    const auto& [number, entry] = *next;
    last = number;
    if (held_back.count(entry.map) > 0) continue;
    bool damaged = false;
    const absl::Status sent =
        SendFile(files_->directory().FileOf("waiting", number), call, database, damaged);
    absl::Status settled;
    if (sent.ok()) {
      settled = files_->Sent(number);
    } else if (damaged || RefusedForGood(sent)) {
      settled = files_->SetAside(damaged, number, sent);
    } else {
      settled = sent;
    }
    if (settled.ok()) continue;
    held_back.insert(entry.map);
    if (trouble.ok()) trouble = settled;
    if (absl::IsUnavailable(settled)) break;
  }
  files_->SetLastError(trouble);
  return trouble;
}

SpoolStatus Spool::status() const { return files_->status(); }

std::vector<ScanId> Spool::Waiting(absl::string_view map) const { return files_->Waiting(map); }

}  // namespace strata

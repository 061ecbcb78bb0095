#include "core/engine/ingest/unfinished_uploads.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/storage/storage.h"
#include "core/world/value_codec.h"

namespace strata {

absl::StatusOr<std::unique_ptr<UnfinishedUploads>> UnfinishedUploads::Open(MapCore& core) {
  auto uploads = std::unique_ptr<UnfinishedUploads>(new UnfinishedUploads(core));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(std::vector<UnfinishedUpload> found, reader->ListUnfinishedUploads());
  std::vector<std::uint64_t> stale;
  {
    absl::MutexLock lock(&uploads->mutex_);
    for (UnfinishedUpload& upload : found) {
      upload.touched = std::min(upload.touched, SteadyNow());  // the clock may have been set back
      uploads->Park(upload);
    }
    stale = uploads->TakeStale(SteadyNow());
  }
  uploads->Abandon(stale);
  return uploads;
}

std::shared_ptr<ScanIntake> UnfinishedUploads::Find(const ScanHeader& header) {
  if (header.content_hash.empty()) return std::make_shared<ScanIntake>(core_, header, std::nullopt);
  std::vector<std::uint64_t> stale;
  std::shared_ptr<ScanIntake> found;
  {
    absl::MutexLock lock(&mutex_);
    stale = TakeStale(SteadyNow());
    found = FindAnnounced(header);
  }
  Abandon(stale);
  return found;
}

std::shared_ptr<ScanIntake> UnfinishedUploads::FindAnnounced(const ScanHeader& header) {
  const Key key{header.id, header.content_hash};
  std::erase_if(active_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<ScanIntake>& active = active_[{key, EncodeScanHeader(header)}];
  if (std::shared_ptr<ScanIntake> intake = active.lock(); intake != nullptr) return intake;
  auto intake = std::make_shared<ScanIntake>(core_, header, TakeParked(key));
  active = intake;
  return intake;
}

void UnfinishedUploads::Release(std::shared_ptr<ScanIntake> intake, std::uint64_t ticket) {
  intake->EndStream(ticket);  // waits for the writer, so without the lock
  std::vector<std::uint64_t> stale;
  {
    absl::MutexLock lock(&mutex_);
    if (intake.use_count() > 1) return;  // who holds it, too, comes here after this one
    const std::optional<UnfinishedUpload> rest = intake->Rest();
    if (!rest.has_value()) return;
    active_.erase({{rest->id, rest->content_hash}, EncodeScanHeader(intake->header())});
    // Another one is left where two streams claimed the hash with different headers.
    const std::optional<UnfinishedUpload> other = TakeParked({rest->id, rest->content_hash});
    Park(*rest);
    stale = TakeStale(SteadyNow());
    if (other.has_value()) stale.push_back(other->upload);
  }
  Abandon(stale);
}

void UnfinishedUploads::Park(const UnfinishedUpload& upload) {
  const Key key{upload.id, upload.content_hash};
  TakeParked(key);
  parked_.emplace(key, upload);
  by_age_.emplace(upload.touched, key);
  parked_bytes_ += upload.bytes;
}

std::optional<UnfinishedUpload> UnfinishedUploads::TakeParked(const Key& key) {
  auto node = parked_.extract(key);
  if (node.empty()) return std::nullopt;
  by_age_.erase({node.mapped().touched, key});
  parked_bytes_ -= node.mapped().bytes;
  return std::move(node.mapped());
}

std::vector<std::uint64_t> UnfinishedUploads::TakeStale(absl::Time now) {
  const EngineOptions& options = core_.options();
  std::vector<std::uint64_t> stale;
  while (!by_age_.empty()) {
    const auto& [touched, key] = *by_age_.begin();
    const bool stays = now - touched <= options.upload_keep &&
                       parked_bytes_ <= options.max_kept_upload_bytes &&
                       by_age_.size() <= options.max_kept_uploads;
    if (stays) break;
    stale.push_back(TakeParked(Key(key))->upload);
  }
  return stale;
}

void UnfinishedUploads::Abandon(const std::vector<std::uint64_t>& uploads) {
  for (const std::uint64_t upload : uploads) {
    // If this fails the next start finds it again.
    core_.writer()
        .Run(Durability::kRelaxed,
             0,
             Stop(),
             [upload](StorageWriter& writer) { return writer.AbandonUpload(upload); })
        .IgnoreError();
  }
}

}  // namespace strata

#include "core/engine/unfinished_uploads.h"

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
      uploads->parked_.insert_or_assign({upload.id, upload.content_hash}, upload);
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
  std::optional<UnfinishedUpload> parked;
  if (auto node = parked_.extract(key); !node.empty()) parked = std::move(node.mapped());
  auto intake = std::make_shared<ScanIntake>(core_, header, std::move(parked));
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
    const Key key{rest->id, rest->content_hash};
    active_.erase({key, EncodeScanHeader(intake->header())});
    // Another one is left where two streams claimed the hash with different headers.
    const auto other = parked_.find(key);
    if (other != parked_.end()) stale.push_back(other->second.upload);
    parked_.insert_or_assign(key, *rest);
    const std::vector<std::uint64_t> old = TakeStale(SteadyNow());
    stale.insert(stale.end(), old.begin(), old.end());
  }
  Abandon(stale);
}

std::vector<std::uint64_t> UnfinishedUploads::TakeStale(absl::Time now) {
  std::vector<Key> by_age;
  for (const auto& [key, upload] : parked_) by_age.push_back(key);
  std::sort(by_age.begin(),
            by_age.end(),
            [this](const Key& a, const Key& b) ABSL_NO_THREAD_SAFETY_ANALYSIS {
              return parked_.at(a).touched > parked_.at(b).touched;
            });
  std::vector<std::uint64_t> stale;
  std::uint64_t bytes = 0;
  for (const Key& key : by_age) {
    const UnfinishedUpload& upload = parked_.at(key);
    bytes += upload.bytes;
    const bool stays = now - upload.touched <= core_.options().upload_keep &&
                       bytes <= core_.options().max_kept_upload_bytes;
    if (stays) continue;
    stale.push_back(upload.upload);
    parked_.erase(key);
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

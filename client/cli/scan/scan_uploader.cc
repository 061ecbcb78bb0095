#include "client/cli/scan/scan_uploader.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/cli/terminal/patience.h"
#include "client/sdk/backoff.h"
#include "client/sdk/client.h"
#include "core/cloud/cloud_slice.h"
#include "core/codec/local_map_codec.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/mls/build.h"
#include "core/world/scan_hash.h"

namespace strata::cli {
namespace {

// kPatience bounds the attempts.
constexpr BackoffOptions kBackoff = {.max_attempts = 0};

// What the next scan would be told, too.
bool EndsTheImport(const absl::Status& sent) {
  return absl::IsPermissionDenied(sent) || absl::IsUnauthenticated(sent);
}

// What says whether an upload is sent anew: as any call, and if it broke off and has to begin
// again.
absl::Status Reason(const absl::Status& sent) {
  return absl::IsAborted(sent) ? absl::UnavailableError(sent.message()) : sent;
}

// The local map of the points relative to the cloud's origin.
absl::StatusOr<std::string> LocalMapOf(const PointCloud& cloud, const MapParameters& parameters) {
  PointCloud points = cloud;
  points.origin.setZero();
  STRATA_ASSIGN_OR_RETURN(const MlsBuildResult built,
                          BuildMlsMap(points, Pose::Identity(), parameters.sensor, parameters.mls));
  return EncodeLocalMap(built.map);
}

class Uploader {
 public:
  Uploader(api::Database& database,
           const api::Call& call,
           const std::string& map,
           const std::vector<UploadSource>& sources)
      : database_(database), call_(call), map_(map), sources_(sources), results_(sources.size()) {}

  void Work() {
    while (true) {
      std::size_t index = 0;
      {
        const std::lock_guard lock(mutex_);
        if (next_ == sources_.size()) {
          return;
        }
        index = next_++;
      }
      UploadResult result;
      result.status = Upload(index, result);
      WaitForTurn(index);
      const std::lock_guard lock(mutex_);
      ++done_.scans;
      done_.points += result.points;
      results_[index] = std::move(result);
      changed_.notify_all();
    }
  }

  void Report(const std::function<void(const UploadProgress&)>& report) {
    std::unique_lock lock(mutex_);
    while (done_.scans < sources_.size()) {
      changed_.wait_for(lock, std::chrono::milliseconds(100));
      const UploadProgress progress = done_;
      lock.unlock();
      report(progress);
      lock.lock();
    }
  }

  std::vector<UploadResult> TakeResults() { return std::move(results_); }

 private:
  absl::Status Upload(std::size_t index, UploadResult& result) {
    STRATA_RETURN_IF_ERROR(call_.stop.status());
    STRATA_RETURN_IF_ERROR(ended());
    const UploadSource& source = sources_[index];
    STRATA_ASSIGN_OR_RETURN(const PointCloud cloud, source.read());
    absl::Status status;
    if (source.as_local_map.has_value()) {
      STRATA_ASSIGN_OR_RETURN(const std::string bytes, LocalMapOf(cloud, *source.as_local_map));
      result.local_map_bytes = bytes.size();
      status = SendPatiently(index, [&] { return SendLocalMap(index, cloud, bytes); });
    } else {
      ScanHeader header = HeaderFor(source, cloud);
      header.content_hash = ContentHashOf(header, cloud);
      status = SendPatiently(index, [&] { return Send(index, header, cloud); });
    }
    if (status.ok()) result.points = cloud.size();
    result.pose_as_said = cloud.origin.isZero(0.0);
    return status;
  }

  absl::Status SendPatiently(std::size_t index, absl::FunctionRef<absl::Status()> send) {
    sdk::Backoff backoff(kBackoff);
    absl::Time since = absl::InfiniteFuture();
    while (true) {
      const absl::Status status = send();
      if (EndsTheImport(status)) End(status);
      const std::optional<absl::Duration> pause = backoff.NextPause(Reason(status));
      if (!pause.has_value()) return status;
      // Only the first in line counts time: the others wait for it anyway.
      WaitForTurn(index);
      STRATA_RETURN_IF_ERROR(ended());
      since = std::min(since, SteadyNow());
      if (SteadyNow() - since > kPatience) {
        End(status);
        return status;
      }
      STRATA_RETURN_IF_ERROR(Pause(*pause));
    }
  }

  absl::Status Send(std::size_t index, const ScanHeader& header, const PointCloud& cloud) {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                            database_.scans().Upload(call_, map_, header));
    for (std::size_t begin = upload->points_held(); begin < cloud.size();
         begin += api::kMaxPointsPerChunk) {
      const std::size_t end = std::min(begin + api::kMaxPointsPerChunk, cloud.size());
      STRATA_RETURN_IF_ERROR(upload->Write(SliceOf(cloud, begin, end)));
    }
    WaitForTurn(index);
    STRATA_RETURN_IF_ERROR(ended());
    return upload->Finish().status();
  }

  absl::Status SendLocalMap(std::size_t index, const PointCloud& cloud, absl::string_view bytes) {
    const UploadSource& source = sources_[index];
    ScanHeader header = source.header;
    header.T_map_scan.translate(cloud.origin);
    header.sensor_origin = cloud.sensor_origin;
    WaitForTurn(index);
    return database_.scans()
        .UploadLocalMap(call_, map_, header, source.as_local_map->mls, bytes)
        .status();
  }

  // Indices are handed out in order, so the one whose turn it is always has a thread.
  void WaitForTurn(std::size_t index) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return done_.scans == index; });
  }

  absl::Status Pause(absl::Duration delay) {
    const absl::Time until = SteadyNow() + delay;
    while (SteadyNow() < until) {
      STRATA_RETURN_IF_ERROR(call_.stop.status());
      absl::SleepFor(absl::Milliseconds(50));
    }
    return absl::OkStatus();
  }

  absl::Status ended() {
    const std::lock_guard lock(mutex_);
    return ended_;
  }
  void End(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    ended_ = status;
  }

  api::Database& database_;
  const api::Call& call_;
  const std::string& map_;
  const std::vector<UploadSource>& sources_;

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::size_t next_ = 0;
  UploadProgress done_;
  absl::Status ended_;
  std::vector<UploadResult> results_;
};

}  // namespace

ScanHeader HeaderFor(const UploadSource& source, const PointCloud& cloud) {
  ScanHeader header = source.header;
  AnnouncePoints(cloud, header);
  return header;
}

std::vector<UploadResult> UploadScans(api::Database& database,
                                      const api::Call& call,
                                      const std::string& map,
                                      const std::vector<UploadSource>& sources,
                                      int workers,
                                      const std::function<void(const UploadProgress&)>& report) {
  Uploader uploader(database, call, map, sources);
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(workers));
  for (int i = 0; i < workers; ++i) {
    threads.emplace_back([&uploader] { uploader.Work(); });
  }
  uploader.Report(report);
  for (std::thread& thread : threads) {
    thread.join();
  }
  return uploader.TakeResults();
}

}  // namespace strata::cli

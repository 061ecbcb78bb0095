// Scans of a robot whose server may be away: kept on its own disk until they are acknowledged.
//
//   STRATA_ASSIGN_OR_RETURN(auto spool, strata::Spool::Open("/var/spool/strata"));
//   const strata::SpoolSender sender(*spool, *db);           // sends in the background
//   STRATA_RETURN_IF_ERROR(spool->Add("campus", header, cloud));  // safe once it returns
#ifndef STRATA_CLIENT_SDK_SPOOL_H_
#define STRATA_CLIENT_SDK_SPOOL_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/api/database.h"
#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"

namespace strata {

struct SpoolOptions {
  // Bytes of scans on disk, those set aside included; Add() refuses what would exceed it. > 0.
  std::uint64_t max_bytes = std::uint64_t{16} << 30;
};

struct SpoolStatus {
  std::uint64_t waiting = 0;        // scans to be sent
  std::uint64_t waiting_bytes = 0;  // on disk
  std::uint64_t refused = 0;        // set aside in refused/: the server will never take them
  std::uint64_t damaged = 0;        // set aside in damaged/: their files were
  std::uint64_t sent = 0;           // since it was opened
  std::string last_error;           // of the last Send(); empty if it had none
};

// A directory of scans that are not acknowledged yet. Thread-safe.
//
// A scan is sent in the order of Add(), with its hash announced: what the server has of it is not
// sent again, and its file goes only once the server has acknowledged that very content. What the
// server refuses for good (INVALID_ARGUMENT, or ALREADY_EXISTS: other content under its id) is set
// aside with the reason, as is a file that is damaged; nothing is ever dropped.
class Spool {
 public:
  // Opens the directory, or makes it. FAILED_PRECONDITION while another process has it.
  static absl::StatusOr<std::unique_ptr<Spool>> Open(const std::filesystem::path& directory,
                                                     const SpoolOptions& options = {});
  // What lies in a directory, whoever has it open.
  static absl::StatusOr<SpoolStatus> Look(const std::filesystem::path& directory);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // Returns once the scan will be sent whatever happens to this process or its power. The header is
  // as for api::Scans::Upload, its content_hash is filled in. INVALID_ARGUMENT for what no server
  // would take; RESOURCE_EXHAUSTED when the spool or its disk is full: nothing was added.
  absl::Status Add(absl::string_view map, const ScanHeader& header, const PointCloud& cloud);

  // Sends what waits. OK once nothing does; otherwise the first trouble that leaves a scan waiting.
  // A scan that waits holds back the later ones of its map; with UNAVAILABLE all are. Ends soon
  // when the call is stopped. One at a time: another call waits for its end.
  absl::Status Send(const api::Call& call, api::Database& database);

  SpoolStatus status() const;
  // Scans of this map and trajectory, whatever became of them; in the order of Add().
  std::vector<ScanId> Waiting(absl::string_view map) const;

 private:
  class Files;
  explicit Spool(std::unique_ptr<Files> files);
  const std::unique_ptr<Files> files_;
};

// A thread that sends what a spool has, and tries again for as long as it lives, with pauses of 0.1
// to 5 s.
class SpoolSender {
 public:
  // Both must outlive it.
  SpoolSender(Spool& spool, api::Database& database);
  // Ends it within the time of one message, whatever is under way.
  ~SpoolSender();
  SpoolSender(const SpoolSender&) = delete;
  SpoolSender& operator=(const SpoolSender&) = delete;

 private:
  void Loop();

  Spool& spool_;
  api::Database& database_;
  const api::Call call_;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_SDK_SPOOL_H_

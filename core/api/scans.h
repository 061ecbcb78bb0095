// Scans: upload, look up, fetch back and delete.
#ifndef STRATA_CORE_API_SCANS_H_
#define STRATA_CORE_API_SCANS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <Eigen/Geometry>

#include "core/api/call.h"
#include "core/cloud/point_cloud.h"
#include "core/mls/mls_parameters.h"
#include "core/world/scan.h"

namespace strata::api {

// Largest number of points in one piece of a scan, so that a piece stays below 1 MiB on the wire
// (21 bytes a point with every column).
inline constexpr std::size_t kMaxPointsPerChunk = 40'000;

// Largest local map that is taken.
inline constexpr std::size_t kMaxLocalMapBytes = std::size_t{64} << 20;

// An upload under way. Not thread-safe. Destroying it before Finish() abandons the scan without a
// trace, unless the header announced its content_hash: what came of such a scan stays for a while,
// also over a restart, so that another upload of the same header can go on with it. That may be
// begun while this one is still there, which then answers ABORTED.
class ScanUpload {
 public:
  virtual ~ScanUpload() = default;

  // Points of the announced scan that were there when this upload began: Write() goes on behind
  // them. All of them if the scan is durable already: Finish() says so. 0 without a content_hash.
  virtual std::uint64_t points_held() const { return 0; }

  // The next points of the scan, in order: at most kMaxPointsPerChunk, with the columns the header
  // announced; rows, columns and origin of `chunk` are ignored (its origin must be zero). Blocks
  // while the server is busy. INVALID_ARGUMENT for points that are not finite (but NaN in organised
  // scans), too many, or in other columns.
  virtual absl::Status Write(const PointCloud& chunk) = 0;

  // Returns once the scan is durable. The same scan again is OK with `already_present`; the same id
  // with other content is ALREADY_EXISTS; fewer points than announced, or another hash of what came
  // than announced, is INVALID_ARGUMENT and nothing is kept; a full queue is RESOURCE_EXHAUSTED.
  virtual absl::StatusOr<ScanAck> Finish() = 0;
};

// How labels that a person gives a scan meet those that people gave it before.
enum class LabelMode : std::uint8_t {
  kReplace,  // they take their place, 0 included
  kUpdate,   // 0 leaves what was there
};

// Which scans; every given condition must hold.
struct ScanFilter {
  std::optional<std::string> trajectory;
  std::optional<ScanState> state;
  std::optional<absl::Time> from, until;  // half-open
  // Scans whose footprint meets this box [m]: the upright box in the map around the box of their
  // points in the scan frame, so it holds every point and may be larger than they are when turned.
  std::optional<Eigen::AlignedBox2d> box;
};

// Thread-safe.
class Scans {
 public:
  virtual ~Scans() = default;

  // Begins an upload. The header is checked here: INVALID_ARGUMENT, for more points than the server
  // takes of a scan too; RESOURCE_EXHAUSTED where too much waits already; ALREADY_EXISTS if the
  // scan is there with another content_hash than announced.
  virtual absl::StatusOr<std::unique_ptr<ScanUpload>> Upload(const Call& call,
                                                             absl::string_view map,
                                                             const ScanHeader& header) = 0;
  // A scan whose points stay with its robot, which sends the local map that it has made of them
  // (core/codec's local map bytes, in the scan frame, at most kMaxLocalMapBytes). It is aligned,
  // integrated, moved and deleted as any scan; at a pose it contributes what a scan contributes in
  // a map that drops points: every patch moves as a whole (TransformContribution() in
  // core/mls/join.h says what that approximates). It has no points to get, label or classify.
  // `parameters` are those that it was made with. Returns once it is durable; repeating it is OK
  // with `already_present`.
  // INVALID_ARGUMENT for a header that announces points, parameters that are not the map's, bytes
  // that are no local map, or one that reaches beyond ±1e6 m; ALREADY_EXISTS for the same id with
  // other content; RESOURCE_EXHAUSTED for one that is too large, or a full queue.
  virtual absl::StatusOr<ScanAck> UploadLocalMap(const Call& call,
                                                 absl::string_view map,
                                                 const ScanHeader& header,
                                                 const MlsParameters& parameters,
                                                 absl::string_view local_map) = 0;
  // What is committed of a trajectory; an unknown trajectory has `exists` false.
  virtual absl::StatusOr<UploadState> GetUploadState(const Call& call,
                                                     absl::string_view map,
                                                     absl::string_view trajectory) = 0;
  virtual absl::StatusOr<ScanInfo> Get(const Call& call,
                                       absl::string_view map,
                                       const ScanId& id) = 0;
  // In commit order. A sink's error ends it and is handed back; DATA_LOSS at its end: some damaged.
  virtual absl::Status List(const Call& call,
                            absl::string_view map,
                            const ScanFilter& filter,
                            absl::FunctionRef<absl::Status(const ScanInfo&)> sink) = 0;
  // The points as uploaded, in pieces of at most kMaxPointsPerChunk, with the labels that count:
  // where a person gave one (SetLabels), that; else the uploaded one; else what the classifier says
  // that labelled the scan last. FAILED_PRECONDITION if the map dropped them; DATA_LOSS if a stored
  // piece is damaged.
  virtual absl::Status GetPoints(const Call& call,
                                 absl::string_view map,
                                 const ScanId& id,
                                 absl::FunctionRef<absl::Status(const PointCloud&)> sink) = 0;
  // Which points of a scan have faded (job "fade"), and why: for each point, in order, how many
  // later scans looked through the place where it was; 0 if it has not. Empty if none has.
  // DATA_LOSS if the stored evidence is damaged.
  virtual absl::StatusOr<std::vector<std::uint16_t>> GetFaded(const Call& call,
                                                              absl::string_view map,
                                                              const ScanId& id) = 0;
  // What a person says the points of a scan are: one label each, in their order, 0 for none. Every
  // surface of the scan counts them when the call returns; uploaded labels stay as they are.
  // INVALID_ARGUMENT unless there are as many as points, none beyond kMaxClassId; NOT_FOUND;
  // FAILED_PRECONDITION if the map dropped the points.
  virtual absl::Status SetLabels(const Call& call,
                                 absl::string_view map,
                                 const ScanId& id,
                                 const std::vector<std::uint16_t>& labels,
                                 LabelMode mode) = 0;
  // Takes the scan, its points and its contribution out of the map.
  virtual absl::Status Delete(const Call& call, absl::string_view map, const ScanId& id) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_SCANS_H_

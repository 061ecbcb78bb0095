// What one map keeps, as plain values: the rows that storage hands out and takes in.
#ifndef STRATA_CORE_STORAGE_RECORDS_H_
#define STRATA_CORE_STORAGE_RECORDS_H_

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/mls/tile_key.h"
#include "core/world/constraint.h"
#include "core/world/job.h"
#include "core/world/map_info.h"
#include "core/world/scan.h"

namespace strata {

// A scan inside its map: the commit sequence of its acknowledgement. Never used twice.
using ScanNumber = std::uint64_t;

// Where a map stands on its one clock.
struct MapClock {
  std::uint64_t commit_sequence = 0;  // last value handed out in a committed transaction
  std::uint64_t epoch = 1;            // current epoch
  std::uint64_t tile_version = 0;     // tiles of this version and older are the current ones
  bool derived_complete = true;       // false: derived data must be rebuilt before they are used
};

// One thing that a commit made another, for those who watch the map.
struct StoredChange {
  std::uint64_t commit_sequence = 0;
  ScanId scan;   // whose state or pose is another, or that is gone; empty trajectory: a tile
  TileKey tile;  // of level 0
  std::uint64_t version = 0;
  bool gone = false;      // the tile
  bool inferred = false;  // neither of both, but what was inferred of things
};

struct StoredChanges {
  bool complete = false;  // false: not all of them are kept
  std::vector<StoredChange> changes;
};

// A map in which something waits for who has it.
struct WaitingMap {
  std::string name;
  bool scans = false;  // for integration
  bool jobs = false;
  std::uint64_t edits = 0;  // the number of the last one; 0: none
  bool deletion = false;    // of the map (EditKind::kDeleteMap)
};

// A parameter that no kind has, set on a job as it is stored while a server runs it that has not
// got the map: "HOLDER/TOKEN", by which the server's commits are told from those of one that has
// lost it.
inline constexpr char kRunBy[] = "run_by";
// The same of one whose proposal is in the store and to be applied, which only who has the map can.
inline constexpr char kAccepted[] = "accepted";

// A job of some map that waits or runs.
struct UnfinishedJob {
  std::string map;
  std::uint64_t id = 0;
  std::string kind;
  JobState state = JobState::kQueued;
  std::string run_by;     // kRunBy; empty: not set
  bool accepted = false;  // kAccepted
};

// A scan without its points.
struct ScanRecord {
  ScanNumber number = 0;
  ScanHeader header;
  ScanState state = ScanState::kPending;
  std::uint64_t upload = 0;  // whose chunks are its points
  std::uint32_t chunks = 0;  // 0 once the points were dropped
  bool has_points = true;    // false once the map dropped them after integration
  std::uint64_t point_bytes = 0;
  Eigen::AlignedBox3f box_scan;  // of the finite points in the scan frame; empty without any
  std::string content_hash;
  std::string message;             // why it failed, or which points are not in the map
  bool person_labels = false;      // it has labels of LabelOrigin::kPerson
  std::uint64_t label_model = 0;   // whose labels of LabelOrigin::kModel it has; 0: none
  std::uint64_t faded_points = 0;  // that LabelOrigin::kFaded has
};

// Points of an announced scan whose stream ended before it was whole: its chunks stay for a while,
// so that its client can go on with it.
struct UnfinishedUpload {
  std::uint64_t upload = 0;  // whose chunks they are
  ScanId id;
  std::string content_hash;                // as announced
  absl::Time touched = absl::UnixEpoch();  // when points last came; microseconds are kept
  std::uint32_t chunks = 0;
  std::uint64_t bytes = 0;  // of the chunks
};

// What only who has a map can do to it.
enum class EditKind : std::uint8_t {  // stored
  kSetPose = 1,
  kDeleteScan = 2,
  kSetLabels = 3,
  kUpdateLabels = 4,  // those that are 0 leave what people said
  kSetDefaultProfile = 5,
  kDeleteMap = 6,     // which is no work of its worker's: WaitingMap::deletion
  kTellInferred = 7,  // its watchers, that what is inferred is another: a job beside it has kept it
};

// An edit that is asked for where another process has the map.
struct EditRequest {
  std::uint64_t number = 0;  // in the order in which they were asked for
  EditKind kind = EditKind::kSetPose;
  ScanId scan;              // empty trajectory: of no scan
  std::string value;        // the pose, labels or profile (core/engine/ingest/edits.h)
  std::uint32_t begun = 0;  // how often, without an answer
};

// Who gave a scan labels after its upload.
enum class LabelOrigin : std::uint8_t {  // stored
  kPerson = 1,
  kModel = 2,  // the classifier that did so last
  // No label: how many later scans looked through the place of a point that has faded.
  kFaded = 3,
};

enum class PoseOrigin : std::uint8_t {  // stored
  kIngest = 1,
  kPerson = 2,
  kOptimize = 3,
  kRevert = 4,
};

// A recorded decision: where a scan is from `epoch` on, until a later epoch says otherwise.
struct PoseRecord {
  ScanNumber scan = 0;
  std::uint64_t epoch = 0;
  Pose T_map_scan = Pose::Identity();
  PoseOrigin origin = PoseOrigin::kIngest;
  AlignmentReport report;
};

// A scan with its pose in some epoch; no pose before integration.
struct PosedScan {
  ScanRecord scan;
  std::optional<PoseRecord> pose;
};

// A constraint between numbered scans; Constraint::i and ::j are filled in when it is read.
struct ConstraintRecord {
  ScanNumber scan_i = 0;  // 0: the map itself
  ScanNumber scan_j = 0;
  Constraint constraint;
};

// A plane with the numbers of its supporters, in the order of GlobalPlane::supports; their ids are
// filled in when it is read.
struct PlaneRecord {
  GlobalPlane plane;
  std::vector<ScanNumber> scans;
};

struct ProposedPose {
  ScanNumber scan = 0;
  Pose T_map_scan = Pose::Identity();
};

// What the process may die of.
enum class WorkKind : std::uint8_t {  // stored
  kScan = 1,                          // to be integrated
  kJob = 2,                           // to be run
  kRecovery = 3,                      // everything derived, to be made again after a start
  kLook = 4,                          // whether a job is due that nobody asked for
  kPrepare = 5,                       // tiles, for plans to come
};
struct WorkId {
  WorkKind kind = WorkKind::kScan;
  std::uint64_t id = 0;  // the scan's number, the job's id; 0 of the others
  friend auto operator<=>(const WorkId&, const WorkId&) = default;
};

// Work that is under way, or was when the process died.
struct Attempt {
  WorkId work;
  std::uint32_t deaths = 0;  // of the process while it was under way
  bool under_way = false;
};

// A kind of things, without its shape.
struct KindRow {
  std::uint64_t id = 0;
  std::string name;         // empty: nobody has named it
  bool in_library = false;  // truth; otherwise a job found it
  std::string info;         // core/completion's kind head
};

// One of the parts of what a job found.
struct EntityPart {
  std::uint64_t part = 0;
  std::string bytes;
};

// What global consistency keeps of a scan in its own frame, so that it need not be made twice;
// empty: not made yet.
struct ScanView {
  std::string place;   // its place descriptor
  std::string planes;  // its edges and planes
};

// Which scans; every given condition must hold.
struct ScanQuery {
  std::optional<std::string> trajectory;
  std::optional<ScanState> state;
  std::optional<absl::Time> from, until;   // half-open
  std::optional<Eigen::AlignedBox2d> box;  // meets the footprint [m]
  ScanNumber after = 0;                    // only scans with a larger number
  std::uint32_t limit = 1000;              // at most so many, by number
  bool skip_damaged = false;  // rows that cannot be read are left out instead of ending the list
};

struct ScanTotals {
  std::uint64_t scans = 0;
  std::uint64_t pending = 0;
  std::uint64_t failed = 0;
  std::uint64_t points = 0;
  std::uint64_t point_bytes = 0;
};

// A tile of full statistics (core/codec's MLS tile bytes), level 0.
struct MlsTileRow {
  TileKey key;
  std::uint64_t version = 0;
  std::uint64_t patches = 0;
  std::uint64_t cells = 0;
  // Σw and Σw(z − mean)² of the level surfaces that have five measurements or more, w = 1/σ² [m⁻²].
  double spread_weight = 0.0;
  double spread_sum = 0.0;
  Eigen::AlignedBox3d box;  // around its surfaces [m]
  std::string digest;       // content hash of `bytes`
  std::string bytes;        // empty in listings
};

// A tile as served (core/codec's surface tile bytes), any level of detail.
struct SurfaceTileRow {
  TileKey key;
  std::uint64_t version = 0;
  bool gone = false;  // from `version` on there is nothing here
  std::uint64_t patches = 0;
  std::uint64_t size_bytes = 0;
  std::string bytes;  // empty in listings
};

// What planning has prepared of a tile of level 0 for the map's default robot.
struct PreparedTileRow {
  TileKey key;
  std::string made_of;  // equal where preparing it again would give the same
  std::string bytes;    // empty in listings
};

// Tiles [x_min, x_max) × [y_min, y_max) of one level.
struct TileRange {
  std::int32_t level = 0;
  std::int64_t x_min = -(std::int64_t{1} << 31), x_max = std::int64_t{1} << 31;
  std::int64_t y_min = -(std::int64_t{1} << 31), y_max = std::int64_t{1} << 31;
};

// The box of a scan's points in the map: its box in the scan frame, turned, and the upright box
// around that. Holds every point; as tight as the turning allows.
Eigen::AlignedBox2d FootprintOf(const Eigen::AlignedBox3f& box_scan, const Pose& T_map_scan);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_RECORDS_H_

// The things of a kind as the scans of a map saw them.
#ifndef STRATA_CORE_ENGINE_OBJECTS_THING_VIEWS_H_
#define STRATA_CORE_ENGINE_OBJECTS_THING_VIEWS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/completion/shape_view.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/world/things/entity.h"

namespace strata {

// Of each thing, those that saw most of it.
inline constexpr std::size_t kMostScansOfThing = 24;
// That are in memory at a time, and voxels of theirs: some hundreds of megabytes at most.
inline constexpr std::size_t kMostThingViews = 64;
inline constexpr double kMostVoxelsAtATime = 4e7;

// A thing whose middle is hidden is several entities (SortIntoKinds); it is completed once.
struct WholeThing {
  Entity entity;                  // the one with most points, with the scans and points of all
  std::vector<UprightBox> boxes;  // of all, its own first
};

// Entities that stand in one place are one thing. REQUIRES: all have a kind, the same; those with
// most points first, which is the order of the things, too.
std::vector<WholeThing> WholeThingsOf(std::span<const Entity> entities);

// What all of the things reach, in the frame of their kind, and a little around it.
Eigen::AlignedBox3d BoxOfKind(std::span<const WholeThing> things);

// The least edge of voxels, from `voxel_m` on, that a view of the box can have [m].
double ShapeVoxelM(const Eigen::AlignedBox3d& box, double voxel_m);

// How many views of such a box may be in memory at a time; in [1, kMostThingViews].
std::size_t ThingsAtATime(const Eigen::AlignedBox3d& box, double voxel_m);

struct ThingViews {
  std::vector<ShapeView> views;       // one a thing
  absl::btree_set<ScanNumber> scans;  // what they are from
};

// Reads the scans that saw them, each once, with the poses of `epoch`; points that have faded are
// left out, and scans that were deleted, lost their points or are damaged. REQUIRES: at most
// ThingsAtATime() things; box and edge as ShapeView::Over() takes them. Errors of the store;
// CANCELLED, DEADLINE_EXCEEDED; RESOURCE_EXHAUSTED where rays fill too many voxels.
absl::StatusOr<ThingViews> ReadThingViews(MapCore& core,
                                          std::uint64_t epoch,
                                          std::span<const WholeThing> things,
                                          const Eigen::AlignedBox3d& box,
                                          double voxel_m,
                                          DamagedScans& damaged,
                                          const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_OBJECTS_THING_VIEWS_H_

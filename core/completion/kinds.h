// The entities of each class become kinds (thesis 11.2.1), and are recognised by kinds that are
// known (11.4).
#ifndef STRATA_CORE_COMPLETION_KINDS_H_
#define STRATA_CORE_COMPLETION_KINDS_H_

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/completion/entities.h"
#include "core/world/things/entity.h"
#include "core/world/things/kind.h"

namespace strata {

struct KindOptions {
  // Points that are so near to the surface of a kind lie on it; in [0.005, 1] [m]. Where points
  // are sparse, it grows with their spacing.
  double tolerance_m = 0.08;
  // Of an entity's points, so many lie on its kind; in (0, 1].
  double min_overlap = 0.85;
  // Of its kind's points, an entity of the same size has so many; in (0, 1].
  double min_cover = 0.65;
  // The same of an entity of which a part was seen; in (0, 1].
  double min_part_cover = 0.2;
  // RMS distance of points that lie on it from the surface, as a share of the tolerance; in (0, 1].
  double max_residual = 0.5;

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// Entities of a class that are looked at, the largest of them; others get no kind, so that time and
// memory stay bounded.
inline constexpr std::size_t kMostSortedEntities = 10'000;

struct SortedKinds {
  // Of each entity; nullopt: none.
  std::vector<std::optional<EntityKind>> of_entity;
  // Those that no library had, by class, then the largest reference first; without entities.
  std::vector<ThingKind> found;
  std::size_t left_out = 0;  // entities beyond kMostSortedEntities, and kMaxFoundKinds
};

// Each entity is compared with the few kinds of its class that are nearest to it by features
// (KindFeaturesOf, standardised): first cheaply by voxels, then by registration from turns about z
// and the sides of the box (trimmed ICP, point to plane). Kinds of the library come first. Of those
// left, the one with most points is the reference of a kind to come, which the others are matched
// to: those of its size both ways, then those that may be parts of it one way. At last what lies on
// the kind of a larger entity, where that stands, is a piece of it. A reference that nobody was
// matched to is no kind. Of what is lower than 10 cm only a library has kinds. Linear in the
// entities but for distances of features and places. Same entities and library, same kinds, bit for
// bit; one thread. `progress` takes shares in [0, 1]; its error, and that of `stop`, ends the work.
// REQUIRES: valid options, library of valid shapes.
absl::StatusOr<SortedKinds> SortIntoKinds(std::span<const FoundEntity> entities,
                                          std::span<const ThingKind> library,
                                          const KindOptions& options,
                                          const Stop& stop,
                                          absl::FunctionRef<absl::Status(double)> progress);

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_KINDS_H_

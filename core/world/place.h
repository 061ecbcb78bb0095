// Places: what the free cells of a floor are to who walks there.
#ifndef STRATA_CORE_WORLD_PLACE_H_
#define STRATA_CORE_WORLD_PLACE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata {

enum class PlaceKind : std::uint8_t { kRoom = 1, kCorridor = 2, kDoorway = 3 };
inline constexpr PlaceKind kPlaceKinds[] = {
    PlaceKind::kRoom, PlaceKind::kCorridor, PlaceKind::kDoorway};

// "room", "corridor", "doorway".
absl::string_view ToString(PlaceKind kind);

// Free cells of one block (FloorBlock): cell (i, j) is bit 8 j + i.
struct PlaceBlock {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::uint64_t cells = 0;

  friend bool operator==(const PlaceBlock&, const PlaceBlock&) = default;
};

// Connected free cells of one kind.
struct Place {
  PlaceKind kind = PlaceKind::kRoom;
  double area_m2 = 0.0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  // box around the cells [m]
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // of its cell nearest to the mean of all
  std::vector<int> neighbours;     // numbers of the places that it touches, rising
  std::vector<PlaceBlock> blocks;  // by (y, x); only where asked for
};

struct PlaceQuery {
  RobotProfile profile;
  // Whose places are asked for, by number as FindFloors has them of at least 10 m²; the largest
  // where neither is given, and not both.
  std::optional<int> floor = std::nullopt;
  std::optional<PlanEndpoint> at = std::nullopt;
  bool cells = false;  // fills Place::blocks
  InferredAs inferred = InferredAs::kIgnore;
};

struct FloorPlaces {
  std::vector<Place> places;  // the largest first
  std::optional<int> floor;   // none where the map has no floor
  std::string message;        // as of FloorPlan
  double cell_size_m = 0.0;
  std::uint64_t epoch = 0;
  std::uint64_t commit_sequence = 0;  // the state of the map that it is about
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_PLACE_H_

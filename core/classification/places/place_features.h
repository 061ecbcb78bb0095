// Places of a floor in numbers: samples of its free cells, what beams see from them, and which are
// beside each other.
#ifndef STRATA_CORE_CLASSIFICATION_PLACES_PLACE_FEATURES_H_
#define STRATA_CORE_CLASSIFICATION_PLACES_PLACE_FEATURES_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/classification/amn/network.h"
#include "core/classification/features/labelled_features.h"
#include "core/classification/places/free_space.h"
#include "core/common/stop.h"
#include "core/world/floor.h"

namespace strata {

// What is looked at at most: some 16 MB of cells, and 25 MB of features.
inline constexpr std::int64_t kMaxPlaceBoxCells = std::int64_t{1} << 24;
inline constexpr std::uint32_t kMaxPlaceSamples = 200'000;

// Beams of a sample, and how far they reach [m].
inline constexpr int kPlaceBeams = 180;
inline constexpr double kPlaceReachM = 15.0;
// About how far samples are from each other [m].
inline constexpr double kPlaceSpacingM = 0.3;

// Values of the cells of OpenSpace(): what is 0 is occupied, or nobody has seen it.
inline constexpr std::uint8_t kOpenGround = 1;  // no robot can be there
inline constexpr std::uint8_t kOpenFree = 2;

// The box around a floor's cells. `blocks` need not be sorted. RESOURCE_EXHAUSTED beyond
// kMaxPlaceBoxCells, naming the floor's size.
absl::StatusOr<FreeSpace> OpenSpace(std::span<const FloorBlock> blocks, double cell_size_m);

// Squares of cells, `side` × `side`, of whose free cells the one nearest to the middle is looked
// at. Squares begin at multiples of `side` cells of the map.
class PlaceSamples {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  // RESOURCE_EXHAUSTED beyond kMaxPlaceSamples.
  static absl::StatusOr<PlaceSamples> Of(const FreeSpace& space);

  std::uint32_t size() const { return static_cast<std::uint32_t>(cells_.size()); }
  // Column and row in the space of the cell that is looked at.
  const Eigen::Vector2i& cell(std::uint32_t sample) const { return cells_[sample]; }
  // The sample of a cell's square, or kNone.
  std::uint32_t SampleOf(int column, int row) const {
    return sample_of_[static_cast<std::size_t>((row + offset_.y()) / side_) * columns_ +
                      static_cast<std::size_t>((column + offset_.x()) / side_)];
  }
  // Between squares side by side.
  std::vector<NetworkEdge> Edges() const;

 private:
  int side_ = 1;
  Eigen::Vector2i offset_ = Eigen::Vector2i::Zero();  // from where squares begin to the space
  std::size_t columns_ = 0;                           // of squares
  std::vector<std::uint32_t> sample_of_;              // of every square, by rows
  std::vector<Eigen::Vector2i> cells_;                // by rows of squares
};

// RangeScanFeatures of every sample, those of `columns` only; all where it is empty. Errors are
// those of `stop`.
absl::StatusOr<FeatureMatrix> PlaceFeatures(const FreeSpace& space,
                                            const PlaceSamples& samples,
                                            std::span<const std::uint32_t> columns,
                                            const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_PLACES_PLACE_FEATURES_H_

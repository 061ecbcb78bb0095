// From points to the planes of a map: EM with main directions, the number of planes by BIC
// (thesis 5.3, 5.4), and their polygons (5.4.2).
#ifndef STRATA_CORE_PLANES_MODELS_PLANE_MODEL_FINDER_H_
#define STRATA_CORE_PLANES_MODELS_PLANE_MODEL_FINDER_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/world/plane_model.h"

namespace strata {

struct PlaneModelOptions {
  // ρ of 5.3, of one measurement: noise, waves of the surface and errors of poses together. 0: what
  // the points of each cell of surface spread about it, and 0.01 m; in [0, 1].
  double rho_m = 0.0;
  double sigma_rad = 0.03;  // σ of 5.13, of a normal about its main direction; in [0.001, 0.5]
  bool directions = true;   // false: EM without main directions
  // Planes are of one colour (thesis 5.5): a carpet is another than the floor that it lies on.
  bool colour = false;
  int max_planes = 500;  // in one square; in [1, 10000]
  double cell_size_m =
      0.8;  // of the largest cells of surface; the smallest are an eighth; [0.2, 20]
  double min_area_m2 = 1.0;  // of a plane's surface and of a polygon; in [0.01, 10000]
  // Points so near are one surface (ε of 5.4.2): the radius of the α-shape; in [0.05, 5].
  double epsilon_m = 0.25;
  // Of memory for what is known of all planes' surfaces, by which their outlines are drawn.
  std::size_t max_outline_bytes = std::size_t{384} << 20;

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

inline constexpr float kMostFromOriginM = 1000.0F;
// Of a surface that is seen, about: six in a cell of 0.8 m. With three times as many its outline
// has no gaps at ε = 0.25 m.
inline constexpr int kLeastPointsM2 = 10;

// Points of scans in the map frame, relative to `origin`.
struct PosedPoints {
  struct View {
    Eigen::Vector3f sensor;  // where the sensor stood, relative to `origin`
    std::size_t end = 0;     // its points end before this one; they begin at the last view's end
  };
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points;  // finite, within ±kMostFromOriginM
  std::vector<Colour> colour;           // of each, where options.colour; else empty
  std::vector<View> views;
};

// Squares of the plan, half-open; of a plane that reaches over several, each says what is in it.
using PlanSquare = Eigen::AlignedBox2d;

// Takes the squares of a map one after another, and each a second time for the polygons, so that
// memory grows with the surface, not with the points. The result depends on the order of the
// squares, on nothing else. Not thread-safe.
class PlaneModelFinder {
 public:
  // REQUIRES: valid options.
  explicit PlaneModelFinder(const PlaneModelOptions& options);
  ~PlaneModelFinder();

  // First round: the planes of a square. `points` are those of the square and of some metres around
  // it, so that a surface at its border is seen as on its other side. INVALID_ARGUMENT unless every
  // point has a colour where options.colour asks for them, and none where it does not.
  absl::Status FindPlanes(const PosedPoints& points, const PlanSquare& square, const Stop& stop);
  // After the last square: planes that go on in the next square are one, and get their directions.
  absl::Status JoinPlanes(const Stop& stop);
  // Second round: which of the planes the points of the square lie on, and which their rays cross.
  // RESOURCE_EXHAUSTED beyond max_outline_bytes, naming what takes less.
  absl::Status Look(const PosedPoints& points, const PlanSquare& square, const Stop& stop);
  // The planes with their polygons. REQUIRES: JoinPlanes(); squares that were not looked at have
  // none.
  absl::StatusOr<PlaneModel> Finish(const Stop& stop);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// All of it for points that are one square.
absl::StatusOr<PlaneModel> FindPlaneModel(const PosedPoints& points,
                                          const PlaneModelOptions& options,
                                          const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_PLANE_MODEL_FINDER_H_

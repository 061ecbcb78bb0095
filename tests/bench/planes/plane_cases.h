// Clouds whose planes are known, and how well found planes agree with them.
#ifndef STRATA_TESTS_BENCH_PLANE_CASES_H_
#define STRATA_TESTS_BENCH_PLANE_CASES_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/primitives.h"
#include "core/planes/models/plane_model_finder.h"

namespace strata::bench {

struct FoundPlane {
  Plane plane;  // relative to PosedPoints::origin
  std::vector<std::uint32_t> points;
};
// No point is in two of them.
using FoundPlanes = std::vector<FoundPlane>;

struct PlaneCase {
  static constexpr int kClutter = -1;  // on no plane
  static constexpr int kUnknown = -2;  // counts for nothing

  std::string name;
  PosedPoints points;
  std::vector<int> truth;            // of each point; a plane's number, kClutter or kUnknown
  std::vector<Plane> planes;         // relative to the origin of `points`
  std::vector<std::size_t> support;  // of each plane, points
  double near_m = 0.0;               // that its points are from a plane, and no farther
  std::size_t min_points = 0;        // of a plane
  double min_area_m2 = 0.0;          // the same, about
};

// Four furnished rooms seen from `stands` places, every solid's face a plane; 3 % of the points are
// clutter. Faces with less than min_points count for nothing.
PlaneCase DrawnRooms(std::uint64_t seed, int stands);
// CGAL's building with the segments that its file names.
PlaneCase RecordedBuilding(const std::filesystem::path& file);

// Of `found`, plane by plane in the order of their points: a plane belongs to the true one that
// most of its points are of, if their normals are within 10°, and its points of that one are right.
struct PlaneScore {
  std::size_t planes = 0;  // that were found
  double precision = 0.0;  // right ones of all points in found planes
  double recall = 0.0;     // mean over true planes: right ones of their points
  double median_deg =
      0.0;  // between the normals of a true plane and the largest that belongs to it
};
PlaneScore ScoreOf(const PlaneCase& truth, FoundPlanes found);
// The best recall that the largest planes of `found`, as many as one likes, have at a precision of
// at least `precision`; 0 where none has.
double RecallAt(const PlaneCase& truth, FoundPlanes found, double precision);

// Of the points those on each plane of the model: within its band and its polygons, or ε/2 beside
// them.
FoundPlanes PointsOn(const PlaneModel& model, const PosedPoints& points, double epsilon_m);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_PLANE_CASES_H_

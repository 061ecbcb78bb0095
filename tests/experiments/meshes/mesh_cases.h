// What the parts of mesh_methods share.
#ifndef STRATA_TESTS_EXPERIMENTS_MESHES_MESH_CASES_H_
#define STRATA_TESTS_EXPERIMENTS_MESHES_MESH_CASES_H_

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <nanoflann.hpp>

namespace strata::testing {

// What did not hold.
inline int failures = 0;
inline void Expect(bool holds, const std::string& what) {
  std::printf("%s: %s\n", holds ? "holds" : "FAILS", what.c_str());
  failures += holds ? 0 : 1;
}

template <typename T>
T OrDie(absl::StatusOr<T> value) {
  if (value.ok()) return *std::move(value);
  std::printf("%s\n", value.status().ToString().c_str());
  std::exit(1);
}
inline void OrDie(const absl::Status& status) {
  if (status.ok()) return;
  std::printf("%s\n", status.ToString().c_str());
  std::exit(1);
}

// Of the processor, of which others may want some.
inline double Seconds(const std::function<void()>& work) {
  const std::clock_t begin = std::clock();
  work();
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

// nanoflann's view of points; its method names are given.
struct PlacesView {
  std::vector<Eigen::Vector3d> points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const {
    return points[i][static_cast<Eigen::Index>(k)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};
using PlacesTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PlacesView>,
                                        PlacesView,
                                        3,
                                        std::uint32_t>;

// Table 4.2, the column of memory; voxels and cells of 0.2 m.
void RunMemory();
// What the methods make of recorded scans; closed where it must be, and the distance in less time
// than the bound.
void RunRecorded();

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_MESHES_MESH_CASES_H_

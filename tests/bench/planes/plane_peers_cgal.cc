#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Point_with_normal_3.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

#include "tests/bench/planes/plane_peers.h"

namespace strata::bench {

PointGroups CgalRansacPlanes(const PlaneCase& input) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  // With its index: the search reorders its input.
  using PointWithNormal = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::uint32_t>;
  using Points = std::vector<PointWithNormal>;
  using PointMap = CGAL::Nth_of_tuple_property_map<0, PointWithNormal>;
  using NormalMap = CGAL::Nth_of_tuple_property_map<1, PointWithNormal>;
  using Traits =
      CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Points, PointMap, NormalMap>;
  using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
  constexpr unsigned kNeighbours = 24;
  Points points;
  points.reserve(input.points.points.size());
  for (const Eigen::Vector3f& p : input.points.points) {
    points.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()),
                        Kernel::Vector_3(0.0, 0.0, 0.0),
                        static_cast<std::uint32_t>(points.size()));
  }
  CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
      points, kNeighbours, CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
  CGAL::get_default_random() = CGAL::Random(1);
  Ransac ransac;
  ransac.set_input(points);
  ransac.add_shape_factory<CGAL::Shape_detection::Plane<Traits>>();
  Ransac::Parameters parameters;
  parameters.probability = 0.05;
  parameters.min_points = input.min_points;
  parameters.epsilon = input.near_m;
  parameters.cluster_epsilon = 5.0 * input.near_m;
  parameters.normal_threshold = 0.9;
  ransac.detect(parameters);
  PointGroups groups;
  for (const auto& shape : ransac.shapes()) {
    std::vector<std::uint32_t> group;
    for (const std::size_t i : shape->indices_of_assigned_points()) {
      group.push_back(std::get<2>(points[i]));
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace strata::bench

#include "core/planes/models/alpha_polygons.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <boost/polygon/voronoi.hpp>

#include "core/common/disjoint_sets.h"
#include "core/common/hash_map.h"

namespace strata {
namespace {

using Diagram = boost::polygon::voronoi_diagram<double>;
using Edge = Diagram::edge_type;
using Vertex = Diagram::vertex_type;
using Site = boost::polygon::point_data<std::int32_t>;

constexpr double kUnitM = 1e-4;

// A border that comes to a point twice is several that touch there: the outer one of a region that
// hangs together over edges, and holes.
std::vector<FlatRing> SimpleRings(const FlatRing& border) {
  std::vector<FlatRing> rings;
  FlatRing open;
  HashMap<std::pair<double, double>, std::size_t> places;
  for (const Eigen::Vector2d& p : border) {
    const auto [place, is_new] = places.try_emplace({p.x(), p.y()}, open.size());
    if (is_new) {
      open.push_back(p);
      continue;
    }
    const auto begin = open.begin() + static_cast<std::ptrdiff_t>(place->second);
    rings.emplace_back(begin, open.end());
    for (auto q = begin + 1; q != open.end(); ++q) places.erase({q->x(), q->y()});
    open.erase(begin + 1, open.end());
  }
  rings.push_back(std::move(open));
  return rings;
}

// A vertex of the diagram is a face of the Delaunay triangulation, an edge crosses one of its
// edges. The faces of the shape are those near enough to their sites.
class Shape {
 public:
  Shape(const std::vector<Site>& sites, double radius) : sites_(sites), limit_(radius / kUnitM) {
    boost::polygon::construct_voronoi(sites.begin(), sites.end(), &diagram_);
    std::size_t count = 0;
    for (const Vertex& vertex : diagram_.vertices()) {
      const Site& site = SiteOf(*vertex.incident_edge());
      const double r = std::hypot(vertex.x() - site.x(), vertex.y() - site.y());
      vertex.color(r <= limit_ ? ++count : 0);
    }
    faces_ = count;
  }

  std::vector<FlatPolygon> Polygons() const {
    DisjointSets regions;
    for (const Edge& edge : diagram_.edges()) {
      if (Kept(edge.vertex0()) && Kept(edge.vertex1())) {
        regions.Join(edge.vertex0()->color(), edge.vertex1()->color());
      }
    }
    std::vector<FlatPolygon> polygons(faces_ + 1);
    for (const Edge& edge : diagram_.edges()) {
      if (edge.color() != 0 || !IsBorder(edge)) continue;
      FlatPolygon& polygon = polygons[regions.Root(edge.vertex0()->color())];
      for (FlatRing& ring : SimpleRings(Follow(edge))) {
        if (SignedArea(ring) > 0.0) {
          polygon.outer = std::move(ring);
        } else {
          polygon.holes.push_back(std::move(ring));
        }
      }
    }
    std::erase_if(polygons, [](const FlatPolygon& polygon) { return polygon.outer.empty(); });
    return polygons;
  }

 private:
  static bool Kept(const Vertex* vertex) { return vertex != nullptr && vertex->color() != 0; }
  // The face behind the edge is of the shape, that before it is not.
  static bool IsBorder(const Edge& edge) { return Kept(edge.vertex0()) && !Kept(edge.vertex1()); }
  const Site& SiteOf(const Edge& edge) const { return sites_[edge.cell()->source_index()]; }

  // The border through the Delaunay edges that are crossed, the shape on its left.
  FlatRing Follow(const Edge& first) const {
    FlatRing ring;
    const Edge* edge = &first;
    do {
      edge->color(1);
      const Site& site = SiteOf(*edge);
      ring.emplace_back(site.x() * kUnitM, site.y() * kUnitM);
      const Edge* next = edge->prev();
      while (Kept(next->vertex0())) next = next->prev();
      edge = next->twin();
    } while (edge != &first);
    return ring;
  }

  const std::vector<Site>& sites_;
  const double limit_;
  Diagram diagram_;
  std::size_t faces_ = 0;
};

}  // namespace

double SignedArea(const FlatRing& ring) {
  double sum = 0.0;
  for (std::size_t i = 0, last = ring.size() - 1; i < ring.size(); last = i++) {
    sum += ring[last].x() * ring[i].y() - ring[last].y() * ring[i].x();
  }
  return sum / 2.0;
}

double AreaOf(const FlatPolygon& polygon) {
  double area = SignedArea(polygon.outer);
  for (const FlatRing& hole : polygon.holes) area += SignedArea(hole);
  return area;
}

std::vector<FlatPolygon> AlphaPolygons(std::span<const Eigen::Vector2d> points, double radius) {
  std::vector<Site> sites;
  sites.reserve(points.size());
  for (const Eigen::Vector2d& p : points) {
    sites.emplace_back(static_cast<std::int32_t>(std::lround(p.x() / kUnitM)),
                       static_cast<std::int32_t>(std::lround(p.y() / kUnitM)));
  }
  std::sort(sites.begin(), sites.end());
  sites.erase(std::unique(sites.begin(), sites.end()), sites.end());
  if (sites.size() < 3) return {};
  std::vector<FlatPolygon> polygons = Shape(sites, radius).Polygons();
  std::stable_sort(polygons.begin(), polygons.end(), [](const auto& a, const auto& b) {
    return AreaOf(a) > AreaOf(b);
  });
  return polygons;
}

}  // namespace strata

#include "core/mesh/delaunay.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace strata {
namespace {

constexpr int kFlat = qh_ERRsingular;

// Frees what qhull holds, whatever became of it.
struct QhullMemory {
  qhT qhull{};
  ~QhullMemory() {
    int left = 0;
    int more = 0;
    qh_freeqhull(&qhull, !qh_ALL);
    qh_memfreeshort(&qhull, &left, &more);
  }
};

}  // namespace

absl::StatusOr<std::vector<Tetrahedron>> Triangulate(std::span<const Eigen::Vector3d> points) {
  std::vector<Tetrahedron> tetrahedra;
  if (points.size() < 5) return tetrahedra;
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d from_first = p - points.front();
    coordinates.insert(coordinates.end(), from_first.begin(), from_first.end());
  }
  // qhull says what it does not like to a file.
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> silence(std::fopen("/dev/null", "w"),
                                                                &std::fclose);
  if (silence == nullptr) return absl::InternalError("/dev/null cannot be opened");
  QhullMemory memory;
  qhT* const qh = &memory.qhull;
  qh_zero(qh, silence.get());
  char command[] = "qhull d Qbb Qc Qz Qt";
  const int failure = qh_new_qhull(qh,
                                   3,
                                   static_cast<int>(points.size()),
                                   coordinates.data(),
                                   False,
                                   command,
                                   nullptr,
                                   silence.get());
  if (failure == kFlat) return tetrahedra;
  if (failure != 0) {
    return absl::InternalError(
        absl::StrCat("the points have no triangulation: qhull's error ", failure));
  }
  const int count = static_cast<int>(points.size());
  facetT* facet = nullptr;
  FORALLfacets {
    if (facet->upperdelaunay) continue;
    Tetrahedron corners{};
    std::size_t known = 0;
    vertexT* vertex = nullptr;
    vertexT** vertexp = nullptr;
    FOREACHvertex_(facet->vertices) {
      const int id = qh_pointid(qh, vertex->point);
      // Not the point at infinity that Qz adds.
      if (known < 4 && id >= 0 && id < count) corners[known++] = static_cast<std::uint32_t>(id);
    }
    if (known != 4) continue;
    std::sort(corners.begin(), corners.end());
    tetrahedra.push_back(corners);
  }
  std::sort(tetrahedra.begin(), tetrahedra.end());
  return tetrahedra;
}

}  // namespace strata

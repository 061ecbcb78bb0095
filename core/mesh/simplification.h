// The same surface with fewer triangles.
#ifndef STRATA_CORE_MESH_SIMPLIFICATION_H_
#define STRATA_CORE_MESH_SIMPLIFICATION_H_

#include <cstddef>

#include "core/mesh/triangle_mesh.h"

namespace strata {

// Edges are collapsed in the order of the error that it makes (Garland and Heckbert 1997) until
// there are at most `target` triangles, or as few as can be without a hole being closed or two
// parts joined; small parts may vanish, and where parts lie close to each other edges get a third
// triangle. Where there are no more triangles, nothing changes. A pure function. Takes some 120
// bytes a triangle beside the mesh.
TriangleMesh Simplify(TriangleMesh mesh, std::size_t target);

}  // namespace strata

#endif  // STRATA_CORE_MESH_SIMPLIFICATION_H_

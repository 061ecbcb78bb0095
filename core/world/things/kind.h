// Kinds of things: what a class of a map has several entities of, with one shape (thesis 11.2.1,
// 11.4).
#ifndef STRATA_CORE_WORLD_THINGS_KIND_H_
#define STRATA_CORE_WORLD_THINGS_KIND_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <Eigen/Core>

namespace strata {

// Of a shape; more is refused.
inline constexpr std::size_t kMinKindPoints = 20;
inline constexpr std::size_t kMaxKindPoints = 20'000;
inline constexpr std::size_t kMaxKindVertices = 20'000;
inline constexpr std::size_t kMaxKindTriangles = 40'000;
inline constexpr double kMaxKindExtentM = 100.0;  // of any coordinate
// That a map's library holds, and that a search finds.
inline constexpr std::size_t kMaxKinds = 256;
inline constexpr std::size_t kMaxFoundKinds = 1'000;

// In the kind's own frame: z up, by its makers x along the box around it and zero in the middle of
// its base [m].
struct KindShape {
  std::vector<Eigen::Vector3f> points;
  // A surface; empty where it was seen and not drawn.
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  friend bool operator==(const KindShape&, const KindShape&) = default;
};

enum class KindOrigin : std::uint8_t {  // stored
  kFound = 1,                           // by a search of the map; goes with the next
  kNamed = 2,                           // found, and named by a person
  kImported = 3,
};

// "found", "named", "imported".
absl::string_view ToString(KindOrigin origin);

// A kind without its shape.
struct KindInfo {
  std::uint64_t id = 0;  // of its shape, so that it is the same in every map; in [1, 2⁴⁸)
  std::string name;      // unique in the map, ValidateName; empty: nobody has named it
  std::uint16_t class_id = 0;
  KindOrigin origin = KindOrigin::kFound;
  absl::Time made;                                 // when it was found, named first or imported
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  // of the upright box around its points [m]
  std::uint64_t points = 0;                        // of its shape
  std::uint64_t triangles = 0;
  std::uint64_t entities = 0;  // of the map's that are of it

  // Whether the library has it; otherwise the last search found it.
  bool in_library() const { return origin != KindOrigin::kFound; }
};

struct ThingKind {
  KindInfo info;
  KindShape shape;
};

// What a map is to know from now on.
struct NewKind {
  std::string name;
  std::string class_name;  // as in the map's table, to which it is added where it lacks
  KindShape shape;
};

// INVALID_ARGUMENT, naming what, for too few or too many points or triangles, numbers that are not
// finite or beyond kMaxKindExtentM, and triangles of vertices that are not there.
absl::Status ValidateKindShape(const KindShape& shape);

// Twelve hexadecimal digits.
std::string KindIdText(std::uint64_t id);

// The kind that `text` names: by its name, or by four or more first digits of its id that no other
// begins with. NOT_FOUND, INVALID_ARGUMENT where several begin so.
absl::StatusOr<KindInfo> KindCalled(const std::vector<KindInfo>& kinds, absl::string_view text);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_THINGS_KIND_H_

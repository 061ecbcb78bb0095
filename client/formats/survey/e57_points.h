// The points of one scan of an E57 file: a CompressedVector (ASTM E2807-11, 9).
#ifndef STRATA_CLIENT_FORMATS_SURVEY_E57_POINTS_H_
#define STRATA_CLIENT_FORMATS_SURVEY_E57_POINTS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// What a field of the points is to us.
enum class E57Role : std::uint8_t {
  kX,
  kY,
  kZ,
  kInvalid,  // not 0: the place is not known
  kIntensity,
  kRed,
  kGreen,
  kBlue,
  kTime,
  kLabel,
};
inline constexpr std::size_t kE57Roles = 10;

enum class E57Encoding : std::uint8_t { kInteger, kScaledInteger, kSingle, kDouble, kOther };

// One field of the points, that is one stream of bytes. Integers are what they are above their
// minimum, in as few bits as their maximum needs.
struct E57Field {
  std::optional<E57Role> role;  // none: passed over
  E57Encoding encoding = E57Encoding::kOther;
  std::int64_t minimum = std::numeric_limits<std::int64_t>::min();
  std::int64_t maximum = std::numeric_limits<std::int64_t>::max();
  double scale = 1.0;
  double offset = 0.0;
};

struct E57Points {
  std::uint64_t at = 0;  // physical place of the section
  std::uint64_t count = 0;
  std::vector<E57Field> fields;
  // Coordinates are range, azimuth and elevation, not x, y and z.
  bool spherical = false;
  // What is black and what is as bright as can be, of red, green and blue; nothing: as it comes.
  std::optional<std::array<double, 3>> colour_low, colour_high;
};

// Reads packet by packet: memory is that of the cloud. Points whose place is not known are left
// out. UNAVAILABLE; INVALID_ARGUMENT with what was expected, as for damaged pages.
absl::StatusOr<PointCloud> ReadE57Points(const std::filesystem::path& path,
                                         const E57Points& points);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_E57_POINTS_H_

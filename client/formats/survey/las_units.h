// In what unit a LAS file's coordinates are.
#ifndef STRATA_CLIENT_FORMATS_SURVEY_LAS_UNITS_H_
#define STRATA_CLIENT_FORMATS_SURVEY_LAS_UNITS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// A variable length record of a LAS file.
struct LasRecord {
  std::string user;
  std::uint16_t id = 0;
  std::string bytes;
};
// The one that says how points are compressed (LAZ).
inline constexpr char kLazUser[] = "laszip encoded";
inline constexpr std::uint16_t kLazId = 22204;

struct LasUnits {
  double horizontal_m = 1.0;
  double vertical_m = 1.0;
};

// Units of a coordinate system as well-known text (OGC 01-009, ISO 19162); none where it says none.
struct WktUnits {
  bool geographic = false;  // degrees: of an ellipsoid and not projected
  std::optional<double> horizontal_m;
  std::optional<double> vertical_m;
};
WktUnits UnitsOfWkt(absl::string_view wkt);

// By the GeoTIFF keys (ProjLinearUnits, VerticalUnits) or the well-known text among the records:
// that of the text, if `text_first`, else of the keys, where both speak. Heights without a unit of
// their own have that of the projection; a projection that is named by its number only (EPSG) is
// taken to be in metres. INVALID_ARGUMENT for degrees and for units of unknown length.
absl::StatusOr<LasUnits> LasUnitsOf(const std::vector<LasRecord>& records, bool text_first);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_LAS_UNITS_H_

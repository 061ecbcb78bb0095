// Numbers on a grid seen from above, as geographic information systems read them.
#ifndef STRATA_CLIENT_FORMATS_GRID_RASTER_WRITER_H_
#define STRATA_CLIENT_FORMATS_GRID_RASTER_WRITER_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/grid/local_projection.h"

namespace strata {

struct RasterBand {
  std::string name;           // letters, digits, blanks and brackets
  std::vector<float> values;  // by rows, the lowest y first; NaN: nothing is known
};

struct Raster {
  int width = 0;   // cells along x
  int height = 0;  // cells along y
  double cell_size_m = 0.0;
  double x_m = 0.0;  // lower left corner
  double y_m = 0.0;
  std::vector<RasterBand> bands;              // at least one
  std::optional<LocalProjection> projection;  // where it is on earth
};

// What AscText writes where nothing is known.
inline constexpr double kNoData = -9999.0;

// GeoTIFF 1.1 (OGC 19-008r4): floats, one band a plane, deflated; pixels are areas, NaN is no data.
// The same bytes each time. RESOURCE_EXHAUSTED beyond 4 GiB, INTERNAL if libtiff fails.
absl::StatusOr<std::string> GeoTiffBytes(const Raster& raster);

// An ESRI ASCII grid of one band, with 4 decimals.
std::string AscText(const Raster& raster, const RasterBand& band);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRID_RASTER_WRITER_H_

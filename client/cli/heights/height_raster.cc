#include "client/cli/heights/height_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/grid/local_projection.h"
#include "client/formats/grid/raster_writer.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

Raster RasterOf(Heights heights) {
  const ElevationMap& map = heights.map;
  Raster raster;
  raster.width = map.width;
  raster.height = map.height;
  raster.cell_size_m = map.cell_size_m;
  raster.x_m = map.corner.x * map.cell_size_m;
  raster.y_m = map.corner.y * map.cell_size_m;
  raster.bands = {{"height [m]", {}}, {"sigma [m]", {}}};
  for (RasterBand& band : raster.bands) band.values.reserve(map.cells.size());
  for (const ElevationCell& cell : map.cells) {
    raster.bands[0].values.push_back(cell.observed() ? cell.z_m : kNoHeight);
    raster.bands[1].values.push_back(cell.observed() ? cell.sigma_m : kNoHeight);
  }
  if (!heights.classes.empty()) {
    raster.bands.push_back({"class", std::move(heights.classes)});
  }
  return raster;
}

void PlaceOnEarth(const GeodeticOrigin& origin, Raster& raster) {
  const LocalProjection projection(origin);
  raster.projection = projection;
  std::vector<float>& heights = raster.bands.front().values;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const auto column = static_cast<double>(i % raster.width);
    const auto row = static_cast<double>(i / raster.width);
    heights[i] = static_cast<float>(
        projection.EllipsoidHeight({raster.x_m + (column + 0.5) * raster.cell_size_m,
                                    raster.y_m + (row + 0.5) * raster.cell_size_m,
                                    heights[i]}));
  }
}

// Writes a grid for each band; the files.
absl::StatusOr<Json> WriteGrids(const Raster& raster, const std::filesystem::path& out) {
  Json files = Json::array();
  const auto write = [&files](const std::filesystem::path& file, const std::string& bytes) {
    files.push_back(file.string());
    return WriteFileBytes(file, bytes);
  };
  constexpr const char* kSuffixes[] = {"", "-sigma", "-class"};
  for (std::size_t i = 0; i < raster.bands.size(); ++i) {
    std::filesystem::path file = out;
    file.replace_filename(
        absl::StrCat(out.stem().string(), kSuffixes[i], out.extension().string()));
    STRATA_RETURN_IF_ERROR(write(file, AscText(raster, raster.bands[i])));
    if (!raster.projection.has_value()) continue;
    STRATA_RETURN_IF_ERROR(write(file.replace_extension(".prj"), raster.projection->Wkt() + "\n"));
  }
  return files;
}

absl::StatusOr<Json> WriteRaster(const Raster& raster, const HeightFile& file) {
  if (file.format == "asc") return WriteGrids(raster, file.out);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, GeoTiffBytes(raster));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(file.out, bytes));
  return Json::array({file.out});
}

Json ReportOf(const Raster& raster, const std::string& surface) {
  const auto known = [](float value) { return !std::isnan(value); };
  const std::vector<float>& heights = raster.bands.front().values;
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const float height : heights) {
    low = std::fmin(low, height);
    high = std::fmax(high, height);
  }
  Json report = {
      {"surface", surface},
      {"width", raster.width},
      {"height", raster.height},
      {"cells", std::count_if(heights.begin(), heights.end(), known)},
      {"cell_size_m", raster.cell_size_m},
      {"corner", {raster.x_m, raster.y_m}},
      {"low", low},
      {"high", high},
      {"heights", raster.projection.has_value() ? "above the WGS 84 ellipsoid" : "of the map"}};
  for (const RasterBand& band : raster.bands) report["bands"].push_back(band.name);
  return report;
}

}  // namespace

absl::Status WriteHeights(Context& context,
                          Heights heights,
                          const std::optional<GeodeticOrigin>& origin,
                          const HeightFile& file) {
  Raster raster = RasterOf(std::move(heights));
  if (origin.has_value()) PlaceOnEarth(*origin, raster);
  Json report = {{"format", file.format}};
  STRATA_ASSIGN_OR_RETURN(report["files"], WriteRaster(raster, file));
  report.update(ReportOf(raster, file.surface));
  if (raster.projection.has_value() && !context.output.text()) {
    report["projection"] = raster.projection->Wkt();
  }
  context.output.Object(report);
  return absl::OkStatus();
}

}  // namespace strata::cli

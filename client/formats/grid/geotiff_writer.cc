// GeoTiffBytes of raster_writer.h, by libtiff and libgeotiff.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <geotiff/geotiff.h>
#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>
#include <tiffio.h>

#include "client/formats/grid/raster_writer.h"

namespace strata {
namespace {

// Tags of GDAL that QGIS, rasterio and others know, too.
constexpr std::uint32_t kTagMetadata = 42112;
constexpr std::uint32_t kTagNoData = 42113;

// A file in memory that libtiff seeks in.
struct MemoryFile {
  std::string bytes;
  std::size_t at = 0;

  static MemoryFile& Of(thandle_t handle) { return *static_cast<MemoryFile*>(handle); }
};

tmsize_t ReadMemory(thandle_t handle, void* to, tmsize_t size) {
  MemoryFile& file = MemoryFile::Of(handle);
  const std::size_t rest = file.bytes.size() - std::min(file.at, file.bytes.size());
  const std::size_t count = std::min(rest, static_cast<std::size_t>(size));
  if (count > 0) std::memcpy(to, file.bytes.data() + file.at, count);
  file.at += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t WriteMemory(thandle_t handle, void* from, tmsize_t size) {
  MemoryFile& file = MemoryFile::Of(handle);
  const auto count = static_cast<std::size_t>(size);
  if (file.bytes.size() < file.at + count) file.bytes.resize(file.at + count);
  std::memcpy(file.bytes.data() + file.at, from, count);
  file.at += count;
  return size;
}

toff_t SeekMemory(thandle_t handle, toff_t offset, int whence) {
  MemoryFile& file = MemoryFile::Of(handle);
  const std::size_t base = whence == SEEK_SET   ? 0
                           : whence == SEEK_CUR ? file.at
                                                : file.bytes.size();
  return file.at = base + offset;
}

int CloseMemory(thandle_t /*handle*/) { return 0; }
toff_t MemorySize(thandle_t handle) { return MemoryFile::Of(handle).bytes.size(); }

using Tiff = std::unique_ptr<TIFF, decltype(&XTIFFClose)>;

Tiff OpenMemory(MemoryFile& file) {
  TIFF* const tiff = XTIFFClientOpen("memory",
                                     "w",
                                     &file,
                                     ReadMemory,
                                     WriteMemory,
                                     SeekMemory,
                                     CloseMemory,
                                     MemorySize,
                                     nullptr,
                                     nullptr);
  if (tiff != nullptr) {
    static constexpr std::array<TIFFFieldInfo, 2> kFields = {
        TIFFFieldInfo{kTagMetadata,
                      TIFF_VARIABLE,
                      TIFF_VARIABLE,
                      TIFF_ASCII,
                      FIELD_CUSTOM,
                      1,
                      0,
                      const_cast<char*>("GDAL_METADATA")},
        TIFFFieldInfo{kTagNoData,
                      TIFF_VARIABLE,
                      TIFF_VARIABLE,
                      TIFF_ASCII,
                      FIELD_CUSTOM,
                      1,
                      0,
                      const_cast<char*>("GDAL_NODATA")}};
    TIFFMergeFieldInfo(tiff, kFields.data(), kFields.size());
  }
  return Tiff(tiff, &XTIFFClose);
}

std::string BandNames(const Raster& raster) {
  std::string xml = "<GDALMetadata>\n";
  for (std::size_t i = 0; i < raster.bands.size(); ++i) {
    absl::StrAppend(&xml,
                    "  <Item name=\"DESCRIPTION\" sample=\"",
                    i,
                    "\" role=\"description\">",
                    raster.bands[i].name,
                    "</Item>\n");
  }
  return xml + "</GDALMetadata>\n";
}

void SetTags(const Raster& raster, TIFF* tiff) {
  const auto bands = static_cast<int>(raster.bands.size());
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, raster.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, raster.height);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, bands);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_SEPARATE);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  if (bands > 1) {
    const std::string unspecified(2 * (raster.bands.size() - 1), '\0');  // uint16_t EXTRASAMPLE_…
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, bands - 1, unspecified.data());
  }
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_FLOATINGPOINT);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, std::max(1, (1 << 16) / raster.width));
  TIFFSetField(tiff, kTagMetadata, BandNames(raster).c_str());
  TIFFSetField(tiff, kTagNoData, "nan");
  const std::array<double, 3> scale = {raster.cell_size_m, raster.cell_size_m, 0.0};
  TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale.data());
  const double top_m = raster.y_m + raster.height * raster.cell_size_m;
  const std::array<double, 6> corner = {0.0, 0.0, 0.0, raster.x_m, top_m, 0.0};
  TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, corner.data());
}

// A transverse Mercator projection of its own, which no code stands for.
void SetProjection(const LocalProjection& projection, GTIF* keys) {
  const auto set_code = [keys](geokey_t key, int code) {
    GTIFKeySet(keys, key, TYPE_SHORT, 1, code);
  };
  const auto set_number = [keys](geokey_t key, double number) {
    GTIFKeySet(keys, key, TYPE_DOUBLE, 1, number);
  };
  set_code(GTModelTypeGeoKey, ModelTypeProjected);
  set_code(GeographicTypeGeoKey, GCS_WGS_84);
  set_code(GeogAngularUnitsGeoKey, Angular_Degree);
  set_code(ProjectedCSTypeGeoKey, KvUserDefined);
  GTIFKeySet(keys, PCSCitationGeoKey, TYPE_ASCII, 0, "Strata map");
  set_code(ProjectionGeoKey, KvUserDefined);
  set_code(ProjCoordTransGeoKey, CT_TransverseMercator);
  set_code(ProjLinearUnitsGeoKey, Linear_Meter);
  set_number(ProjNatOriginLatGeoKey, projection.latitude_deg());
  set_number(ProjNatOriginLongGeoKey, projection.longitude_deg());
  set_number(ProjScaleAtNatOriginGeoKey, projection.scale());
  set_number(ProjFalseEastingGeoKey, 0.0);
  set_number(ProjFalseNorthingGeoKey, 0.0);
}

bool SetKeys(const Raster& raster, TIFF* tiff) {
  const std::unique_ptr<GTIF, decltype(&GTIFFree)> keys(GTIFNew(tiff), &GTIFFree);
  if (keys == nullptr) return false;
  GTIFKeySet(keys.get(), GTRasterTypeGeoKey, TYPE_SHORT, 1, RasterPixelIsArea);
  if (raster.projection.has_value()) SetProjection(*raster.projection, keys.get());
  return GTIFWriteKeys(keys.get()) != 0;
}

bool WriteBands(const Raster& raster, TIFF* tiff) {
  std::vector<float> row(raster.width);  // libtiff turns it into differences in place
  for (std::size_t band = 0; band < raster.bands.size(); ++band) {
    const float* const values = raster.bands[band].values.data();
    for (int y = 0; y < raster.height; ++y) {
      const std::size_t begin = static_cast<std::size_t>(raster.height - 1 - y) * raster.width;
      std::copy_n(values + begin, raster.width, row.data());
      if (TIFFWriteScanline(tiff, row.data(), y, static_cast<std::uint16_t>(band)) < 0)
        return false;
    }
  }
  return true;
}

}  // namespace

absl::StatusOr<std::string> GeoTiffBytes(const Raster& raster) {
  const double bytes =
      4.0 * raster.width * raster.height * static_cast<double>(raster.bands.size());
  if (bytes > 4e9) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "geotiff: ", bytes, " bytes of numbers; at most 4e9 are written: take a smaller region"));
  }
  MemoryFile file;
  Tiff tiff = OpenMemory(file);
  if (tiff == nullptr) return absl::InternalError("geotiff: libtiff does not begin a file");
  SetTags(raster, tiff.get());
  const bool written = SetKeys(raster, tiff.get()) && WriteBands(raster, tiff.get());
  tiff.reset();
  if (!written) return absl::InternalError("geotiff: libtiff does not write the numbers");
  return std::move(file.bytes);
}

}  // namespace strata

// GeoTiffBytes of raster_writer.h, by libtiff. The tags that make a TIFF a GeoTIFF are written
// here: libgeotiff, which would, brings PROJ, its data and its network client.
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
#include <tiffio.h>

#include "client/formats/grid/raster_writer.h"

namespace strata {
namespace {

// OGC 19-008r4.
constexpr std::uint32_t kTagPixelScale = 33550;
constexpr std::uint32_t kTagTiepoint = 33922;
constexpr std::uint32_t kTagKeys = 34735;
constexpr std::uint32_t kTagDoubles = 34736;
constexpr std::uint32_t kTagAscii = 34737;
// Tags of GDAL that QGIS, rasterio and others know, too.
constexpr std::uint32_t kTagMetadata = 42112;
constexpr std::uint32_t kTagNoData = 42113;

TIFFFieldInfo FieldOf(std::uint32_t tag, TIFFDataType type, const char* name) {
  return {tag,
          TIFF_VARIABLE,
          TIFF_VARIABLE,
          type,
          FIELD_CUSTOM,
          1,
          type != TIFF_ASCII,
          const_cast<char*>(name)};
}

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

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

Tiff OpenMemory(MemoryFile& file) {
  // libtiff keeps pointers to them.
  static const std::array<TIFFFieldInfo, 7> kFields = {
      FieldOf(kTagPixelScale, TIFF_DOUBLE, "ModelPixelScale"),
      FieldOf(kTagTiepoint, TIFF_DOUBLE, "ModelTiepoint"),
      FieldOf(kTagKeys, TIFF_SHORT, "GeoKeyDirectory"),
      FieldOf(kTagDoubles, TIFF_DOUBLE, "GeoDoubleParams"),
      FieldOf(kTagAscii, TIFF_ASCII, "GeoAsciiParams"),
      FieldOf(kTagMetadata, TIFF_ASCII, "GDAL_METADATA"),
      FieldOf(kTagNoData, TIFF_ASCII, "GDAL_NODATA")};
  Tiff tiff(TIFFClientOpen("memory",
                           "w",
                           &file,
                           ReadMemory,
                           WriteMemory,
                           SeekMemory,
                           CloseMemory,
                           MemorySize,
                           nullptr,
                           nullptr),
            &TIFFClose);
  if (tiff != nullptr) TIFFMergeFieldInfo(tiff.get(), kFields.data(), kFields.size());
  return tiff;
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
  TIFFSetField(tiff, kTagPixelScale, 3, scale.data());
  const double top_m = raster.y_m + raster.height * raster.cell_size_m;
  const std::array<double, 6> corner = {0.0, 0.0, 0.0, raster.x_m, top_m, 0.0};
  TIFFSetField(tiff, kTagTiepoint, 6, corner.data());
}

// The directory of geo keys, each with a code, a number or a text; by number, as the standard
// wants.
class GeoKeys {
 public:
  void Code(std::uint16_t key, std::uint16_t code) { Add(key, 0, 1, code); }
  void Number(std::uint16_t key, double number) {
    Add(key, kTagDoubles, 1, doubles_.size());
    doubles_.push_back(number);
  }
  void Text(std::uint16_t key, const std::string& text) {
    Add(key, kTagAscii, text.size() + 1, ascii_.size());
    ascii_ += text + "|";
  }

  void Write(TIFF* tiff) {
    TIFFSetField(tiff, kTagKeys, static_cast<int>(entries_.size()), entries_.data());
    if (!doubles_.empty()) {
      TIFFSetField(tiff, kTagDoubles, static_cast<int>(doubles_.size()), doubles_.data());
    }
    if (!ascii_.empty()) TIFFSetField(tiff, kTagAscii, ascii_.c_str());
  }

 private:
  void Add(std::uint16_t key, std::uint32_t tag, std::size_t count, std::size_t value) {
    for (const std::size_t number : {std::size_t{key}, std::size_t{tag}, count, value}) {
      entries_.push_back(static_cast<std::uint16_t>(number));
    }
    ++entries_[3];
  }

  std::vector<std::uint16_t> entries_ = {1, 1, 1, 0};  // version, revision, minor, number of keys
  std::vector<double> doubles_;
  std::string ascii_;
};

// A transverse Mercator projection of its own, which no code stands for.
void SetKeys(const Raster& raster, TIFF* tiff) {
  constexpr std::uint16_t kUserDefined = 32767;
  GeoKeys keys;
  if (raster.projection.has_value()) keys.Code(1024, 1);  // model: projected
  keys.Code(1025, 1);                                     // pixels are areas
  if (raster.projection.has_value()) {
    const LocalProjection& projection = *raster.projection;
    keys.Code(2048, 4326);  // geodetic system: WGS 84
    keys.Code(2054, 9102);  // of angles: degree
    keys.Code(3072, kUserDefined);
    keys.Text(3073, "Strata map");
    keys.Code(3074, kUserDefined);
    keys.Code(3075, 1);     // method: transverse Mercator
    keys.Code(3076, 9001);  // of lengths: metre
    keys.Number(3080, projection.longitude_deg());
    keys.Number(3081, projection.latitude_deg());
    keys.Number(3082, 0.0);  // false easting
    keys.Number(3083, 0.0);  // false northing
    keys.Number(3092, projection.scale());
  }
  keys.Write(tiff);
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
  SetKeys(raster, tiff.get());
  const bool written = WriteBands(raster, tiff.get());
  tiff.reset();
  if (!written) return absl::InternalError("geotiff: libtiff does not write the numbers");
  return std::move(file.bytes);
}

}  // namespace strata

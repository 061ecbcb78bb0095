#include "client/formats/survey/las_units.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr absl::string_view kProjection = "LASF_Projection";
constexpr std::uint16_t kTextId = 2112;
constexpr std::uint16_t kKeysId = 34735;
constexpr std::uint16_t kKeyDoublesId = 34736;

// GeoTIFF keys (OGC 19-008r4) and the values that matter.
constexpr std::uint16_t kModelTypeKey = 1024;
constexpr std::uint16_t kGeographic = 2;
constexpr std::uint16_t kGeocentric = 3;
constexpr std::uint16_t kLinearUnitsKey = 3076;
constexpr std::uint16_t kLinearUnitSizeKey = 3077;
constexpr std::uint16_t kVerticalUnitsKey = 4099;
constexpr std::uint16_t kUserDefined = 32767;

struct CodedUnit {
  std::uint16_t code;  // of EPSG
  double metres;
};
constexpr CodedUnit kCodedUnits[] = {
    {9001, 1.0},
    {9002, 0.3048},           // international foot
    {9003, 1200.0 / 3937.0},  // US survey foot
    {9036, 1000.0},
};

// The value of a key, as it stands there or by its place among the doubles.
struct GeoKey {
  std::uint16_t value = 0;
  std::optional<double> real;
};

std::optional<double> DoubleAt(absl::string_view bytes, std::size_t index) {
  if (index >= bytes.size() / sizeof(double)) return std::nullopt;
  return ByteCursor(bytes.substr(index * sizeof(double))).Get<double>();
}

class GeoKeys {
 public:
  GeoKeys(absl::string_view keys, absl::string_view doubles) : keys_(keys), doubles_(doubles) {}

  std::optional<GeoKey> Find(std::uint16_t wanted) const {
    ByteCursor cursor(keys_);
    cursor.Take(6);
    const auto count = cursor.Get<std::uint16_t>();
    for (std::uint16_t i = 0; i < count && cursor.remaining() >= 8; ++i) {
      const auto key = cursor.Get<std::uint16_t>();
      const auto place = cursor.Get<std::uint16_t>();
      cursor.Take(2);
      const auto value = cursor.Get<std::uint16_t>();
      if (key != wanted) continue;
      if (place == kKeyDoublesId) return GeoKey{0, DoubleAt(doubles_, value)};
      if (place == 0) return GeoKey{value, std::nullopt};
    }
    return std::nullopt;
  }

 private:
  absl::string_view keys_;
  absl::string_view doubles_;
};

absl::Status NoLength(absl::string_view unit) {
  return absl::InvalidArgumentError(
      absl::StrCat("the projection's unit is ",
                   unit,
                   ", whose length is not known; reproject the "
                   "points to metres, for instance with 'pdal translate IN OUT reprojection "
                   "--filters.reprojection.out_srs=EPSG:…'"));
}

absl::Status Degrees() {
  return absl::InvalidArgumentError(
      "the coordinates are those of the ellipsoid (degrees) and of no projection; project them to "
      "metres, for instance with 'pdal translate IN OUT reprojection "
      "--filters.reprojection.out_srs=EPSG:…'");
}

// Nothing where the key is not there or says nothing.
absl::StatusOr<std::optional<double>> UnitOfKey(const GeoKeys& keys, std::uint16_t units_key) {
  const std::optional<GeoKey> key = keys.Find(units_key);
  if (!key.has_value() || key->value == 0) return std::nullopt;
  const auto* const coded =
      std::find_if(std::begin(kCodedUnits), std::end(kCodedUnits), [&key](const CodedUnit& unit) {
        return unit.code == key->value;
      });
  if (coded != std::end(kCodedUnits)) return coded->metres;
  const auto size = units_key == kLinearUnitsKey && key->value == kUserDefined
                        ? keys.Find(kLinearUnitSizeKey)
                        : std::nullopt;
  if (size.has_value() && size->real.has_value() && std::isnormal(*size->real)) return size->real;
  return NoLength(absl::StrCat("EPSG ", key->value));
}

enum class WktRole : std::uint8_t { kHorizontal, kVertical, kOther, kNone };

// What a unit within this part of a text is the unit of; kNone: what the part around it says.
WktRole RoleOf(absl::string_view keyword) {
  for (const char* name : {"PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS"}) {
    if (keyword == name) return WktRole::kHorizontal;
  }
  for (const char* name : {"VERT_CS", "VERTCRS", "VERTICALCRS"}) {
    if (keyword == name) return WktRole::kVertical;
  }
  for (const char* name : {"AXIS", "CS", "COMPD_CS", "COMPOUNDCRS"}) {
    if (keyword == name) return WktRole::kNone;
  }
  return WktRole::kOther;
}

// The place after the quoted name that begins at `at`.
std::size_t AfterQuotes(absl::string_view wkt, std::size_t at) {
  const std::size_t end = wkt.find('"', at + 1);
  return end == absl::string_view::npos ? wkt.size() : end + 1;
}

// Of 'UNIT["foot",0.3048]', from after the bracket.
std::optional<double> LengthAt(absl::string_view wkt, std::size_t at) {
  at = std::min(wkt.find('"', at), wkt.size());
  at = std::min(wkt.find(',', AfterQuotes(wkt, at)), wkt.size());
  if (at == wkt.size()) return std::nullopt;
  const absl::string_view rest = wkt.substr(at + 1);
  const std::optional<double> length =
      ParseNumber(absl::StripAsciiWhitespace(rest.substr(0, rest.find_first_of(",])"))));
  return length.has_value() && std::isnormal(*length) && *length > 0.0 ? length : std::nullopt;
}

absl::string_view KeywordBefore(absl::string_view wkt, std::size_t bracket) {
  std::size_t begin = bracket;
  while (begin > 0 && (absl::ascii_isalpha(static_cast<unsigned char>(wkt[begin - 1])) ||
                       wkt[begin - 1] == '_')) {
    --begin;
  }
  return wkt.substr(begin, bracket - begin);
}

void TakeUnit(std::optional<double> length, const std::vector<WktRole>& around, WktUnits& units) {
  const auto role =
      std::find_if(around.rbegin(), around.rend(), [](WktRole r) { return r != WktRole::kNone; });
  if (role == around.rend()) return;
  if (*role == WktRole::kHorizontal && !units.horizontal_m) units.horizontal_m = length;
  if (*role == WktRole::kVertical && !units.vertical_m) units.vertical_m = length;
}

absl::string_view RecordOf(const std::vector<LasRecord>& records,
                           std::uint16_t id,
                           absl::string_view user) {
  for (const LasRecord& record : records) {
    if (record.id == id && (user.empty() || record.user == user)) return record.bytes;
  }
  return {};
}

// Programs built on libLAS put the text under their own name.
WktUnits TextUnits(const std::vector<LasRecord>& records) {
  const absl::string_view text = RecordOf(records, kTextId, kProjection);
  const WktUnits units = UnitsOfWkt(text);
  return units.geographic || units.horizontal_m ? units
                                                : UnitsOfWkt(RecordOf(records, kTextId, "liblas"));
}

absl::StatusOr<WktUnits> KeyUnits(const std::vector<LasRecord>& records) {
  const GeoKeys keys(RecordOf(records, kKeysId, kProjection),
                     RecordOf(records, kKeyDoublesId, kProjection));
  WktUnits units;
  const std::optional<GeoKey> model = keys.Find(kModelTypeKey);
  units.geographic = model && (model->value == kGeographic || model->value == kGeocentric);
  if (units.geographic) return units;
  STRATA_ASSIGN_OR_RETURN(units.horizontal_m, UnitOfKey(keys, kLinearUnitsKey));
  STRATA_ASSIGN_OR_RETURN(units.vertical_m, UnitOfKey(keys, kVerticalUnitsKey));
  return units;
}

}  // namespace

WktUnits UnitsOfWkt(absl::string_view wkt) {
  WktUnits units;
  bool ellipsoid = false;
  bool projected = false;
  std::vector<WktRole> around;
  for (std::size_t i = 0; i < wkt.size(); ++i) {
    if (wkt[i] == '"') {
      i = AfterQuotes(wkt, i) - 1;
    } else if (wkt[i] == '[' || wkt[i] == '(') {
      const std::string keyword = absl::AsciiStrToUpper(KeywordBefore(wkt, i));
      if (keyword == "UNIT" || keyword == "LENGTHUNIT") TakeUnit(LengthAt(wkt, i), around, units);
      ellipsoid = ellipsoid || keyword == "GEOGCS" || keyword == "GEOGCRS" ||
                  keyword == "GEODCRS" || keyword == "GEOCCS" || keyword == "GEOGRAPHICCRS";
      around.push_back(RoleOf(keyword));
      projected = projected || around.back() == WktRole::kHorizontal;
    } else if ((wkt[i] == ']' || wkt[i] == ')') && !around.empty()) {
      around.pop_back();
    }
  }
  units.geographic = ellipsoid && !projected;
  return units;
}

absl::StatusOr<LasUnits> LasUnitsOf(const std::vector<LasRecord>& records, bool text_first) {
  const WktUnits text = TextUnits(records);
  const bool text_speaks = text.geographic || text.horizontal_m.has_value();
  WktUnits units = text;
  if (!text_first || !text_speaks) {
    STRATA_ASSIGN_OR_RETURN(units, KeyUnits(records));
    if (!units.geographic && !units.horizontal_m) units = text;
  }
  if (units.geographic) return Degrees();
  const double horizontal_m = units.horizontal_m.value_or(1.0);
  return LasUnits{horizontal_m, units.vertical_m.value_or(horizontal_m)};
}

}  // namespace strata

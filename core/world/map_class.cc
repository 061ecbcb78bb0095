#include "core/world/map_class.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/world/names.h"

namespace strata {
namespace {

// Hue, saturation and value, each in [0, 1].
Colour FromHsv(double hue, double saturation, double value) {
  const auto channel = [&](double n) {
    const double k = std::fmod(n + hue * 6.0, 6.0);
    const double share = std::fmax(0.0, std::fmin(std::fmin(k, 4.0 - k), 1.0));
    return static_cast<std::uint8_t>(std::lround(255.0 * value * (1.0 - saturation * share)));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

}  // namespace

absl::Status ValidateMapClass(const MapClass& map_class) {
  if (map_class.id < 1 || map_class.id > kMaxClassId) {
    return absl::InvalidArgumentError(
        absl::StrCat("class id = ", map_class.id, " is not in [1, ", kMaxClassId, "]"));
  }
  return ValidateName("class name", map_class.name);
}

MapClass ClassOf(const std::vector<MapClass>& classes, std::uint16_t id) {
  for (const MapClass& map_class : classes) {
    if (map_class.id == id) return map_class;
  }
  return {id, absl::StrCat(id), DefaultClassColour(id)};
}

absl::StatusOr<std::uint16_t> ClassIdOf(const std::vector<MapClass>& classes,
                                        absl::string_view text) {
  std::string names;
  for (const MapClass& map_class : classes) {
    if (map_class.name == text) return map_class.id;
    absl::StrAppend(&names, names.empty() ? "" : ", ", map_class.name);
  }
  std::uint32_t number = 0;
  if (absl::SimpleAtoi(text, &number) && number >= 1 && number <= kMaxClassId) {
    return static_cast<std::uint16_t>(number);
  }
  return absl::NotFoundError(absl::StrCat("class '",
                                          text.substr(0, 100),
                                          "' does not exist; there is ",
                                          names.empty() ? "none" : names));
}

absl::StatusOr<std::uint16_t> IdInTable(std::vector<MapClass>& table,
                                        const std::string& name,
                                        std::uint16_t id) {
  std::set<std::uint16_t> used;
  for (const MapClass& known : table) {
    if (known.name == name) return known.id;
    used.insert(known.id);
  }
  if (id < 1 || id > kMaxClassId || used.contains(id)) id = 1;
  while (used.contains(id) && id < kMaxClassId) ++id;
  if (used.contains(id)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("class ", name, ": all ", kMaxClassId, " ids of the map are in use"));
  }
  const MapClass added{id, name, DefaultClassColour(id)};
  STRATA_RETURN_IF_ERROR(ValidateMapClass(added));
  table.push_back(added);
  return id;
}

absl::Status ValidateLabels(std::span<const std::uint16_t> labels, std::uint64_t first_point) {
  const auto bad = std::find_if(
      labels.begin(), labels.end(), [](std::uint16_t label) { return label > kMaxClassId; });
  if (bad == labels.end()) return absl::OkStatus();
  const auto index = static_cast<std::uint64_t>(bad - labels.begin());
  return absl::InvalidArgumentError(absl::StrCat("label ",
                                                 *bad,
                                                 " of point ",
                                                 first_point + index,
                                                 " is not in [0, ",
                                                 kMaxClassId,
                                                 "], the ids of classes"));
}

Colour DefaultClassColour(std::uint16_t id) {
  // Steps of the golden angle never come close to an earlier hue soon; brightness tells apart those
  // that do.
  constexpr std::array<double, 3> kValues = {0.9, 0.65, 0.8};
  const double hue = std::fmod(0.08 + id * (std::numbers::phi - 1.0), 1.0);
  return FromHsv(hue, id % 2 == 0 ? 0.55 : 0.8, kValues[id % kValues.size()]);
}

}  // namespace strata

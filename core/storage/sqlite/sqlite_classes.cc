// Truth about what things are: classes.
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"

namespace strata {
namespace {

Colour ColourFrom(std::uint64_t rgb) {
  return {static_cast<std::uint8_t>(rgb >> 16 & 0xFF),
          static_cast<std::uint8_t>(rgb >> 8 & 0xFF),
          static_cast<std::uint8_t>(rgb & 0xFF)};
}

}  // namespace

absl::StatusOr<std::vector<MapClass>> SqliteReader::ListClasses() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row, database_.Prepare("SELECT id, name, colour FROM truth_class ORDER BY id"));
  std::vector<MapClass> classes;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    classes.push_back(
        {static_cast<std::uint16_t>(row.Int(0)), row.Text(1), ColourFrom(row.Unsigned(2))});
    return absl::OkStatus();
  }));
  return classes;
}

absl::Status SqliteWriter::PutClass(const MapClass& map_class) {
  const Colour& c = map_class.colour;
  const std::uint32_t rgb = std::uint32_t{c.r} << 16 | std::uint32_t{c.g} << 8 | c.b;
  const absl::Status put = RunSql(
      "INSERT INTO truth_class (id, name, colour) VALUES (?1, ?2, ?3) "
      "ON CONFLICT (id) DO UPDATE SET name = ?2, colour = ?3",
      std::uint32_t{map_class.id},
      map_class.name,
      rgb);
  if (!absl::IsAlreadyExists(put)) return put;
  return absl::AlreadyExistsError(
      absl::StrCat("class name ", map_class.name, " is another class's; choose another"));
}

}  // namespace strata

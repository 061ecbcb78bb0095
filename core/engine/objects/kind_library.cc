#include "core/engine/objects/kind_library.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/completion/kind_codec.h"
#include "core/completion/upright_box.h"
#include "core/world/map_class.h"
#include "core/world/names.h"

namespace strata {
namespace {

// In microseconds, as it is kept.
absl::Time NowKept() { return absl::FromUnixMicros(absl::ToUnixMicros(absl::Now())); }

absl::StatusOr<KindShape> ShapeOf(StorageReader& reader, std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(const std::optional<std::string> bytes, reader.FindKindShape(id));
  const std::string what = absl::StrCat("kind ", KindIdText(id));
  if (!bytes.has_value()) return absl::NotFoundError(absl::StrCat(what, " does not exist"));
  absl::StatusOr<KindShape> shape = DecodeKindShape(*bytes);
  if (!shape.ok()) return Annotate(shape.status(), what);
  if (KindIdOf(*shape) != id) {
    return absl::DataLossError(absl::StrCat(what, ": its shape is another one's"));
  }
  return shape;
}

absl::StatusOr<KindInfo> KindIn(StorageReader& reader, absl::string_view kind) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, KindsIn(reader));
  return KindCalled(kinds, kind);
}

// Whether the library can take one more called so, inside a commit.
absl::Status CheckRoom(StorageReader& reader, absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, KindsIn(reader));
  const auto count =
      std::count_if(kinds.begin(), kinds.end(), [](const KindInfo& k) { return k.in_library(); });
  if (static_cast<std::size_t>(count) < kMaxKinds) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "kind ", name, ": the library has ", count, " kinds, at most ", kMaxKinds, "; delete some"));
}

// The map's class of that name, to which it is added. Inside a commit.
absl::StatusOr<std::uint16_t> ClassCalled(StorageWriter& writer, const std::string& name) {
  STRATA_ASSIGN_OR_RETURN(std::vector<MapClass> table, writer.reader().ListClasses());
  const std::size_t known = table.size();
  STRATA_ASSIGN_OR_RETURN(const std::uint16_t id, IdInTable(table, name, 1));
  for (std::size_t i = known; i < table.size(); ++i) {
    STRATA_RETURN_IF_ERROR(writer.PutClass(table[i]));
  }
  return id;
}

Eigen::Vector3d SizeOf(const KindShape& shape) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : shape.points) points.push_back(p.cast<double>());
  return UprightBoxOf(points).size;
}

}  // namespace

absl::StatusOr<std::vector<KindInfo>> KindsIn(StorageReader& reader) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindRow> rows, reader.ListKinds());
  std::vector<KindInfo> kinds;
  for (const KindRow& row : rows) {
    absl::StatusOr<KindInfo> info = DecodeKindInfo(row.info);
    if (!info.ok()) return Annotate(info.status(), absl::StrCat("kind ", KindIdText(row.id)));
    if (info->id != row.id || info->in_library() != row.in_library) {
      return absl::DataLossError(
          absl::StrCat("kind ", KindIdText(row.id), ": its head is another one's"));
    }
    info->name = row.name;
    kinds.push_back(*std::move(info));
  }
  return kinds;
}

absl::StatusOr<std::vector<ThingKind>> LoadLibrary(MapCore& core, const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  std::vector<ThingKind> library;
  STRATA_RETURN_IF_ERROR(reader->Snapshot([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, KindsIn(*reader));
    for (const KindInfo& info : kinds) {
      STRATA_RETURN_IF_ERROR(stop.status());
      if (!info.in_library()) continue;
      STRATA_ASSIGN_OR_RETURN(KindShape shape, ShapeOf(*reader, info.id));
      library.push_back({info, std::move(shape)});
    }
    return absl::OkStatus();
  }));
  return library;
}

absl::StatusOr<bool> IsLibrary(StorageReader& reader, const std::vector<ThingKind>& library) {
  STRATA_ASSIGN_OR_RETURN(std::vector<KindRow> rows, reader.ListKinds());
  std::erase_if(rows, [](const KindRow& row) { return !row.in_library; });
  return std::equal(
      rows.begin(),
      rows.end(),
      library.begin(),
      library.end(),
      [](const KindRow& row, const ThingKind& kind) { return row.id == kind.info.id; });
}

absl::StatusOr<ThingKind> ReadKind(const MapState& state, absl::string_view kind) {
  ThingKind read;
  STRATA_RETURN_IF_ERROR(state.Snapshot([&](StorageReader& reader) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(read.info, KindIn(reader, kind));
    STRATA_ASSIGN_OR_RETURN(read.shape, ShapeOf(reader, read.info.id));
    return absl::OkStatus();
  }));
  return read;
}

absl::StatusOr<KindInfo> RenameKind(StorageWriter& writer,
                                    absl::string_view kind,
                                    absl::string_view name) {
  STRATA_RETURN_IF_ERROR(ValidateName("kind name", name));
  STRATA_ASSIGN_OR_RETURN(KindInfo info, KindIn(writer.reader(), kind));
  const bool known = info.in_library();
  info.name = std::string(name);
  if (known) {
    STRATA_RETURN_IF_ERROR(writer.RenameKind(info.id, name));
    return info;
  }
  STRATA_RETURN_IF_ERROR(CheckRoom(writer.reader(), name));
  STRATA_ASSIGN_OR_RETURN(const KindShape shape, ShapeOf(writer.reader(), info.id));
  info.origin = KindOrigin::kNamed;
  info.made = NowKept();
  STRATA_RETURN_IF_ERROR(
      writer.PutKind({info.id, info.name, true, EncodeKindInfo(info)}, EncodeKindShape(shape)));
  return info;
}

absl::StatusOr<ImportedKind> PrepareKind(const NewKind& kind) {
  STRATA_RETURN_IF_ERROR(ValidateName("kind name", kind.name));
  STRATA_RETURN_IF_ERROR(ValidateName("class name", kind.class_name));
  STRATA_RETURN_IF_ERROR(ValidateKindShape(kind.shape));
  ImportedKind imported;
  KindInfo& info = imported.info;
  info.id = KindIdOf(kind.shape);
  info.name = kind.name;
  info.origin = KindOrigin::kImported;
  info.made = NowKept();
  info.size = SizeOf(kind.shape);
  info.points = kind.shape.points.size();
  info.triangles = kind.shape.triangles.size();
  imported.class_name = kind.class_name;
  imported.shape = EncodeKindShape(kind.shape);
  return imported;
}

absl::Status PutImportedKind(StorageWriter& writer, ImportedKind& kind) {
  KindInfo& info = kind.info;
  STRATA_RETURN_IF_ERROR(CheckRoom(writer.reader(), info.name));
  STRATA_ASSIGN_OR_RETURN(info.class_id, ClassCalled(writer, kind.class_name));
  return writer.PutKind({info.id, info.name, true, EncodeKindInfo(info)}, kind.shape);
}

absl::Status DeleteKind(StorageWriter& writer, absl::string_view kind) {
  STRATA_ASSIGN_OR_RETURN(const KindInfo info, KindIn(writer.reader(), kind));
  if (info.in_library()) return writer.DeleteKind(info.id);
  return absl::FailedPreconditionError(
      absl::StrCat("kind ",
                   KindIdText(info.id),
                   " has no name: the next objects find would find it again; kinds that were "
                   "named or imported can be deleted"));
}

absl::Status CheckKinds(MapCore& core, const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, KindsIn(*reader));
  for (const KindInfo& info : kinds) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const absl::Status shape = ShapeOf(*reader, info.id).status();
    if (!absl::IsNotFound(shape)) STRATA_RETURN_IF_ERROR(shape);  // deleted since
  }
  return absl::OkStatus();
}

}  // namespace strata

#include "server/access/method_rights.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_split.h"
#include <google/protobuf/descriptor.h>

namespace strata::server {
namespace {

constexpr Right kRead = Right::kRead;
constexpr Right kWrite = Right::kWrite;
constexpr Right kAdmin = Right::kAdmin;

constexpr std::array kTable = {
    MethodRight{"Maps.Create", kAdmin, "name"},
    MethodRight{"Maps.Get", kRead, "name"},
    MethodRight{"Maps.List", kRead, ""},
    MethodRight{"Maps.Delete", kAdmin, "name"},
    MethodRight{"Maps.Stats", kRead, "name"},
    MethodRight{"Maps.History", kRead, "name"},
    MethodRight{"Maps.ListClasses", kRead, "name"},
    MethodRight{"Maps.SetClass", kWrite, "name"},
    MethodRight{"Maps.SetOrigin", kWrite, "name"},
    MethodRight{"Maps.Watch", kRead, "name"},
    MethodRight{"Maps.Backup", kAdmin, "name"},
    MethodRight{"Scans.Upload", kWrite, "start.map"},
    MethodRight{"Scans.Ingest", kWrite, "start.map"},
    MethodRight{"Scans.UploadLocalMap", kWrite, "start.map"},
    MethodRight{"Scans.GetUploadState", kRead, "map"},
    MethodRight{"Scans.Get", kRead, "map"},
    MethodRight{"Scans.List", kRead, "map"},
    MethodRight{"Scans.GetPoints", kRead, "map"},
    MethodRight{"Scans.GetFaded", kRead, "map"},
    MethodRight{"Scans.SetLabels", kWrite, "start.map"},
    MethodRight{"Scans.Delete", kWrite, "map"},
    MethodRight{"Tiles.Get", kRead, "map"},
    MethodRight{"Tiles.List", kRead, "map"},
    MethodRight{"Tiles.Fetch", kRead, "map"},
    MethodRight{"Planning.PlanPath", kRead, "map"},
    MethodRight{"Planning.CheckPath", kRead, "map"},
    MethodRight{"Planning.WatchPath", kRead, "map"},
    MethodRight{"Planning.ListFloors", kRead, "map"},
    MethodRight{"Planning.ListPlaces", kRead, "map"},
    MethodRight{"Planning.Explore", kRead, "map"},
    MethodRight{"Planning.CheckShape", kRead, "map"},
    MethodRight{"Planning.SampleSurfaces", kRead, "map"},
    MethodRight{"Planning.SetProfile", kWrite, "map"},
    MethodRight{"Planning.ListProfiles", kRead, "map"},
    MethodRight{"PoseGraph.Get", kRead, "map"},
    MethodRight{"PoseGraph.SetPose", kWrite, "map"},
    MethodRight{"PoseGraph.AddConstraint", kWrite, "map"},
    MethodRight{"PoseGraph.RemoveConstraint", kWrite, "map"},
    MethodRight{"PoseGraph.EnableConstraint", kWrite, "map"},
    MethodRight{"PoseGraph.LookupPose", kRead, "map"},
    MethodRight{"PoseGraph.Localize", kRead, "start.map"},
    MethodRight{"PoseGraph.Track", kRead, "start.map"},
    MethodRight{"Jobs.Start", kWrite, "map"},
    MethodRight{"Jobs.Get", kRead, "map"},
    MethodRight{"Jobs.List", kRead, "map"},
    MethodRight{"Jobs.Cancel", kWrite, "map"},
    MethodRight{"Jobs.Accept", kWrite, "map"},
    MethodRight{"Jobs.Revert", kWrite, "map"},
    MethodRight{"Jobs.Watch", kRead, "map"},
    MethodRight{"Classifiers.Get", kRead, "map"},
    MethodRight{"Classifiers.List", kRead, "map"},
    MethodRight{"Classifiers.Delete", kWrite, "map"},
    MethodRight{"Classifiers.Export", kRead, "map"},
    MethodRight{"Classifiers.Import", kWrite, "start.map"},
    MethodRight{"Models.GetPlaneModel", kRead, "map"},
    MethodRight{"Objects.ListEntities", kRead, "map"},
    MethodRight{"Objects.ListKinds", kRead, "map"},
    MethodRight{"Objects.GetKind", kRead, "map"},
    MethodRight{"Objects.RenameKind", kWrite, "map"},
    MethodRight{"Objects.ImportKind", kWrite, "map"},
    MethodRight{"Objects.DeleteKind", kWrite, "map"},
    MethodRight{"Objects.ListInferred", kRead, "map"},
};

}  // namespace

const MethodRight* FindMethodRight(absl::string_view method) {
  const auto* const found = std::find_if(
      kTable.begin(), kTable.end(), [&](const MethodRight& row) { return row.method == method; });
  return found == kTable.end() ? nullptr : found;
}

std::optional<std::string> MapNamedIn(const google::protobuf::Message& message,
                                      absl::string_view field) {
  const google::protobuf::Message* at = &message;
  for (const absl::string_view part : absl::StrSplit(field, '.')) {
    const auto* const found = at->GetDescriptor()->FindFieldByName(std::string(part));
    if (found == nullptr) return std::nullopt;
    if (found->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING) {
      return at->GetReflection()->GetString(*at, found);
    }
    if (!at->GetReflection()->HasField(*at, found)) return std::nullopt;
    at = &at->GetReflection()->GetMessage(*at, found);
  }
  return std::nullopt;
}

}  // namespace strata::server

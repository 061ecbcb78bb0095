#include "client/cli/objects/fetched_entities.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "client/cli/terminal/stale.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

constexpr std::size_t kMostEntityNames = 150;  // of more nobody could read them
constexpr double kEntityWidthPixels = 2.5;

}  // namespace

absl::StatusOr<FetchedEntities> FetchEntities(Context& context,
                                              const std::string& map,
                                              EntityQuery query,
                                              const std::string& class_name) {
  FetchedEntities fetched;
  STRATA_ASSIGN_OR_RETURN(fetched.classes, context.database.maps().ListClasses(context.call, map));
  if (!class_name.empty()) {
    STRATA_ASSIGN_OR_RETURN(query.class_id, ClassIdOf(fetched.classes, class_name));
  }
  STRATA_ASSIGN_OR_RETURN(
      fetched.info,
      context.database.objects().ListEntities(context.call, map, query, [&](const Entity& entity) {
        fetched.entities.push_back(entity);
        return absl::OkStatus();
      }));
  STRATA_ASSIGN_OR_RETURN(fetched.stale,
                          IsOfEarlierState(context,
                                           map,
                                           {fetched.info.epoch},
                                           "these entities are",
                                           "objects find finds them anew"));
  return fetched;
}

void AddEntities(const FetchedEntities& fetched, picture::Overlay& overlay) {
  std::map<std::uint16_t, std::size_t> counts;
  const bool named = fetched.entities.size() <= kMostEntityNames;
  for (const Entity& entity : fetched.entities) {
    ++counts[entity.class_id];
    const MapClass map_class = ClassOf(fetched.classes, entity.class_id);
    std::vector<Eigen::Vector3d> ring = BaseOf(entity.box);
    for (Eigen::Vector3d& p : ring) p.z() += entity.box.size.z();
    ring.push_back(ring.front());
    overlay.strokes.push_back({ring, map_class.colour, kEntityWidthPixels, false});
    if (!named) continue;
    overlay.names.push_back(
        {ring.front(), absl::AsciiStrToLower(absl::StrCat(map_class.name, " ", entity.id))});
  }
  for (const auto& [class_id, count] : counts) {
    const MapClass map_class = ClassOf(fetched.classes, class_id);
    overlay.legend.emplace_back(map_class.colour,
                                absl::AsciiStrToLower(absl::StrCat(count, " ", map_class.name)));
  }
}

}  // namespace strata::cli

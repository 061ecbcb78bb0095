// The things in a map as commands ask for them.
#ifndef STRATA_CLIENT_CLI_OBJECTS_FETCHED_ENTITIES_H_
#define STRATA_CLIENT_CLI_OBJECTS_FETCHED_ENTITIES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/cli/picture/map_picture.h"
#include "client/cli/terminal/command.h"
#include "core/world/map_class.h"
#include "core/world/things/entity.h"

namespace strata::cli {

struct FetchedEntities {
  EntitiesInfo info;
  std::vector<Entity> entities;
  std::vector<MapClass> classes;  // the map's table
  bool stale = false;             // of an earlier epoch than the map's, which is said on stderr
};

// `class_name`: only this class, by name or number; empty: all. NOT_FOUND where objects find has
// found none, and for a class that the map does not have.
absl::StatusOr<FetchedEntities> FetchEntities(Context& context,
                                              const std::string& map,
                                              EntityQuery query,
                                              const std::string& class_name);

// Their boxes in the colours of their classes, with class and id beside each where they are few.
void AddEntities(const FetchedEntities& fetched, picture::Overlay& overlay);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_OBJECTS_FETCHED_ENTITIES_H_

// The things in a map as files.
#ifndef STRATA_CLIENT_CLI_OBJECTS_ENTITY_FILES_H_
#define STRATA_CLIENT_CLI_OBJECTS_ENTITY_FILES_H_

#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/status.h"

#include "client/cli/objects/fetched_entities.h"
#include "client/cli/terminal/output.h"
#include "core/egomotion/geodesy.h"

namespace strata::cli {

// What people call its kind: its name, or its id while it has none; empty: of none.
std::string KindText(const Entity& entity);

// {"id", "kind", "class", …, "scans": {"run/1": points}}.
Json EntityJson(const Entity& entity, const std::vector<MapClass>& classes);

// A FeatureCollection (RFC 7946), a Feature with the base of its box as Polygon for each entity;
// coordinates as in those of planes (client/formats/planes), "frame" says which.
std::string EntitiesGeoJson(const FetchedEntities& fetched, const std::optional<LocalFrame>& earth);
// A head and a line for each: id,class,x,y,z,length,width,height,yaw,points,scans,kind; metres,
// radians.
std::string EntitiesCsv(const FetchedEntities& fetched);

// By the ending of the file's name: .geojson, .csv. INVALID_ARGUMENT naming these for another one,
// FAILED_PRECONDITION if the file cannot be written.
absl::Status WriteEntities(const std::filesystem::path& path,
                           const FetchedEntities& fetched,
                           const std::optional<LocalFrame>& earth);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_OBJECTS_ENTITY_FILES_H_

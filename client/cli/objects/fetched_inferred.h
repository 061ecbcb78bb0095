// What was inferred of the things in a map, as commands ask for it.
#ifndef STRATA_CLIENT_CLI_OBJECTS_FETCHED_INFERRED_H_
#define STRATA_CLIENT_CLI_OBJECTS_FETCHED_INFERRED_H_

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/picture/map_picture.h"
#include "client/cli/terminal/command.h"
#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"

namespace strata::cli {

struct FetchedInferred {
  InferredInfo info;
  std::vector<InferredPart> parts;
  std::size_t points = 0;  // of all parts
  bool stale = false;      // of an earlier epoch than the map's, which is said on stderr
};

// `class_name`: only of this class, by name or number; empty: of all. NOT_FOUND where objects
// complete has inferred nothing, and for a class that the map does not have.
absl::StatusOr<FetchedInferred> FetchInferred(Context& context,
                                              const std::string& map,
                                              EntityQuery query,
                                              const std::string& class_name);

// By the ending of the file's name: .ply, .pcd, with the entity's id modulo 2¹⁶ as label.
// INVALID_ARGUMENT naming these for another one, FAILED_PRECONDITION if it cannot be written.
absl::Status WriteInferred(const std::filesystem::path& path, const FetchedInferred& fetched);

// Hatched: a short stroke through each place that something was inferred at.
void AddInferred(const FetchedInferred& fetched, picture::Overlay& overlay);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_OBJECTS_FETCHED_INFERRED_H_

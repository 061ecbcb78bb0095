// Kinds of things as files.
#ifndef STRATA_CLIENT_CLI_OBJECTS_KIND_FILES_H_
#define STRATA_CLIENT_CLI_OBJECTS_KIND_FILES_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/world/things/kind.h"

namespace strata::cli {

// .kind: what WriteKindFile() wrote; .stl .obj .ply: a mesh, z up, in metres times `scale`, without
// names. INVALID_ARGUMENT naming the endings for another one, and the file for what is wrong in it;
// NOT_FOUND.
absl::StatusOr<NewKind> ReadKindFile(const std::string& file, double scale);

// INVALID_ARGUMENT for another ending than .kind, naming those of meshes, too.
absl::Status CheckKindFile(const std::string& file);

// INVALID_ARGUMENT for another ending than .kind; FAILED_PRECONDITION if it cannot be written.
absl::Status WriteKindFile(const std::string& file, const NewKind& kind);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_OBJECTS_KIND_FILES_H_

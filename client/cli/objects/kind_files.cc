#include "client/cli/objects/kind_files.h"

#include <cstdint>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

#include "client/formats/file_bytes.h"
#include "client/formats/shapes/shape_reader.h"
#include "core/common/status.h"
#include "core/completion/kind_codec.h"
#include "core/completion/mesh_kind.h"
#include "core/world/shape.h"

namespace strata::cli {
namespace {

constexpr std::uintmax_t kMostKindFileBytes = std::uintmax_t{2} << 20;

std::string EndingOf(const std::string& file) {
  return absl::AsciiStrToLower(std::filesystem::path(file).extension().string());
}

absl::StatusOr<NewKind> ReadKindBytes(const std::string& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size > kMostKindFileBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": ", size, " bytes, a kind has at most ", kMostKindFileBytes));
  }
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(file));
  absl::StatusOr<NewKind> kind = DecodeKindFile(bytes);
  if (kind.ok()) return kind;
  return absl::InvalidArgumentError(absl::StrCat(file, ": ", kind.status().message()));
}

absl::StatusOr<NewKind> ReadMesh(const std::string& file, double scale) {
  STRATA_ASSIGN_OR_RETURN(CollisionShape mesh, ReadShape(file));
  for (Eigen::Vector3f& vertex : mesh.vertices) vertex *= static_cast<float>(scale);
  absl::StatusOr<KindShape> shape = KindShapeOfMesh(mesh.vertices, mesh.triangles);
  if (!shape.ok()) return Annotate(shape.status(), file);
  NewKind kind;
  kind.shape = *std::move(shape);
  return kind;
}

}  // namespace

absl::StatusOr<NewKind> ReadKindFile(const std::string& file, double scale) {
  const std::string ending = EndingOf(file);
  if (ending == ".kind") return ReadKindBytes(file);
  for (const char* mesh : {".stl", ".obj", ".ply"}) {
    if (ending == mesh) return ReadMesh(file, scale);
  }
  return absl::InvalidArgumentError(
      absl::StrCat(file, ": kinds are .kind files of kind export, or meshes (.stl, .obj, .ply)"));
}

absl::Status CheckKindFile(const std::string& file) {
  if (EndingOf(file) == ".kind") return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "kinds are written as .kind, or as meshes (.ply, .obj, .stl, .glb); got ", file));
}

absl::Status WriteKindFile(const std::string& file, const NewKind& kind) {
  STRATA_RETURN_IF_ERROR(CheckKindFile(file));
  return WriteFileBytes(file, EncodeKindFile(kind));
}

}  // namespace strata::cli

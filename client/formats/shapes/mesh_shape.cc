#include "client/formats/shapes/mesh_shape.h"

#include <cstdint>
#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <assimp/Importer.hpp>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

namespace strata {
namespace {

// Whether the library gives what is up in the file along y: glTF has it so, and files of Collada it
// turns, whatever they say themselves.
bool ComesWithYUp(const std::filesystem::path& file) {
  const std::string ending = absl::AsciiStrToLower(file.extension().string());
  return ending == ".glb" || ending == ".gltf" || ending == ".dae";
}

}  // namespace

absl::Status AddMeshFile(const std::string& file, const Eigen::Affine3d& T, CollisionShape& shape) {
  if (!std::filesystem::is_regular_file(file)) {
    return absl::NotFoundError(absl::StrCat(file, " is not there"));
  }
  Assimp::Importer importer;
  // Of the file's nodes each mesh where they say; points and lines are left out.
  const aiScene* const scene = importer.ReadFile(
      file,
      aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_PreTransformVertices);
  if (scene == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, " is no mesh that can be read: ", importer.GetErrorString()));
  }
  const std::size_t before = shape.triangles.size();
  const bool y_up = ComesWithYUp(file);
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(shape.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const Eigen::Vector3d z_up =
          y_up ? Eigen::Vector3d(p.x, -p.z, p.y) : Eigen::Vector3d(p.x, p.y, p.z);
      shape.vertices.emplace_back((T * z_up).cast<float>());
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      shape.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  if (shape.triangles.size() > before) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(file, " has no triangles"));
}

}  // namespace strata

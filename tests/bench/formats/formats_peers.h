// PCL's readers and writers, behind a door of our own: PCL's headers take long to compile.
#ifndef STRATA_TESTS_BENCH_FORMATS_PEERS_H_
#define STRATA_TESTS_BENCH_FORMATS_PEERS_H_

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata::bench {

enum class FileKind : std::uint8_t { kBinaryPcd, kCompressedPcd, kAsciiPcd, kBinaryPly };

// A file as PCL's readers give it to most of its users: a cloud of pcl::PointXYZ.
class PclCloud {
 public:
  PclCloud();
  ~PclCloud();

  // By the name's ending, .pcd or .ply; false if PCL says that it could not.
  bool Read(const std::filesystem::path& path);
  // In the file's coordinates; those that are not finite are left out.
  std::vector<Eigen::Vector3f> FinitePoints() const;

 private:
  struct Cloud;
  std::unique_ptr<Cloud> cloud_;
};

// A file of x y z, with intensity or else rgb where the cloud has them; false if PCL says that it
// could not.
bool WriteWithPcl(const PointCloud& cloud, FileKind kind, const std::filesystem::path& path);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_FORMATS_PEERS_H_

// A recording as a chain of pairwise registrations with PCL, what people have without a map: every
// scan is registered to the one before, from their uploaded relative pose.
//
//   icp_chain FOLDER OUT [--method icp|gicp]
//
// FOLDER holds scans/ and poses_initial.txt; OUT gets a line "index time x y z qx qy qz qw" a scan.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "tests/bench/poses/registration_peers.h"
#include "tests/support/pcd.h"

namespace strata {
namespace {

int Main(int argc, char** argv) {
  CLI::App app("a chain of pairwise registrations with PCL");
  std::filesystem::path folder;
  std::filesystem::path out_file;
  std::string method = "icp";
  app.add_option("FOLDER", folder, "a recording")->required();
  app.add_option("OUT", out_file, "poses")->required();
  app.add_option("--method", method)->check(CLI::IsMember({"icp", "gicp"}))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const bench::Peer peer = method == "icp" ? bench::Peer::kIcp : bench::Peer::kGicp;

  const auto uploaded = testing::ReadIndexedPoses(folder / "poses_initial.txt").value();
  std::ofstream out(out_file);
  out.precision(12);
  Pose T_map_scan = Pose::Identity();
  Pose previous_uploaded = Pose::Identity();
  std::optional<PointCloud> previous;
  for (const auto& [index, path] : testing::ListScans(folder / "scans")) {
    PointCloud cloud = testing::ReadBinaryPcd(path).value();
    const Pose& pose = uploaded.at(index).T_world_scan;
    const Pose guess = previous_uploaded.inverse() * pose;
    T_map_scan = Normalized(
        T_map_scan *
        (previous.has_value() ? bench::RegisterWithPcl(peer, cloud, *previous, guess) : guess));
    const Eigen::Quaterniond q(T_map_scan.linear());
    out << index << ' ' << uploaded.at(index).time_s << ' ' << T_map_scan.translation().transpose()
        << ' ' << q.coeffs().transpose() << '\n';
    previous = std::move(cloud);
    previous_uploaded = pose;
  }
  return out ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }

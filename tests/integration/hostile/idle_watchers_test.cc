// More watchers than a server takes calls, on a real stratad.
#include <cstdint>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "client/sdk/client.h"
#include "strata/v1/maps.grpc.pb.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "world";
constexpr int kWatchers = 1100;

// CPU time of a process so far [s].
double CpuSeconds(pid_t pid) {
  std::ifstream file(absl::StrCat("/proc/", pid, "/stat"));
  std::stringstream stat;
  stat << file.rdbuf();
  std::istringstream fields(stat.str().substr(stat.str().rfind(')') + 1));
  constexpr int kSkipped = 11;  // of those after the name
  std::string skipped;
  for (int i = 0; i < kSkipped; ++i) fields >> skipped;
  double user = 0.0;
  double system = 0.0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

TEST(IdleWatchersTest, AThousandOfThemLeaveRoomForCallsAndAreAllTold) {
  const TempDir directory;
  StratadProcess stratad({"--data", directory.path().string(), "--listen", "127.0.0.1:0"});
  ClientOptions options;
  options.target = stratad.Address();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto db, Connect(options));
  STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));

  const auto stub =
      v1::Maps::NewStub(grpc::CreateChannel(stratad.Address(), grpc::InsecureChannelCredentials()));
  v1::WatchMapRequest in;
  in.set_name(kMap);
  v1::WatchMapResponse message;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>>> watches;
  for (int i = 0; i < kWatchers; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    watches.push_back(stub->Watch(contexts.back().get(), in));
    ASSERT_TRUE(watches.back()->Read(&message)) << i;
  }
  const double before = CpuSeconds(stratad.pid());
  const absl::Time begun = absl::Now();
  absl::SleepFor(absl::Seconds(2));
  const double share =
      (CpuSeconds(stratad.pid()) - before) / absl::ToDoubleSeconds(absl::Now() - begun);
  std::cout << kWatchers << " idle watchers take " << share << " of a core" << std::endl;

  ScanHeader header;
  header.id = {"run", 1};
  header.point_count = 1;
  PointCloud cloud;
  cloud.points.emplace_back(1.0F, 0.0F, 0.0F);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto upload, db->scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(upload->Write(cloud));
  STRATA_ASSERT_OK(upload->Finish());
  for (const auto& watch : watches) {
    do {
      ASSERT_TRUE(watch->Read(&message));
    } while (message.scans_size() == 0);
    EXPECT_EQ(message.scans(0).id().trajectory(), "run");
  }
  for (const auto& context : contexts) context->TryCancel();
  for (const auto& watch : watches) watch->Finish();
}

}  // namespace
}  // namespace strata::testing

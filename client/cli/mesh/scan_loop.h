// Goes over all scans of a mesh, several times, and shows how far it is.
#ifndef STRATA_CLIENT_CLI_MESH_SCAN_LOOP_H_
#define STRATA_CLIENT_CLI_MESH_SCAN_LOOP_H_

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/progress.h"
#include "core/common/status.h"

namespace strata::cli {

class ScanLoop {
 public:
  // `rounds`: that there will be, at most.
  ScanLoop(Context& context, const ScanClouds& clouds, std::size_t rounds)
      : context_(context),
        clouds_(clouds),
        rounds_(rounds),
        progress_(context.output.talk(), TalksToTerminal(), "mesh") {}

  absl::Status ForEach(const char* phase, absl::FunctionRef<absl::Status(PosedCloud&)> body) {
    return ForSome(
        phase, [](std::size_t /*scan*/) { return true; }, body);
  }
  // Of the scans that `wants` takes by number.
  absl::Status ForSome(const char* phase,
                       absl::FunctionRef<bool(std::size_t)> wants,
                       absl::FunctionRef<absl::Status(PosedCloud&)> body) {
    for (std::size_t i = 0; i < clouds_.size(); ++i) {
      STRATA_RETURN_IF_ERROR(context_.call.stop.status());
      progress_.Update(static_cast<double>(done_++) / static_cast<double>(rounds_ * clouds_.size()),
                       phase);
      if (!wants(i)) continue;
      STRATA_ASSIGN_OR_RETURN(PosedCloud posed, clouds_.Read(context_, i));
      STRATA_RETURN_IF_ERROR(body(posed));
    }
    return absl::OkStatus();
  }
  void AddRounds(std::size_t rounds) { rounds_ += rounds; }

 private:
  Context& context_;
  const ScanClouds& clouds_;
  std::size_t rounds_;
  std::size_t done_ = 0;
  Progress progress_;
};

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_MESH_SCAN_LOOP_H_

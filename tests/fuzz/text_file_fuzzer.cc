// Text that people write or other programs wrote: graphs, poses, classes, numbers, paths, options.
#include <cstddef>
#include <cstdint>
#include <string>

#include <fuzzer/FuzzedDataProvider.h>

#include "client/cli/classifier/label_classes.h"
#include "client/cli/posegraph/posegraph_exchange.h"
#include "client/cli/terminal/number_file.h"
#include "client/formats/graph_file.h"
#include "client/formats/path_file.h"
#include "client/formats/plain_readers.h"
#include "client/formats/pose_reader.h"
#include "core/classification/reduction.h"
#include "core/common/host_port.h"
#include "core/world/scan.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

void TryGraph(const std::string& text) {
  const auto graph = ParseGraph(text);
  RequireGoodRefusal(graph.status());
  if (graph.ok()) Require(ParseGraph(G2oText(*graph)).ok(), "a graph that was read can be written");
}

absl::Status Try(int kind, const std::string& text) {
  ScanId id;
  switch (kind) {
    case 0:
      TryGraph(text);
      return absl::OkStatus();
    case 1:
      return cli::ParseGraphImport(text).status();
    case 2:
      return cli::ParseLabelClasses(text).status();
    case 3:
      return ReadPoses(InputFile(text).path()).status();
    case 4:
      return cli::ReadNumberFile(InputFile(text).path(), 2, 5).status();
    case 5:
      return ReadPath(InputFile(text).path()).status();
    case 6:
      return Parse3dtkPose(text).status();
    case 7:
      return ParseScanId(text, id);
    case 8:
      return ParseReduction(text).status();
    default:
      return ParseHostPort(text).status();
  }
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const int kind = input.ConsumeIntegralInRange(0, 9);
  strata::fuzz::RequireGoodRefusal(strata::fuzz::Try(kind, input.ConsumeRemainingBytesAsString()));
  return 0;
}

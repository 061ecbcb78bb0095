// Files of points in every format that people have.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include <fuzzer/FuzzedDataProvider.h>

#include "client/formats/scan_reader.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  constexpr std::array kFormats = {ScanFormat::kPcd,
                                   ScanFormat::kPly,
                                   ScanFormat::kVtk,
                                   ScanFormat::kXyz,
                                   ScanFormat::k3dtk,
                                   ScanFormat::kKitti,
                                   ScanFormat::kOakland,
                                   ScanFormat::kAuto,
                                   ScanFormat::kLas,
                                   ScanFormat::kPtx};
  FuzzedDataProvider input(data, size);
  const ScanFormat format = input.PickValueInArray(kFormats);
  const fuzz::InputFile file(input.ConsumeRemainingBytesAsString());
  const auto cloud = ReadScan(file.path(), format);
  fuzz::RequireGoodRefusal(cloud.status());
  if (cloud.ok()) fuzz::Require(ValidateCloud(*cloud).ok(), "a cloud that was read is valid");
  return 0;
}

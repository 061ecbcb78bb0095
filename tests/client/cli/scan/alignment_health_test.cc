#include "client/cli/scan/alignment_health.h"

#include <string>

#include <gtest/gtest.h>

#include "core/world/scan.h"

namespace strata::cli {
namespace {

ScanInfo Scan(double overlap, bool aligned, const std::string& message) {
  ScanInfo scan;
  scan.alignment = {.aligned = aligned, .message = message, .overlap = overlap};
  return scan;
}

TEST(AlignmentHealthTest, SaysWhatTheScansSay) {
  AlignmentHealth health;
  health.Add(Scan(0.0, false, "no scan around to align to"));
  EXPECT_EQ(health.compared(), 0U);
  for (const double overlap : {0.99, 0.9, 0.94, 0.97}) health.Add(Scan(overlap, true, "converged"));
  health.Add(Scan(0.8, true, "max iterations"));
  EXPECT_EQ(health.MedianOverlap(), 0.94);
  EXPECT_EQ(health.Summary(), "median overlap 0.94, 5 of 5 aligned, 1 at the step limit");
  EXPECT_FALSE(health.Doubtful());
}

TEST(AlignmentHealthTest, DoubtsWhatHardlyOverlapsAndWhatIsNotAligned) {
  AlignmentHealth low;
  AlignmentHealth loose;
  for (int k = 0; k < 5; ++k) {
    EXPECT_FALSE(low.Doubtful());  // too few to tell
    low.Add(Scan(0.6, true, "converged"));
    loose.Add(Scan(0.9, k < 2, k < 2 ? "converged" : "too far from what the robot says"));
  }
  EXPECT_TRUE(low.Doubtful());
  EXPECT_TRUE(loose.Doubtful());
}

TEST(AlignmentHealthTest, NothingComparedIsNoDoubt) {
  EXPECT_FALSE(AlignmentHealth().Doubtful());
  EXPECT_EQ(AlignmentHealth().MedianOverlap(), 0.0);
}

}  // namespace
}  // namespace strata::cli

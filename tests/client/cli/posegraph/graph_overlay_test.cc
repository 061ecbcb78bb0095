#include "client/cli/posegraph/graph_overlay.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::cli {
namespace {

using ::testing::SizeIs;

api::PoseGraphState ThreeScans() {
  api::PoseGraphState state;
  for (const std::uint64_t sequence : {3, 1, 2}) {
    PoseNode node;
    node.id = {"Run", sequence};
    node.T_map_scan.translation().x() = static_cast<double>(sequence);
    state.nodes.push_back(node);
  }
  return state;
}

Constraint Between(std::uint64_t i, std::uint64_t j, double said_m) {
  Constraint constraint;
  constraint.i = {"Run", i};
  constraint.j = {"Run", j};
  constraint.T_i_j.translation().x() = said_m;
  return constraint;
}

TEST(GraphOverlayTest, ATrajectoryGoesThroughItsScansBySequence) {
  api::PoseGraphState state = ThreeScans();
  state.nodes.push_back(state.nodes[0]);
  state.nodes.back().id = {"other", 1};
  picture::Overlay overlay;
  AddTrajectories(state, overlay);
  ASSERT_THAT(overlay.strokes, SizeIs(2));
  ASSERT_THAT(overlay.strokes[0].points, SizeIs(3));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(overlay.strokes[0].points[i].x(), i + 1.0);
  ASSERT_THAT(overlay.legend, SizeIs(2));
  EXPECT_EQ(overlay.legend[0].second, "run");
  EXPECT_FALSE(overlay.legend[0].first == overlay.legend[1].first);
}

TEST(GraphOverlayTest, ManyTrajectoriesAreCounted) {
  api::PoseGraphState state;
  for (int i = 0; i < 11; ++i) {
    PoseNode node;
    node.id = {absl::StrCat("t", i), 1};
    state.nodes.push_back(node);
  }
  picture::Overlay overlay;
  AddTrajectories(state, overlay);
  EXPECT_THAT(overlay.strokes, SizeIs(11));
  ASSERT_THAT(overlay.legend, SizeIs(9));
  EXPECT_EQ(overlay.legend.back().second, "and 3 more");
}

// The colours that a constraint may have are those of the legend.
TEST(GraphOverlayTest, ConstraintsAreColouredByKindAndResidual) {
  api::PoseGraphState state = ThreeScans();
  state.constraints = {Between(1, 2, 1.0),
                       Between(1, 2, 1.0),
                       Between(1, 2, 1.0),
                       Between(1, 2, 1.0),
                       Between(1, 2, 1.0),
                       Between(1, 2, 1.0)};
  state.constraints[1].origin = ConstraintOrigin::kOptimize;
  state.constraints[2].i = {};
  state.constraints[2].T_i_j.translation().x() = 2.0;
  state.constraints[3].information *= 1e3;
  state.constraints[3].T_i_j.translation().x() = 1.1;  // 1000 · 0.01 / 6
  state.constraints[4].information *= 1e3;
  state.constraints[4].T_i_j.translation().x() = 2.0;  // 1000 / 6
  state.constraints[5].enabled = false;
  const char* const expected[] = {
      "matched at ingest", "closure", "prior", "chi2 1 to 9", "chi2 above 9", "disabled"};
  for (std::size_t i = 0; i < state.constraints.size(); ++i) {
    api::PoseGraphState one = state;
    one.constraints = {state.constraints[i]};
    picture::Overlay overlay;
    AddConstraints(one, overlay);
    ASSERT_FALSE(overlay.strokes.empty());
    std::string meaning;
    for (const auto& [colour, text] : overlay.legend) {
      if (colour == overlay.strokes[0].colour) meaning = text;
    }
    EXPECT_EQ(meaning, expected[i]);
    EXPECT_EQ(overlay.strokes[0].dashed, i == 5);
    ASSERT_THAT(overlay.strokes, SizeIs(i == 5 ? 1 : 2));
    if (i == 4) {  // the residual: said to be at 3, is at 2
      EXPECT_NEAR(overlay.strokes[1].points[0].x(), 3.0, 1e-12);
      EXPECT_NEAR(overlay.strokes[1].points[1].x(), 2.0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace strata::cli

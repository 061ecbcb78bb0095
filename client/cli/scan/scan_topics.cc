#include "client/cli/scan/scan_topics.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "client/cli/terminal/progress.h"
#include "client/formats/bags/recording.h"
#include "client/formats/bags/ros_messages.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

// What `scan import` takes a topic for.
std::string UseOf(const RecordedTopic& topic) {
  if (topic.topic.type == kPointCloudType || topic.topic.type == kLaserScanType) return "--topic";
  if (topic.topic.type == kJointStateType) return "--urdf";
  if (IsPoseType(topic.topic.type)) return "--poses-from";
  return IsTransformsType(topic.topic.type) ? "transforms" : "-";
}

// The frames of its headers, and of poses whose poses they are.
std::string FramesOf(const RecordedTopic& topic) {
  std::string frames = absl::StrJoin(topic.frames, ", ");
  if (!topic.child_frame.empty()) absl::StrAppend(&frames, " -> ", topic.child_frame);
  return frames.empty() ? "-" : frames;
}

Json RowOf(const RecordedTopic& topic, bool json) {
  Json row = {{"topic", topic.topic.name},
              {"type", topic.topic.type},
              {"messages", topic.messages},
              {"unreadable", topic.bad},
              {"use", UseOf(topic)},
              {"frames", FramesOf(topic)}};
  row["hz"] = json ? topic.hertz() : std::round(10.0 * topic.hertz()) / 10.0;
  return row;
}

absl::Status List(FileContext& context, const std::vector<std::string>& paths) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<Recording> recording,
                          Recording::Open({paths.begin(), paths.end()}));
  Progress progress(context.output.talk(), TalksToTerminal(), "reading");
  STRATA_ASSIGN_OR_RETURN(const RecordingSurvey survey,
                          recording->Survey([&context, &progress](double share) {
                            progress.Update(share, "the recording");
                            return context.stop.status();
                          }));
  progress.Clear();
  Json rows = Json::array();
  for (const RecordedTopic& topic : survey.topics) {
    rows.push_back(RowOf(topic, !context.output.text()));
    if (topic.bad == 0) continue;
    context.output.Talk(absl::StrCat(
        "warning: ", topic.bad, " messages of ", topic.topic.name, " cannot be read: ", topic.why));
  }
  for (const std::string& line : survey.damage) {
    context.output.Talk(absl::StrCat("warning: ", line));
  }
  context.output.List(rows,
                      {{"topic", "TOPIC"},
                       {"type", "TYPE"},
                       {"messages", "MESSAGES"},
                       {"hz", "HZ"},
                       {"frames", "FRAMES"},
                       {"use", "FOR"}});
  return absl::OkStatus();
}

}  // namespace

void AddScanTopics(Commands& commands, CLI::App* noun) {
  auto paths = std::make_shared<std::vector<std::string>>();
  CLI::App* topics = commands.FileVerb(
      noun,
      "topics",
      "What a recording of ROS 1 or 2 holds, and what of it 'scan import' can use",
      "strata scan topics drive.mcap",
      [paths](FileContext& context) { return List(context, *paths); });
  topics
      ->add_option(
          "PATH",
          *paths,
          "A recording: .mcap, .db3, .bag, a folder of rosbag2; or its files, which belong "
          "together")
      ->required();
}

}  // namespace strata::cli

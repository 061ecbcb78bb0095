#include "client/formats/bags/bag_scans.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/cloud_poses.h"
#include "client/formats/bags/joint_transforms.h"
#include "client/formats/bags/laser_sweeps.h"
#include "client/formats/bags/recording.h"
#include "client/formats/bags/ros_messages.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr absl::string_view kAllTopics =
    "'strata scan topics' with the same files lists all topics";

std::string Described(const RecordedTopic& topic) {
  return absl::StrFormat("%s (%s, %d messages, %.3g Hz)",
                         topic.topic.name,
                         topic.topic.type,
                         topic.messages,
                         topic.hertz());
}

using TopicFilter = absl::FunctionRef<bool(const RecordedTopic&)>;

// "--topic /a (…) or --topic /b (…)"; empty if none fits.
std::string Offered(const RecordingSurvey& survey, absl::string_view option, TopicFilter fits) {
  std::vector<std::string> offers;
  for (const RecordedTopic& topic : survey.topics) {
    if (fits(topic)) offers.push_back(absl::StrCat(option, " ", Described(topic)));
  }
  return absl::StrJoin(offers, " or ");
}

bool HasClouds(const RecordedTopic& topic) { return topic.topic.type == kPointCloudType; }
bool HasLines(const RecordedTopic& topic) { return topic.topic.type == kLaserScanType; }
bool HasPoints(const RecordedTopic& topic) { return HasClouds(topic) || HasLines(topic); }
bool HasPoses(const RecordedTopic& topic) { return IsPoseType(topic.topic.type); }

// The topic that is named, or else the only one that fits; null if there is none or several.
RecordedTopic* FindTopic(RecordingSurvey& survey, const std::string& name, TopicFilter fits) {
  RecordedTopic* found = nullptr;
  for (RecordedTopic& topic : survey.topics) {
    const bool named = name.empty() || topic.topic.name == name || topic.topic.name == "/" + name;
    if (!named || !fits(topic)) continue;
    if (found != nullptr) return nullptr;
    found = &topic;
  }
  return found;
}

absl::StatusOr<RecordedTopic*> CloudTopic(RecordingSurvey& survey, const std::string& name) {
  // Who has clouds seldom means the laser at the bumper.
  const bool clouds = name.empty() && std::ranges::any_of(survey.topics, &HasClouds);
  const TopicFilter fits = clouds ? &HasClouds : &HasPoints;
  RecordedTopic* const topic = FindTopic(survey, name, fits);
  const std::string offers = Offered(survey, "--topic", fits);
  if (topic == nullptr) {
    return absl::InvalidArgumentError(
        offers.empty()
            ? absl::StrCat(
                  "no topic of type ", kPointCloudType, " or ", kLaserScanType, "; ", kAllTopics)
        : name.empty() ? absl::StrCat("which clouds? Say ", offers)
                       : absl::StrCat("no topic ", name, " has clouds; say ", offers));
  }
  if (!topic->clouds.empty()) return topic;
  if (topic->bad > 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("no cloud of ", Described(*topic), " can be read: ", topic->why));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("no cloud of ", Described(*topic), " has a point"));
}

// Where the poses come from: a topic, or else transforms.
struct PoseSource {
  std::string name;
  RecordedTopic* topic = nullptr;
  PoseFrames frames;
};

absl::Status NoPoseSource(const RecordingSurvey& survey, const std::string& asked) {
  std::string offers = Offered(survey, "--poses-from", &HasPoses);
  if (!survey.transforms.empty()) {
    absl::StrAppend(&offers,
                    offers.empty() ? "" : " or ",
                    "--poses-from tf:FIXED->BASE with two of the frames ",
                    absl::StrJoin(survey.transforms.frames(), ", "));
  }
  if (offers.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("no topic has poses (nav_msgs/Odometry, geometry_msgs/PoseStamped) or "
                     "transforms: record /odom or /tf, too; ",
                     kAllTopics));
  }
  return absl::InvalidArgumentError(
      asked.empty() ? absl::StrCat("which poses? Say ", offers)
                    : absl::StrCat("'", asked, "' is no topic of poses; say ", offers));
}

absl::StatusOr<PoseSource> ChoosePoseSource(RecordingSurvey& survey, const std::string& asked) {
  PoseSource source;
  source.name = asked;
  if (absl::StartsWith(asked, "tf:")) {
    const absl::StatusOr<PoseFrames> frames = ParseTransformPoses(asked);
    if (!frames.ok() || survey.transforms.empty()) return NoPoseSource(survey, asked);
    source.frames = *frames;
    return source;
  }
  source.topic = FindTopic(survey, asked, &HasPoses);
  if (source.topic == nullptr) return NoPoseSource(survey, asked);
  if (source.topic->poses.size() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("no pose of ", Described(*source.topic), " can be read: ", source.topic->why));
  }
  source.name = source.topic->topic.name;
  source.frames.fixed = source.topic->frames.front();
  source.frames.base = source.topic->child_frame;
  return source;
}

// Poses of clouds, whatever their frame; may be asked by several threads.
class CloudPoses {
 public:
  // `source` is of the survey.
  CloudPoses(std::shared_ptr<RecordingSurvey> survey,
             PoseSource source,
             const std::optional<Pose>& T_base_cloud)
      : survey_(std::move(survey)),
        transforms_(survey_->transforms),
        source_(std::move(source)),
        T_base_cloud_(T_base_cloud) {}

  absl::StatusOr<CloudPose> At(const std::string& frame, std::int64_t stamp_ns) {
    const std::lock_guard lock(mutex_);
    STRATA_ASSIGN_OR_RETURN(const Pose T_map_base, BaseAtLocked(stamp_ns));
    return PoseOfCloud(T_map_base, source_.frames, T_base_cloud_, frame, stamp_ns, transforms_);
  }

  absl::StatusOr<Pose> BaseAt(std::int64_t stamp_ns) {
    const std::lock_guard lock(mutex_);
    return BaseAtLocked(stamp_ns);
  }

 private:
  absl::StatusOr<Pose> BaseAtLocked(std::int64_t stamp_ns) {
    if (source_.topic != nullptr) return source_.topic->poses.At(stamp_ns);
    return transforms_.Lookup(source_.frames.fixed, source_.frames.base, stamp_ns);
  }

  const std::shared_ptr<RecordingSurvey> survey_;
  std::mutex mutex_;  // tracks and transforms are sorted when they are asked
  TransformTree& transforms_;
  const PoseSource source_;
  const std::optional<Pose> T_base_cloud_;
};

absl::StatusOr<PointCloud> ReadRecordedCloud(Recording& recording,
                                             const RecordedCloud& cloud,
                                             MessageEncoding encoding,
                                             const std::optional<Pose>& T_scan_cloud,
                                             std::size_t* at_sensor) {
  STRATA_ASSIGN_OR_RETURN(const std::string message, recording.Read(cloud));
  return ScanOfMessage(message, encoding, T_scan_cloud, at_sensor);
}

// What became of the clouds of a topic, or of its sweeps.
struct Chosen {
  std::vector<ScanFile> scans;
  std::size_t all = 0, with_pose = 0;
  absl::Status first_fault;  // of those without
  bool moved = false;        // clouds were in a frame in which the base moves
};

// T_map_scan after the stamp of a cloud.
std::function<absl::StatusOr<Pose>(double)> PosesAfter(const std::shared_ptr<CloudPoses>& poses,
                                                       const std::string& frame,
                                                       std::int64_t stamp_ns) {
  return [poses, frame, stamp_ns](double offset_s) -> absl::StatusOr<Pose> {
    const auto offset_ns = static_cast<std::int64_t>(std::llround(1e9 * offset_s));
    STRATA_ASSIGN_OR_RETURN(const CloudPose pose, poses->At(frame, stamp_ns + offset_ns));
    return pose.T_map_scan;
  };
}

Chosen ChooseKeyframes(const std::shared_ptr<Recording>& recording,
                       const RecordedTopic& topic,
                       const KeyframeSpacing& every,
                       const std::shared_ptr<CloudPoses>& poses) {
  Chosen chosen;
  chosen.all = topic.clouds.size();
  KeyframeChooser chooser(every);
  for (std::size_t i = 0; i < topic.clouds.size(); ++i) {
    const RecordedCloud& cloud = topic.clouds[i];
    const absl::StatusOr<CloudPose> pose = poses->At(topic.frames[cloud.frame], cloud.stamp_ns);
    if (!pose.ok()) {
      if (chosen.first_fault.ok()) chosen.first_fault = pose.status();
      continue;
    }
    ++chosen.with_pose;
    if (!chooser.Keep(1e-9 * static_cast<double>(cloud.stamp_ns), pose->T_map_scan)) continue;
    ScanFile& scan = chosen.scans.emplace_back();
    scan.path = absl::StrCat(recording->files()[cloud.file], ":", topic.topic.name, ":", i);
    scan.sequence = i;
    scan.time = TimeOfStamp(cloud.stamp_ns);
    scan.T_map_scan = pose->T_map_scan;
    chosen.moved = chosen.moved || pose->T_scan_cloud.has_value();
    if (topic.has_point_times && !pose->T_scan_cloud.has_value()) {
      scan.pose_after = PosesAfter(poses, topic.frames[cloud.frame], cloud.stamp_ns);
    }
    scan.read = [recording,
                 cloud,
                 encoding = topic.topic.encoding,
                 T_scan_cloud = pose->T_scan_cloud](std::size_t* at_sensor) {
      return ReadRecordedCloud(*recording, cloud, encoding, T_scan_cloud, at_sensor);
    };
  }
  return chosen;
}

// Where the base was in the middle of a sweep, if that is known of the laser, too.
absl::StatusOr<Pose> PoseOfSweep(const LaserSweep& sweep,
                                 const RecordedTopic& topic,
                                 CloudPoses& poses) {
  const std::string& frame = topic.frames[sweep.lines[sweep.lines.size() / 2].frame];
  STRATA_RETURN_IF_ERROR(poses.At(frame, sweep.stamp_ns()).status());
  return poses.BaseAt(sweep.stamp_ns());
}

Chosen ChooseSweeps(const std::shared_ptr<Recording>& recording,
                    const RecordedTopic& topic,
                    const BagScanOptions& options,
                    const std::shared_ptr<CloudPoses>& poses) {
  const LinePoses line_poses = [poses, frames = topic.frames](
                                   std::uint32_t frame,
                                   std::int64_t stamp_ns) -> absl::StatusOr<Pose> {
    STRATA_ASSIGN_OR_RETURN(const CloudPose pose, poses->At(frames[frame], stamp_ns));
    return pose.T_map_scan * pose.T_scan_cloud.value_or(Pose::Identity());
  };
  std::vector<LaserSweep> sweeps = SweepsOf(topic.clouds, options.sweep_s.value_or(kDefaultSweepS));
  Chosen chosen;
  chosen.all = sweeps.size();
  KeyframeChooser chooser(options.every);
  for (LaserSweep& sweep : sweeps) {
    const absl::StatusOr<Pose> pose = PoseOfSweep(sweep, topic, *poses);
    if (!pose.ok()) {
      if (chosen.first_fault.ok()) chosen.first_fault = pose.status();
      continue;
    }
    ++chosen.with_pose;
    if (!chooser.Keep(1e-9 * static_cast<double>(sweep.stamp_ns()), *pose)) continue;
    ScanFile& scan = chosen.scans.emplace_back();
    scan.path = absl::StrCat(
        recording->files()[sweep.lines[0].file], ":", topic.topic.name, ":", sweep.number);
    scan.sequence = sweep.number;
    scan.time = TimeOfStamp(sweep.stamp_ns());
    scan.T_map_scan = *pose;
    scan.read = [recording,
                 sweep = std::move(sweep),
                 encoding = topic.topic.encoding,
                 T_map_scan = *pose,
                 line_poses](std::size_t* /*at_sensor*/) {
      return ReadSweep(*recording, sweep, encoding, T_map_scan, line_poses);
    };
  }
  return chosen;
}

void TellOf(const RecordingSurvey& survey,
            const RecordedTopic& topic,
            const PoseSource& source,
            const Chosen& chosen,
            const std::function<void(const std::string&)>& tell) {
  if (!tell) return;
  for (const std::string& line : survey.damage) tell(absl::StrCat("warning: ", line));
  for (const RecordedTopic& used : survey.topics) {
    if (used.bad == 0 || (&used != &topic && &used != source.topic)) continue;
    tell(absl::StrCat(
        "warning: ", used.bad, " messages of ", used.topic.name, " are left out: ", used.why));
  }
  const absl::string_view what = HasLines(topic) ? " sweeps" : " clouds";
  if (chosen.with_pose < chosen.all) {
    tell(absl::StrCat("warning: ",
                      chosen.all - chosen.with_pose,
                      what,
                      " have no pose and are left out: ",
                      chosen.first_fault.message()));
  }
  if (source.topic != nullptr && source.frames.base.empty()) {
    tell(absl::StrCat(source.name, " does not say whose poses it has: taken for the clouds' own"));
  }
  if (topic.has_point_times && chosen.moved) {
    tell(
        "the points have times, which are not used: in the frame they are in, an odometry has put "
        "each where it belongs");
  }
  tell(absl::StrCat(chosen.scans.size(),
                    " of ",
                    chosen.all,
                    what,
                    " of ",
                    topic.topic.name,
                    " with poses from ",
                    source.name));
}

// Frames that hang from joints which no message tells of are nowhere.
absl::Status WithStillJoints(const absl::Status& fault, const std::set<std::string>& joints) {
  if (joints.empty()) return fault;
  return absl::Status(fault.code(),
                      absl::StrCat(fault.message(),
                                   "; no ",
                                   kJointStateType,
                                   " has a position of ",
                                   absl::StrJoin(joints, ", ")));
}

}  // namespace

absl::StatusOr<std::vector<ScanFile>> ListBagScans(const std::vector<std::filesystem::path>& paths,
                                                   const BagScanOptions& options) {
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<Recording> opened, Recording::Open(paths));
  const std::shared_ptr<Recording> recording = std::move(opened);
  std::optional<JointTransforms> joints;
  if (!options.urdf.empty()) {
    STRATA_ASSIGN_OR_RETURN(joints, JointTransforms::Read(options.urdf));
  }
  const auto progress = [&options](double share) {
    return options.progress ? options.progress(share) : absl::OkStatus();
  };
  STRATA_ASSIGN_OR_RETURN(RecordingSurvey surveyed,
                          recording->Survey(progress, joints.has_value() ? &*joints : nullptr));
  const auto survey = std::make_shared<RecordingSurvey>(std::move(surveyed));
  STRATA_ASSIGN_OR_RETURN(RecordedTopic* const topic, CloudTopic(*survey, options.topic));
  if (options.sweep_s.has_value() && !HasLines(*topic)) {
    return absl::InvalidArgumentError(absl::StrCat("a sweep is of lines of a laser (",
                                                   kLaserScanType,
                                                   "), and ",
                                                   topic->topic.name,
                                                   " has clouds"));
  }
  STRATA_ASSIGN_OR_RETURN(const PoseSource source, ChoosePoseSource(*survey, options.poses_from));
  const auto poses = std::make_shared<CloudPoses>(survey, source, options.T_base_cloud);
  std::ranges::stable_sort(topic->clouds, {}, &RecordedCloud::stamp_ns);
  Chosen chosen = HasLines(*topic) ? ChooseSweeps(recording, *topic, options, poses)
                                   : ChooseKeyframes(recording, *topic, options.every, poses);
  if (chosen.scans.empty()) {
    return Annotate(WithStillJoints(chosen.first_fault, survey->still_joints),
                    absl::StrCat("no ",
                                 HasLines(*topic) ? "sweep" : "cloud",
                                 " of ",
                                 topic->topic.name,
                                 " has a pose from ",
                                 source.name));
  }
  TellOf(*survey, *topic, source, chosen, options.tell);
  return std::move(chosen.scans);
}

}  // namespace strata

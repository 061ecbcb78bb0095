// The files of one recording, and what is in them.
#ifndef STRATA_CLIENT_FORMATS_BAGS_RECORDING_H_
#define STRATA_CLIENT_FORMATS_BAGS_RECORDING_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/formats/bags/bag_reader.h"
#include "client/formats/bags/pose_track.h"
#include "client/formats/bags/transform_tree.h"

namespace strata {

class JointTransforms;

// A cloud, or a line of a laser, with points, by its header and its place.
struct RecordedCloud {
  std::int64_t stamp_ns = 0;
  std::uint32_t frame = 0;  // of RecordedTopic::frames
  std::uint32_t file = 0;
  MessagePlace place;
};

struct RecordedTopic {
  BagTopic topic;
  std::uint64_t messages = 0;
  std::int64_t first_ns = 0, last_ns = 0;  // when they were recorded
  std::uint64_t bad = 0;                   // messages that cannot be read, of a type that is,
  std::string why;                         // and why the first one cannot

  // Frames that the headers name, in the order of their first message; of transforms "odom ->
  // base". The first hundred.
  std::vector<std::string> frames;
  // Of clouds and lines of a laser:
  std::vector<RecordedCloud> clouds;  // in the order of the files
  bool has_point_times = false;
  // Of poses: whose, as the first message says; empty where it does not.
  std::string child_frame;
  PoseTrack poses;

  double hertz() const;  // 0 for a single message
};

struct RecordingSurvey {
  std::vector<RecordedTopic> topics;  // by name
  // Of all topics of transforms, those of …tf_static fixed; and of the robot's joints.
  TransformTree transforms;
  std::set<std::string> still_joints;  // of the robot: no message has a position of them
  std::vector<std::string> damage;     // lines that begin with the name of a file
};

// Whether a path is to be taken for a recording: a file that is a bag by its first bytes or its
// ending (.mcap, .db3, .bag), or a folder of such files that rosbag2's metadata.yaml lies beside or
// that has no scans.
bool IsRecording(const std::filesystem::path& path);

class Recording {
 public:
  // Files, and folders with one bag, or with the several files of one as metadata.yaml says.
  // NOT_FOUND; UNAVAILABLE; INVALID_ARGUMENT naming the file that is no bag, is packed as a whole,
  // or is one of several.
  static absl::StatusOr<std::unique_ptr<Recording>> Open(
      const std::vector<std::filesystem::path>& paths);

  // Reads all once: clouds by their heads, poses and transforms, and with `joints` what messages
  // about the robot's joints say. `progress` is told the share that is done; an error of it ends
  // the reading. RESOURCE_EXHAUSTED beyond ten million poses,
  // transforms and clouds. Memory: a chunk, a message, 64 bytes a pose, 40 a cloud.
  absl::StatusOr<RecordingSurvey> Survey(absl::FunctionRef<absl::Status(double)> progress,
                                         const JointTransforms* joints = nullptr);

  // The message of a cloud, unpacked. Thread-safe. DATA_LOSS if it is no longer there.
  absl::StatusOr<std::string> Read(const RecordedCloud& cloud);

  const std::vector<std::string>& files() const { return files_; }

 private:
  Recording() = default;

  std::vector<std::string> files_;
  std::mutex mutex_;  // guards what follows
  std::vector<std::unique_ptr<BagReader>> readers_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_BAGS_RECORDING_H_

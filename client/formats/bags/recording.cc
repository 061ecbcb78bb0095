#include "client/formats/bags/recording.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/joint_transforms.h"
#include "client/formats/bags/ros_messages.h"
#include "client/formats/bags/unpack.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPoses = 10'000'000;  // and transforms and clouds
constexpr std::size_t kMostFramesOfTopic = 100;

bool EndsLikeBag(const fs::path& path) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  return ending == ".mcap" || ending == ".db3" || ending == ".bag";
}

struct BagFolder {
  std::vector<fs::path> bags;
  std::vector<fs::path> packed;  // .mcap.zstd, .db3.zstd: as ros2 bag --compression-mode file does
  bool has_metadata = false;     // of rosbag2
  bool has_scans = false;
};

BagFolder LookInto(const fs::path& folder) {
  BagFolder found;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const fs::path& path = it->path();
    if (EndsLikeBag(path)) found.bags.push_back(path);
    if (path.extension() == ".zstd" && EndsLikeBag(path.stem())) found.packed.push_back(path);
    found.has_metadata = found.has_metadata || path.filename() == "metadata.yaml";
    found.has_scans = found.has_scans || ScanFormatOfName(path) != ScanFormat::kAuto;
  }
  std::sort(found.bags.begin(), found.bags.end());
  std::sort(found.packed.begin(), found.packed.end());
  return found;
}

absl::StatusOr<std::vector<fs::path>> FilesOfRecording(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return std::vector<fs::path>{path};
  BagFolder found = LookInto(path);
  if (!found.packed.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(found.packed.front().string(),
                                                   ": is packed as a whole; unpack it first: zstd "
                                                   "-d ",
                                                   found.packed.front().string()));
  }
  if (found.bags.empty()) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": no .mcap, .db3 or .bag in it"));
  }
  if (found.bags.size() > 1 && !found.has_metadata) {
    return absl::InvalidArgumentError(
        absl::StrCat(path.string(),
                     ": ",
                     found.bags.size(),
                     " bags and no metadata.yaml that says that they "
                     "are one; name them, the parts of one together: ",
                     found.bags.front().string(),
                     ", …"));
  }
  return std::move(found.bags);
}

// The number of a frame among those of a topic; a bag that means harm may name any number.
std::uint32_t FrameNumber(const std::string& frame, std::vector<std::string>& frames) {
  const auto number =
      static_cast<std::size_t>(std::find(frames.begin(), frames.end(), frame) - frames.begin());
  if (number == frames.size() && number < kMostFramesOfTopic) frames.push_back(frame);
  return static_cast<std::uint32_t>(std::min(number, frames.size() - 1));
}

class Surveyor {
 public:
  explicit Surveyor(const JointTransforms* joints) : joints_(joints) {
    if (joints_ == nullptr) return;
    survey_.still_joints = joints_->Moving();
    for (const RosPose& transform : joints_->Fixed()) {
      survey_.transforms.Add(transform, true).IgnoreError();  // links that have names
    }
  }

  // A message of a file whose topics are `topics`.
  absl::Status Add(const std::vector<BagTopic>& topics,
                   std::uint32_t file,
                   const BagMessage& message) {
    RecordedTopic& recorded = survey_.topics[NumberOf(topics, file, message.topic)];
    recorded.first_ns =
        recorded.messages == 0 ? message.time_ns : std::min(recorded.first_ns, message.time_ns);
    recorded.last_ns =
        recorded.messages == 0 ? message.time_ns : std::max(recorded.last_ns, message.time_ns);
    ++recorded.messages;
    const absl::Status read = AddPacked(file, message, recorded);
    if (!read.ok() && recorded.bad++ == 0) recorded.why = std::string(read.message());
    if (poses_ <= kMostPoses) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat("more than ", kMostPoses, " poses, transforms and clouds in one recording"));
  }

  RecordingSurvey Take() {
    std::stable_sort(
        survey_.topics.begin(),
        survey_.topics.end(),
        [](const RecordedTopic& a, const RecordedTopic& b) { return a.topic.name < b.topic.name; });
    return std::move(survey_);
  }

  // The topics without a message, and the faults, of a file that has been read.
  void EndOf(const std::string& name, std::uint32_t file, const BagReader& reader) {
    for (std::size_t i = 0; i < reader.topics().size(); ++i) NumberOf(reader.topics(), file, i);
    for (const std::string& line : reader.damage()) {
      survey_.damage.push_back(absl::StrCat(name, ": ", line));
    }
  }

 private:
  // The number here of a topic of a file: files may number the same topics otherwise.
  std::size_t NumberOf(const std::vector<BagTopic>& topics, std::uint32_t file, std::size_t topic) {
    numbers_.resize(std::max<std::size_t>(numbers_.size(), file + 1));
    std::vector<std::size_t>& numbers = numbers_[file];
    while (numbers.size() <= topic) {
      const BagTopic& next = topics[numbers.size()];
      const auto known = std::find_if(
          survey_.topics.begin(), survey_.topics.end(), [&next](const RecordedTopic& recorded) {
            return recorded.topic == next;
          });
      numbers.push_back(static_cast<std::size_t>(known - survey_.topics.begin()));
      if (known == survey_.topics.end()) survey_.topics.emplace_back().topic = next;
    }
    return numbers[topic];
  }

  absl::Status AddPacked(std::uint32_t file, const BagMessage& message, RecordedTopic& recorded) {
    BagMessage plain = message;
    if (recorded.topic.encoding == MessageEncoding::kCdr) {
      STRATA_ASSIGN_OR_RETURN(plain.bytes, UnpackedMessage(message.bytes, unpacked_));
    }
    return AddContent(file, plain, recorded);
  }

  absl::Status AddContent(std::uint32_t file, const BagMessage& message, RecordedTopic& recorded) {
    const std::string& type = recorded.topic.type;
    if (type == kPointCloudType) return AddCloud(file, message, recorded);
    if (type == kLaserScanType) return AddLine(file, message, recorded);
    if (type == kJointStateType && joints_ != nullptr) return AddJoints(message, recorded);
    if (IsPoseType(type)) return AddPoses(message, recorded);
    if (IsTransformsType(type)) return AddTransforms(message, recorded);
    return absl::OkStatus();
  }

  absl::Status AddCloud(std::uint32_t file, const BagMessage& message, RecordedTopic& recorded) {
    STRATA_ASSIGN_OR_RETURN(const RosCloudHead head,
                            ReadRosCloudHead(message.bytes, recorded.topic.encoding));
    recorded.has_point_times = recorded.has_point_times || head.has_point_times;
    if (head.points > 0) AddPlace(file, message, head.header, recorded);
    return absl::OkStatus();
  }

  absl::Status AddLine(std::uint32_t file, const BagMessage& message, RecordedTopic& recorded) {
    STRATA_ASSIGN_OR_RETURN(const RosLaserScan scan,
                            ReadRosLaserScan(message.bytes, recorded.topic.encoding));
    if (scan.line.size() > 0) AddPlace(file, message, scan.header, recorded);
    return absl::OkStatus();
  }

  void AddPlace(std::uint32_t file,
                const BagMessage& message,
                const RosHeader& header,
                RecordedTopic& recorded) {
    ++poses_;
    recorded.clouds.push_back({.stamp_ns = header.stamp_ns,
                               .frame = FrameNumber(header.frame, recorded.frames),
                               .file = file,
                               .place = message.place});
  }

  absl::Status AddJoints(const BagMessage& message, const RecordedTopic& recorded) {
    STRATA_ASSIGN_OR_RETURN(const RosJointState state,
                            ReadRosJointState(message.bytes, recorded.topic.encoding));
    if (state.positions.empty()) return absl::OkStatus();
    for (const std::string& name : state.names) survey_.still_joints.erase(name);
    absl::Status first_fault;
    for (const RosPose& transform : joints_->At(state)) {
      ++poses_;
      const absl::Status added = survey_.transforms.Add(transform, false);
      if (first_fault.ok()) first_fault = added;
    }
    return first_fault;
  }

  absl::Status AddPoses(const BagMessage& message, RecordedTopic& recorded) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<RosPose> poses,
                            ReadRosPoses(recorded.topic, message.bytes));
    for (const RosPose& pose : poses) {
      FrameNumber(pose.header.frame, recorded.frames);
      if (recorded.poses.size() == 0) recorded.child_frame = pose.child_frame;
      ++poses_;
      STRATA_RETURN_IF_ERROR(
          recorded.poses.Add(pose.header.stamp_ns, pose.position_m, pose.quaternion));
    }
    return absl::OkStatus();
  }

  absl::Status AddTransforms(const BagMessage& message, RecordedTopic& recorded) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<RosPose> transforms,
                            ReadRosPoses(recorded.topic, message.bytes));
    absl::Status first_fault;
    for (const RosPose& transform : transforms) {
      ++poses_;
      FrameNumber(absl::StrCat(transform.header.frame, " -> ", transform.child_frame),
                  recorded.frames);
      const absl::Status added =
          survey_.transforms.Add(transform, absl::EndsWith(recorded.topic.name, "tf_static"));
      if (first_fault.ok()) first_fault = added;
    }
    return first_fault;
  }

  const JointTransforms* const joints_;  // may be null
  RecordingSurvey survey_;
  std::vector<std::vector<std::size_t>> numbers_;  // by file and topic there
  std::size_t poses_ = 0;                          // and transforms and clouds
  std::string unpacked_;                           // a message
};

}  // namespace

double RecordedTopic::hertz() const {
  const double seconds = 1e-9 * (static_cast<double>(last_ns) - static_cast<double>(first_ns));
  return messages > 1 && seconds > 0.0 ? static_cast<double>(messages - 1) / seconds : 0.0;
}

bool IsRecording(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return EndsLikeBag(path) || IsBagFile(path);
  const BagFolder found = LookInto(path);
  const bool any = !found.bags.empty() || !found.packed.empty();
  return any && (found.has_metadata || !found.has_scans);
}

absl::StatusOr<std::unique_ptr<Recording>> Recording::Open(const std::vector<fs::path>& paths) {
  std::unique_ptr<Recording> recording(new Recording());
  for (const fs::path& path : paths) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<fs::path> files, FilesOfRecording(path));
    for (const fs::path& file : files) {
      STRATA_ASSIGN_OR_RETURN(std::unique_ptr<BagReader> reader, OpenBagFile(file));
      recording->files_.push_back(file.string());
      recording->readers_.push_back(std::move(reader));
    }
  }
  return recording;
}

absl::StatusOr<RecordingSurvey> Recording::Survey(absl::FunctionRef<absl::Status(double)> progress,
                                                  const JointTransforms* joints) {
  const std::lock_guard lock(mutex_);
  Surveyor surveyor(joints);
  for (std::uint32_t file = 0; file < readers_.size(); ++file) {
    BagReader& reader = *readers_[file];
    const absl::Status read = reader.Visit([&](const BagMessage& message) {
      const double done = file + reader.progress();
      STRATA_RETURN_IF_ERROR(progress(done / static_cast<double>(readers_.size())));
      return surveyor.Add(reader.topics(), file, message);
    });
    if (!read.ok()) return Annotate(read, files_[file]);
    surveyor.EndOf(files_[file], file, reader);
  }
  return surveyor.Take();
}

absl::StatusOr<std::string> Recording::Read(const RecordedCloud& cloud) {
  std::string message;
  {
    const std::lock_guard lock(mutex_);
    STRATA_ASSIGN_OR_RETURN(message, readers_[cloud.file]->Read(cloud.place));
  }
  std::string unpacked;
  STRATA_ASSIGN_OR_RETURN(const absl::string_view plain, UnpackedMessage(message, unpacked));
  return plain.data() == message.data() ? std::move(message) : std::move(unpacked);
}

}  // namespace strata

#include "tests/support/bag_writer.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include <Eigen/Geometry>
#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

namespace strata::testing {
namespace {

// ---- pieces of files, little-endian ----

template <typename T>
std::string Raw(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string Sized(absl::string_view text) {
  return Raw(static_cast<std::uint32_t>(text.size())) + std::string(text);
}

std::uint32_t Crc(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

// ---- MCAP ----

std::string McapRecord(std::uint8_t opcode, const std::string& content) {
  return Raw(opcode) + Raw(std::uint64_t{content.size()}) + content;
}

class McapWriter {
 public:
  explicit McapWriter(const McapForm& form) : form_(form) {
    file_ = kMagic + McapRecord(0x01, Sized("ros2") + Sized("bag_writer"));
  }

  void Add(const BagEntry& entry) {
    std::string& out = form_.chunks ? chunk_ : file_;
    const auto known = channels_.find({entry.topic, entry.type});
    std::uint16_t id = 0;
    if (known == channels_.end()) {
      id = static_cast<std::uint16_t>(channels_.size() + 1);
      channels_[{entry.topic, entry.type}] = id;
      const std::string about =
          McapRecord(0x03, Raw(id) + Sized(entry.type) + Sized("ros2msg") + Sized("")) +
          McapRecord(0x04, Raw(id) + Raw(id) + Sized(entry.topic) + Sized("cdr") + Sized(""));
      out += about;
      summary_ += about;
    } else {
      id = known->second;
    }
    if (chunk_.empty()) first_ns_ = entry.time_ns;
    const auto time_ns = static_cast<std::uint64_t>(entry.time_ns);
    out += McapRecord(0x05, Raw(id) + Raw(sequence_++) + Raw(time_ns) + Raw(time_ns) + entry.bytes);
    last_ns_ = entry.time_ns;
    if (chunk_.size() >= form_.chunk_bytes) FlushChunk();
  }

  std::string Finish() {
    FlushChunk();
    if (form_.index) {
      file_ += McapRecord(0x0F, Raw(std::uint32_t{0}));
      const std::uint64_t summary_at = file_.size();
      file_ += summary_ +
               McapRecord(0x02, Raw(summary_at) + Raw(std::uint64_t{0}) + Raw(std::uint32_t{0}));
    } else {
      file_ +=
          McapRecord(0x0F, Raw(std::uint32_t{0})) +
          McapRecord(0x02, std::string(sizeof(std::uint64_t) * 2 + sizeof(std::uint32_t), '\0'));
    }
    return file_ + kMagic;
  }

 private:
  void FlushChunk() {
    if (chunk_.empty()) return;
    const std::uint64_t at = file_.size();
    const std::string packed = Packed(form_.compression, chunk_);
    const std::string times = Raw(first_ns_) + Raw(last_ns_);
    const std::string chunk =
        McapRecord(0x06,
                   times + Raw(std::uint64_t{chunk_.size()}) +
                       Raw(form_.checksums ? Crc(chunk_) : std::uint32_t{0}) +
                       Sized(form_.compression) + Raw(std::uint64_t{packed.size()}) + packed);
    file_ += chunk;
    if (form_.index) {
      file_ += McapRecord(0x07, Raw(std::uint16_t{1}) + Raw(std::uint32_t{0}));
      summary_ +=
          McapRecord(0x08,
                     times + Raw(at) + Raw(std::uint64_t{chunk.size()}) + Raw(std::uint32_t{0}) +
                         Raw(std::uint64_t{19}) + Sized(form_.compression) +
                         Raw(std::uint64_t{packed.size()}) + Raw(std::uint64_t{chunk_.size()}));
    }
    if (form_.attachment) {
      file_ +=
          McapRecord(0x09, std::string(100, '\x05')) + McapRecord(0x0C, Sized("m") + Sized(""));
    }
    chunk_.clear();
  }

  const std::string kMagic = "\x89MCAP0\r\n";
  const McapForm form_;
  std::string file_, chunk_, summary_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> channels_;
  std::uint32_t sequence_ = 0;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

// ---- ROS 1 ----

std::string Field(absl::string_view name, absl::string_view value) {
  return Sized(std::string(name) + "=" + std::string(value));
}

std::string Ros1Record(const std::string& header, const std::string& data) {
  return Sized(header) + Sized(data);
}

std::string Ros1Time(std::int64_t time_ns) {
  return Raw(static_cast<std::uint32_t>(time_ns / 1'000'000'000)) +
         Raw(static_cast<std::uint32_t>(time_ns % 1'000'000'000));
}

}  // namespace

std::string Packed(const std::string& method, const std::string& bytes) {
  std::string packed;
  if (method == "zstd") {
    packed.resize(ZSTD_compressBound(bytes.size()));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  } else if (method == "lz4") {
    packed.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  } else if (method == "bz2") {
    auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 600);
    packed.resize(size);
    BZ2_bzBuffToBuffCompress(packed.data(),
                             &size,
                             const_cast<char*>(bytes.data()),
                             static_cast<unsigned>(bytes.size()),
                             9,
                             0,
                             0);
    packed.resize(size);
  } else {
    packed = bytes;
  }
  return packed;
}

MessageWriter::MessageWriter(Layout layout)
    : layout_(layout),
      largest_step_(layout == Layout::kRos1   ? 1
                    : layout == Layout::kCdr2 ? 4
                                              : 8) {
  if (layout == Layout::kRos1) return;
  const char kind = layout == Layout::kCdr ? '\1' : layout == Layout::kCdr2 ? '\7' : '\0';
  bytes_ = {'\0', kind, '\0', '\0'};
  head_ = bytes_.size();
}

MessageWriter& MessageWriter::Text(absl::string_view text) {
  if (layout_ == Layout::kRos1) return Bytes(text);
  return Bytes(std::string(text) + '\0');
}

MessageWriter& MessageWriter::Bytes(absl::string_view bytes) {
  Put(static_cast<std::uint32_t>(bytes.size()));
  bytes_.append(bytes.data(), bytes.size());
  return *this;
}

MessageWriter& MessageWriter::Header(std::int64_t stamp_ns, absl::string_view frame) {
  if (layout_ == Layout::kRos1) Put(std::uint32_t{7});
  Put(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
  Put(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
  return Text(frame);
}

MessageWriter& MessageWriter::Place(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  for (int k = 0; k < 3; ++k) Put(pose.translation()[k]);
  return Put(q.x()).Put(q.y()).Put(q.z()).Put(q.w());
}

std::string CloudMessage(Layout layout,
                         std::int64_t stamp_ns,
                         absl::string_view frame,
                         const std::vector<Eigen::Vector4f>& points,
                         std::uint32_t rows,
                         const std::vector<std::uint32_t>& t_ns) {
  MessageWriter writer(layout);
  writer.Header(stamp_ns, frame).Put(rows);
  const auto columns = static_cast<std::uint32_t>(points.size() / rows);
  const std::uint32_t fields = t_ns.empty() ? 4 : 5;
  writer.Put(columns).Put(fields);
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "intensity", "t"}) {
    const bool is_time = offset == 16;
    if (is_time && t_ns.empty()) break;
    writer.Text(name)
        .Put(offset)
        .Put(static_cast<std::uint8_t>(is_time ? 6 : 7))
        .Put(std::uint32_t{1});
    offset += 4;
  }
  std::string data(offset * points.size(), '\0');
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(data.data() + offset * i, points[i].data(), 16);
    if (!t_ns.empty()) std::memcpy(data.data() + offset * i + 16, &t_ns[i], 4);
  }
  // The points stay little-endian, whatever the message.
  writer.Put(std::uint8_t{0}).Put(offset).Put(offset * columns).Bytes(data);
  return writer.Put(std::uint8_t{1}).bytes();
}

std::string LaserMessage(Layout layout,
                         std::int64_t stamp_ns,
                         absl::string_view frame,
                         float first_rad,
                         float step_rad,
                         float step_s,
                         const std::vector<float>& ranges_m) {
  MessageWriter message(layout);
  const auto count = static_cast<std::uint32_t>(ranges_m.size());
  const float last_rad = first_rad + step_rad * static_cast<float>(count - 1);
  message.Header(stamp_ns, frame);
  for (const float number : {first_rad, last_rad, step_rad, step_s, 0.0F, 0.1F, 30.0F}) {
    message.Put(number);
  }
  message.Put(count);
  for (const float range_m : ranges_m) message.Put(range_m);
  return message.Put(std::uint32_t{0}).bytes();
}

std::string JointMessage(Layout layout,
                         std::int64_t stamp_ns,
                         const std::map<std::string, double>& positions) {
  MessageWriter message(layout);
  const auto count = static_cast<std::uint32_t>(positions.size());
  message.Header(stamp_ns, "").Put(count);
  for (const auto& [name, position] : positions) message.Text(name);
  message.Put(count);
  for (const auto& [name, position] : positions) message.Put(position);
  return message.Put(std::uint32_t{0}).Put(std::uint32_t{0}).bytes();
}

std::string OdometryMessage(Layout layout,
                            std::int64_t stamp_ns,
                            absl::string_view frame,
                            absl::string_view child,
                            const Pose& pose) {
  MessageWriter writer(layout);
  writer.Header(stamp_ns, frame).Text(child).Place(pose);
  for (int i = 0; i < 36 + 6 + 36; ++i) writer.Put(0.0);
  return writer.bytes();
}

std::string PoseMessage(Layout layout,
                        std::int64_t stamp_ns,
                        absl::string_view frame,
                        const Pose& pose) {
  return MessageWriter(layout).Header(stamp_ns, frame).Place(pose).bytes();
}

std::string TransformMessage(Layout layout,
                             std::int64_t stamp_ns,
                             absl::string_view frame,
                             absl::string_view child,
                             const Pose& pose) {
  MessageWriter writer(layout);
  writer.Put(std::uint32_t{1}).Header(stamp_ns, frame).Text(child).Place(pose);
  return writer.bytes();
}

std::string McapBytes(const std::vector<BagEntry>& entries, const McapForm& form) {
  McapWriter writer(form);
  for (const BagEntry& entry : entries) writer.Add(entry);
  return writer.Finish();
}

std::string Ros1BagBytes(const std::vector<BagEntry>& entries,
                         const std::string& compression,
                         std::size_t chunk_bytes) {
  std::string file = "#ROSBAG V2.0\n" +
                     Ros1Record(Field("op", "\x03") + Field("index_pos", Raw(std::uint64_t{1})) +
                                    Field("conn_count", Raw(std::uint32_t{1})) +
                                    Field("chunk_count", Raw(std::uint32_t{1})),
                                std::string(4027, ' '));
  std::map<std::string, std::uint32_t> connections;
  std::string chunk;
  const auto flush = [&] {
    if (chunk.empty()) return;
    file += Ros1Record(Field("op", "\x05") + Field("compression", compression) +
                           Field("size", Raw(static_cast<std::uint32_t>(chunk.size()))),
                       Packed(compression, chunk));
    file += Ros1Record(Field("op", "\x04") + Field("ver", Raw(std::uint32_t{1})), "");
    chunk.clear();
  };
  for (const BagEntry& entry : entries) {
    const auto [connection, is_new] =
        connections.try_emplace(entry.topic, static_cast<std::uint32_t>(connections.size()));
    const std::string number = Field("conn", Raw(connection->second));
    if (is_new) {
      chunk += Ros1Record(Field("op", "\x07") + number + Field("topic", entry.topic),
                          Field("topic", entry.topic) + Field("type", entry.type) +
                              Field("md5sum", "*") + Field("message_definition", "a=b\n"));
    }
    chunk += Ros1Record(Field("op", "\x02") + number + Field("time", Ros1Time(entry.time_ns)),
                        entry.bytes);
    if (chunk.size() >= chunk_bytes) flush();
  }
  flush();
  return file;
}

bool WriteDb3(const std::filesystem::path& path, const std::vector<BagEntry>& entries) {
  sqlite3* database = nullptr;
  bool good = sqlite3_open(path.c_str(), &database) == SQLITE_OK;
  const auto run = [&](const std::string& sql, const std::string& blob) {
    sqlite3_stmt* statement = nullptr;
    good = good && sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK;
    if (good && sqlite3_bind_parameter_count(statement) == 1) {
      sqlite3_bind_blob(statement, 1, blob.data(), static_cast<int>(blob.size()), SQLITE_STATIC);
    }
    good = good && sqlite3_step(statement) == SQLITE_DONE;
    sqlite3_finalize(statement);
  };
  run("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
      "serialization_format TEXT NOT NULL)",
      "");
  run("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER "
      "NOT "
      "NULL, data BLOB NOT NULL)",
      "");
  run("BEGIN", "");
  std::map<std::string, std::size_t> topics;
  for (const BagEntry& entry : entries) {
    const auto [topic, is_new] = topics.try_emplace(entry.topic, topics.size() + 1);
    const std::string number = std::to_string(topic->second);
    if (is_new) {
      run("INSERT INTO topics VALUES(" + number + ", '" + entry.topic + "', '" + entry.type +
              "', 'cdr')",
          "");
    }
    run("INSERT INTO messages(topic_id, timestamp, data) VALUES(" + number + ", " +
            std::to_string(entry.time_ns) + ", ?)",
        entry.bytes);
  }
  run("COMMIT", "");
  sqlite3_close(database);
  return good;
}

}  // namespace strata::testing

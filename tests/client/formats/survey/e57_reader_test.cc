#include "client/formats/survey/e57_reader.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "client/formats/survey/e57_node.h"
#include "core/common/status.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/fuzz/input_file.h"
#include "tests/support/data_dir.h"
#include "tests/support/e57_pages.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::PutAt;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename T>
void Append(std::string& bytes, T value) {
  PutAt(bytes, bytes.size(), value);
}

// Bits one after the other, the lowest first.
class BitWriter {
 public:
  void Put(std::uint64_t value, int bits) {
    for (int i = 0; i < bits; ++i, ++count_) {
      if (count_ % 8 == 0) bytes_.push_back('\0');
      if ((value >> i & 1) != 0) bytes_.back() = static_cast<char>(bytes_.back() | 1 << count_ % 8);
    }
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t count_ = 0;
};

// One field of a prototype and the bytes of its stream.
struct Column {
  std::string xml;
  std::string bytes;
};

Column Doubles(const std::string& name, const std::vector<double>& values) {
  Column column{absl::StrCat("<", name, " type=\"Float\"/>"), {}};
  for (const double value : values) Append(column.bytes, value);
  return column;
}
Column Singles(const std::string& name, const std::vector<float>& values) {
  Column column{absl::StrCat("<", name, " type=\"Float\" precision=\"single\"/>"), {}};
  for (const float value : values) Append(column.bytes, value);
  return column;
}
Column Integers(const std::string& name,
                const std::vector<std::int64_t>& values,
                std::int64_t minimum,
                std::int64_t maximum,
                const std::string& scaled = "") {
  BitWriter bits;
  int width = 0;
  while (width < 64 &&
         ((static_cast<std::uint64_t>(maximum) - static_cast<std::uint64_t>(minimum)) >> width) !=
             0)
    ++width;
  for (const std::int64_t value : values) {
    bits.Put(static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(minimum), width);
  }
  return {absl::StrCat("<",
                       name,
                       " type=\"",
                       scaled.empty() ? "Integer" : "ScaledInteger",
                       "\" minimum=\"",
                       minimum,
                       "\" maximum=\"",
                       maximum,
                       "\" ",
                       scaled,
                       "/>"),
          bits.bytes()};
}

struct Scan {
  std::vector<Column> columns;
  std::size_t count = 0;
  std::string more;  // elements beside the points
};

// Data packets with `step` + 3 i bytes of stream i each, one of an index and an empty one between.
std::string PacketsOf(const Scan& scan, std::size_t step) {
  std::string packets;
  for (std::size_t round = 0;; ++round) {
    std::string packet(4, '\1');
    std::string data;
    Append(packet, static_cast<std::uint16_t>(scan.columns.size()));
    for (std::size_t i = 0; i < scan.columns.size(); ++i) {
      const std::size_t size = step + 3 * i;
      const std::string& bytes = scan.columns[i].bytes;
      const std::string piece =
          round * size < bytes.size() ? bytes.substr(round * size, size) : std::string();
      Append(packet, static_cast<std::uint16_t>(piece.size()));
      data += piece;
    }
    if (data.empty()) return packets;
    packet += data;
    packet.resize((packet.size() + 3) / 4 * 4);
    packet[1] = 0;
    PutAt(packet, 2, static_cast<std::uint16_t>(packet.size() - 1));
    packets += packet;
    if (round == 0) packets += std::string("\0\0\x0f\0", 4) + std::string(12, '\5');
    if (round == 0) packets += std::string("\2\0\3\0", 4);
  }
}

std::string FileOf(const std::vector<Scan>& scans, std::size_t step = 5) {
  std::string file(48, '\0');
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?><e57Root type=\"Structure\" "
      "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\"><data3D type=\"Vector\">";
  for (const Scan& scan : scans) {
    const std::size_t at = file.size();
    const std::string packets = PacketsOf(scan, step);
    Append<std::uint64_t>(file, 1);
    Append<std::uint64_t>(file, 32 + packets.size());
    Append<std::uint64_t>(file, testing::PhysicalE57(at + 32));
    Append<std::uint64_t>(file, 0);
    file += packets;
    absl::StrAppend(&xml,
                    "<vectorChild type=\"Structure\">",
                    scan.more,
                    "<points type=\"CompressedVector\" fileOffset=\"",
                    testing::PhysicalE57(at),
                    "\" recordCount=\"",
                    scan.count,
                    "\"><prototype type=\"Structure\">");
    for (const Column& column : scan.columns) xml += column.xml;
    xml += "</prototype><codecs type=\"Vector\"/></points></vectorChild>";
  }
  xml += "</data3D></e57Root>";
  const std::size_t xml_at = file.size();
  file += xml;
  const std::size_t pages = (file.size() + testing::kE57PagePayload - 1) / testing::kE57PagePayload;
  std::memcpy(file.data(), "ASTM-E57", 8);
  PutAt<std::uint32_t>(file, 8, 1);
  PutAt<std::uint64_t>(file, 16, pages * testing::kE57PageBytes);
  PutAt<std::uint64_t>(file, 24, testing::PhysicalE57(xml_at));
  PutAt<std::uint64_t>(file, 32, xml.size());
  PutAt<std::uint64_t>(file, 40, testing::kE57PageBytes);
  return testing::E57PagesOf(file);
}

Scan ThreePoints() {
  return {{Doubles("cartesianX", {1, 2, -3}),
           Singles("cartesianY", {4, 5.5F, 6}),
           Integers("cartesianZ", {-500, 0, 250}, -500, 500, "scale=\"0.001\" offset=\"2\"")},
          3,
          ""};
}

class E57ReaderTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(absl::string_view bytes) {
    std::ofstream(dir_.path() / "a.e57", std::ios::binary | std::ios::trunc) << bytes;
    return dir_.path() / "a.e57";
  }
  absl::StatusOr<PointCloud> Read(const std::vector<Scan>& scans, std::size_t step = 5) {
    return ReadScan(Write(FileOf(scans, step)));
  }
  // All scans of a file; the last cloud, or the first fault.
  absl::StatusOr<PointCloud> ReadAll(absl::string_view bytes) {
    const fuzz::InputFile file(bytes);  // no disk: damage is tried thousands of times
    STRATA_ASSIGN_OR_RETURN(const auto stations, ListE57Stations(file.path()));
    absl::StatusOr<PointCloud> cloud = absl::InvalidArgumentError("no scan");
    for (const Station& station : stations) {
      cloud = station.read();
      if (!cloud.ok()) return cloud;
    }
    return cloud;
  }
  testing::TempDir dir_;
};

TEST_F(E57ReaderTest, EveryEncodingComesBackHoweverPacketsCutIt) {
  for (const std::size_t step : {1, 2, 5, 8, 1000}) {
    SCOPED_TRACE(step);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, Read({ThreePoints()}, step));
    EXPECT_THAT(cloud.points,
                ElementsAre(Eigen::Vector3f(1, 4, 1.5F),
                            Eigen::Vector3f(2, 5.5F, 2),
                            Eigen::Vector3f(-3, 6, 2.25F)));
  }
}

TEST_F(E57ReaderTest, IntegersOfAnyWidthComeBack) {
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  for (int width = 1; width <= 64; ++width) {
    const std::int64_t minimum = width == 64 ? std::numeric_limits<std::int64_t>::min() : -7;
    const std::uint64_t span = ~std::uint64_t{0} >> (64 - width);
    const auto maximum = static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + span);
    Scan scan;
    std::vector<std::int64_t> values;
    std::vector<double> truth;
    for (int i = 0; i < 50; ++i) {
      const std::uint64_t bits = random() & span;
      values.push_back(static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + bits));
      truth.push_back(static_cast<double>(values.back()));
    }
    scan.columns = {Doubles("cartesianX", std::vector<double>(50, 1.0)),
                    Doubles("cartesianY", std::vector<double>(50, 1.0)),
                    Doubles("cartesianZ", std::vector<double>(50, 1.0)),
                    Integers("timeStamp", values, minimum, maximum)};
    scan.count = 50;
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, Read({scan}, 7));
    EXPECT_EQ(cloud.time, truth) << width;
  }
}

TEST_F(E57ReaderTest, SphericalPointsAndThoseThatAreInvalid) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const Scan scan{{Doubles("sphericalRange", {2, 3, 4, 5}),
                   Doubles("sphericalAzimuth", {kQuarter, 0, 0, 0}),
                   Doubles("sphericalElevation", {0, kQuarter, 0, 0}),
                   Integers("sphericalInvalidState", {0, 0, 2, 0}, 0, 2),
                   Integers("rowIndex", {0, 1, 2, 3}, 0, 3)},
                  4,
                  ""};
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, Read({scan}));
  ASSERT_EQ(cloud.size(), 3U);
  EXPECT_TRUE(cloud.points[0].isApprox(Eigen::Vector3f(0, 2, 0), 1e-6F));
  EXPECT_TRUE(cloud.points[1].isApprox(Eigen::Vector3f(0, 0, 3), 1e-6F));
  EXPECT_TRUE(cloud.points[2].isApprox(Eigen::Vector3f(5, 0, 0), 1e-6F));
}

TEST_F(E57ReaderTest, ChannelsComeWithThePoints) {
  Scan scan = ThreePoints();
  scan.columns.push_back({"<nor:note type=\"String\"/>", "\4a\4bb"});
  scan.columns.push_back(Integers("intensity", {0, 2000, 4095}, 0, 4095));
  scan.columns.push_back(Integers("colorRed", {0, 1023, 512}, 0, 1023));
  scan.columns.push_back(Integers("colorGreen", {1, 1, 1}, 0, 1));
  scan.columns.push_back(Integers("colorBlue", {7, 7, 7}, 7, 7));  // no bits at all
  scan.columns.push_back(Integers("las:classification", {2, 6, 0}, 0, 31));
  scan.more =
      "<colorLimits type=\"Structure\"><colorBlueMinimum type=\"Integer\"/>"
      "<colorBlueMaximum type=\"Integer\">14</colorBlueMaximum></colorLimits>";
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, Read({scan}));
  EXPECT_THAT(cloud.intensity, ElementsAre(0, 2000, 4095));
  EXPECT_THAT(cloud.colour,
              ElementsAre(Colour{0, 255, 128}, Colour{255, 255, 128}, Colour{128, 255, 128}));
  EXPECT_THAT(cloud.label, ElementsAre(2, 6, 0));
}

TEST_F(E57ReaderTest, EachScanOfAFileIsImportedWithItsPose) {
  Scan turned = ThreePoints();
  turned.more =
      "<pose type=\"Structure\"><rotation type=\"Structure\"><w "
      "type=\"Float\">0.7071067811865476</w>"
      "<x type=\"Float\"/><z type=\"Float\">0.7071067811865476</z></rotation><translation "
      "type=\"Structure\"><x type=\"Float\">4.5e+005</x><y "
      "type=\"Float\">-2</y></translation></pose>";
  Write(FileOf({ThreePoints(), turned}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({dir_.path()}, {}));
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_TRUE(scans[0].T_map_scan.isApprox(Pose::Identity()));
  EXPECT_TRUE(
      (scans[1].T_map_scan * Eigen::Vector3d(1, 0, 3)).isApprox(Eigen::Vector3d(450'000, -1, 3)));
  EXPECT_EQ(scans[1].path.filename(), "a.e57:1");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[1]));
  EXPECT_EQ(cloud.size(), 3U);
  EXPECT_THAT(ReadScan(dir_.path() / "a.e57"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("holds 2 scans")));
}

TEST_F(E57ReaderTest, RefusalsSayWhy) {
  const auto expect = [this](const std::string& bytes, const std::string& message) {
    EXPECT_THAT(ReadAll(bytes), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  const std::string good = FileOf({ThreePoints()});
  expect("ASTM-E57", "a header of 48 bytes");
  expect("ASTM-E58" + good.substr(8), "expected 'ASTM-E57'");
  expect(good.substr(0, good.size() - 1), "the file is cut short");
  std::string changed = good;
  changed[100] ^= 1;
  expect(changed, "page 0 (byte 0): the checksum is");
  expect(FileOf({}), "data3D is empty");
  Scan scan = ThreePoints();
  scan.count = 0;
  expect(FileOf({scan}), "a scan of 0 points");
  scan.count = 4;
  expect(FileOf({scan}), "expected 4 points, found 3");
  scan.count = std::size_t{1} << 60;
  expect(FileOf({scan}), "do not fit into");
  scan = ThreePoints();
  scan.columns.pop_back();
  expect(FileOf({scan}), "points have no field z");
  scan = ThreePoints();
  scan.columns[2].xml = absl::StrReplaceAll(scan.columns[2].xml, {{"\"-500\"", "\"501\""}});
  expect(FileOf({scan}), "minimum 501 > maximum 500");
  scan = ThreePoints();
  scan.columns[2].xml = absl::StrReplaceAll(scan.columns[2].xml, {{"0.001", "a"}});
  expect(FileOf({scan}), "'cartesianZ': scale is no number: 'a'");
  scan = ThreePoints();
  scan.more = "<pose type=\"Structure\"><rotation type=\"Structure\"/></pose>";
  STRATA_EXPECT_OK(ReadAll(FileOf({scan})));
  scan.more = "<pose type=\"Structure\"><rotation><w>2</w></rotation></pose>";
  expect(FileOf({scan}), "scan 0: pose: expected a unit quaternion");
}

TEST_F(E57ReaderTest, AScanThatIsDescribedWronglyLeavesTheOthers) {
  Scan bad = ThreePoints();
  bad.columns[2].xml = "<cartesianZ type=\"Integer\" minimum=\"1\" maximum=\"0\"/>";
  STRATA_ASSERT_OK_AND_ASSIGN(const auto stations,
                              ListE57Stations(Write(FileOf({bad, ThreePoints()}))));
  ASSERT_EQ(stations.size(), 2U);
  EXPECT_THAT(stations[0].read(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("scan 0: 'cartesianZ'")));
  STRATA_EXPECT_OK(stations[1].read());
}

TEST(E57NodeTest, XmlThatIsNone) {
  const auto expect = [](const std::string& xml, const std::string& message) {
    EXPECT_THAT(ParseE57Xml(xml), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "the XML is empty");
  expect("<a>\n<b></a>", "line 2 of the XML: mismatched tag");
  expect("<!DOCTYPE a [<!ENTITY b \"c\">]><a>&b;</a>", "a document type");
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += "<a>";
  expect(deep, "nested deeper than 64");
  STRATA_ASSERT_OK_AND_ASSIGN(const E57Node root,
                              ParseE57Xml("<a b='c'>x<![CDATA[<y>]]><d> 1e+2 </d></a>"));
  EXPECT_EQ(root.text, "x<y>");
  EXPECT_EQ(*root.Attribute("b"), "c");
  EXPECT_EQ(*root.NumberOf("d", 0.0), 100.0);
  EXPECT_EQ(*root.NumberOf("e", 7.0), 7.0);
}

// A file of everything, small enough to be damaged often.
std::string Everything() {
  Scan scan = ThreePoints();
  scan.columns.push_back(Integers("intensity", {0, 2000, 4095}, 0, 4095));
  scan.columns.push_back(Integers("colorRed", {0, 255, 12}, 0, 255));
  scan.columns.push_back(Integers("colorGreen", {0, 255, 12}, 0, 255));
  scan.columns.push_back(Integers("colorBlue", {0, 255, 12}, 0, 255));
  scan.more =
      "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">1</w></rotation>"
      "</pose>";
  return FileOf({scan, ThreePoints()});
}

TEST_F(E57ReaderTest, DamageIsAStatus) {
  testing::ExpectSoundOnDamage(
      Everything(), [this](absl::string_view bytes) { return ReadAll(bytes); }, 1);
}

TEST_F(E57ReaderTest, DamageThatTheChecksumsDoNotSeeIsAStatus) {
  testing::ExpectSoundOnDamage(
      Everything(),
      [this](absl::string_view bytes) {
        std::string sealed(bytes);
        testing::SealE57Pages(sealed);
        return ReadAll(sealed);
      },
      2);
}

Eigen::Vector3d SumOf(const PointCloud& cloud) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : cloud.points) sum += cloud.origin + p.cast<double>();
  return sum;
}

Eigen::Vector3d ColourSumOf(const PointCloud& cloud) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Colour& colour : cloud.colour) sum += Eigen::Vector3d(colour.r, colour.g, colour.b);
  return sum;
}

// Sums by a decoder in Python that shares nothing with this one.
TEST(E57RecordedTest, SamplesGiveTheirPoints) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud bunny, ReadScan(path / "e57_bunnyDouble.e57"));
  EXPECT_EQ(bunny.size(), 30'571U);
  EXPECT_LT((SumOf(bunny) - Eigen::Vector3d(-841.0932980, 3151.1987420, 264.2439720)).norm(), 1e-3);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : bunny.points) box.extend(p);
  EXPECT_TRUE(box.min().isApprox(Eigen::Vector3f(-0.094689F, 0.040011F, -0.061873F)));
  EXPECT_TRUE(box.max().isApprox(Eigen::Vector3f(0.061009F, 0.187321F, 0.058799F)));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cube, ReadScan(path / "e57_ColouredCubeFloat.e57"));
  EXPECT_EQ(cube.size(), 7'680U);
  EXPECT_LT((SumOf(cube) - Eigen::Vector3d(-49.72084770, 17.86287755, -30.59281796)).norm(), 1e-3);
  EXPECT_EQ(ColourSumOf(cube), Eigen::Vector3d(652'800, 652'800, 652'800));
  EXPECT_EQ(cube.colour.front(), (Colour{0, 0, 255}));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud laser,
                              ReadScan(path / "e57_ColourRepresentation.e57"));
  EXPECT_EQ(laser.size(), 153U);
  EXPECT_LT((SumOf(laser) - Eigen::Vector3d(-0.898, -0.129, -0.035)).norm(), 1e-5);
  EXPECT_EQ(ColourSumOf(laser), Eigen::Vector3d(12'700, 13'208, 12'954));
}

TEST(E57RecordedTest, BadSamplesAreRefusedWithTheReason) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  EXPECT_THAT(ReadScan(path / "e57_bad-crc.e57"),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       ::testing::AllOf(HasSubstr("e57_bad-crc.e57: page 0"),
                                        HasSubstr("the file is damaged"))));
  EXPECT_THAT(ReadScan(path / "e57_ZeroPoints.e57"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("a scan of 0 points")));
}

}  // namespace
}  // namespace strata

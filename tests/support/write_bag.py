#!/usr/bin/python3
"""Makes a bag of a folder of binary PCD files and a file of poses (index time x y z qx qy qz qw a line).

    tests/support/write_bag.py SCANS POSES OUT.mcap|OUT.db3|OUT.bag [--compression none|lz4|zstd|bz2]

The bag has the clouds (/points, frame lidar), the poses as odometry (/odom, of lidar in odom) and as transforms (/tf),
and text (/chatter). Written after the specifications of MCAP, CDR and ROS 1's bags and after a rosbag2 file, and by
nothing of what reads bags here. Needs Debian's python3-xxhash and, for zstd, python3-zstandard; lz4 frames have blocks
that are not compressed, which the format allows.
"""
import argparse
import bz2
import decimal
import pathlib
import re
import sqlite3
import struct
import zlib

PCD_TYPES = {("I", 1): 1, ("U", 1): 2, ("I", 2): 3, ("U", 2): 4, ("I", 4): 5, ("U", 4): 6, ("F", 4): 7, ("F", 8): 8}


class Message:
    """Values as CDR (little-endian, aligned) or as ROS 1 has them."""

    def __init__(self, ros1):
        self.ros1 = ros1
        self.body = bytearray()

    def put(self, code, *values):
        for value in values:
            size = struct.calcsize("<" + code)
            if not self.ros1:
                self.body += bytes(-len(self.body) % size)
            self.body += struct.pack("<" + code, value)
        return self

    def blob(self, data):
        self.put("I", len(data))
        self.body += data
        return self

    def text(self, text):
        return self.blob(text.encode() + (b"" if self.ros1 else b"\0"))

    def header(self, stamp_ns, frame):
        if self.ros1:
            self.put("I", 0)
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9).text(frame)

    def bytes(self):
        return bytes(self.body) if self.ros1 else b"\0\1\0\0" + bytes(self.body)


def cloud_message(ros1, stamp_ns, pcd):
    head, data = pcd.split(b"DATA binary\n", 1)
    lines = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if line and line[0] != "#"}
    width, height = int(lines["WIDTH"][0]), int(lines["HEIGHT"][0])
    sizes = list(map(int, lines["SIZE"]))
    message = Message(ros1).header(stamp_ns, "lidar").put("I", height, width, len(sizes))
    offset = 0
    for name, size, kind in zip(lines["FIELDS"], sizes, lines["TYPE"]):
        message.text(name).put("I", offset).put("B", PCD_TYPES[kind, size]).put("I", 1)
        offset += size
    message.put("B", 0).put("I", offset, offset * width)
    return message.blob(data[:offset * width * height]).put("B", 1).bytes()


def messages_of(scans, poses, ros1):
    """(topic, type without package's msg, time in ns, bytes) in the order of time."""
    stamped = {}
    for line in poses.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words and words[0] != "#":
            stamped[int(words[0])] = (int(decimal.Decimal(words[1]) * 10**9), list(map(float, words[2:])))
    for file in sorted(scans.glob("*.pcd")):
        index = int(re.findall(r"\d+", file.stem)[-1])
        stamp, pose = stamped[index]
        yield "/chatter", "std_msgs/String", stamp, Message(ros1).text(f"scan {index}").bytes()
        yield "/points", "sensor_msgs/PointCloud2", stamp, cloud_message(ros1, stamp, file.read_bytes())
        # Known only after the cloud, as odometry is.
        odometry = Message(ros1).header(stamp, "odom").text("lidar").put("d", *pose, *[0.0] * (36 + 6 + 36))
        yield "/odom", "nav_msgs/Odometry", stamp, odometry.bytes()
        transform = Message(ros1).put("I", 1).header(stamp, "odom").text("lidar").put("d", *pose)
        yield "/tf", "tf2_msgs/TFMessage", stamp, transform.bytes()


def lz4_frame(data):
    import xxhash
    flags = b"\x60\x70"  # version 1, independent blocks of up to 4 MiB
    frame = struct.pack("<I", 0x184D2204) + flags + bytes([xxhash.xxh32(flags).intdigest() >> 8 & 0xFF])
    for at in range(0, len(data), 1 << 22):
        block = data[at:at + (1 << 22)]
        frame += struct.pack("<I", len(block) | 1 << 31) + block
    return frame + struct.pack("<I", 0)


def packed(compression, data):
    if compression == "zstd":
        import zstandard
        return zstandard.ZstdCompressor(level=1).compress(data)
    return {"none": bytes, "lz4": lz4_frame, "bz2": bz2.compress}[compression](data)


def sized(data):
    data = data.encode() if isinstance(data, str) else data
    return struct.pack("<I", len(data)) + data


def ros2_type(name):
    return name.replace("/", "/msg/")


def write_mcap(messages, out, compression):
    def record(opcode, content):
        return struct.pack("<BQ", opcode, len(content)) + content

    def chunk(records, first, last):
        data = packed(compression, records)
        head = struct.pack("<QQQI", first, last, len(records), zlib.crc32(records))
        return record(6, head + sized("" if compression == "none" else compression) + struct.pack("<Q", len(data)) + data)

    magic = b"\x89MCAP0\r\n"
    with open(out, "wb") as file:
        file.write(magic + record(1, sized("ros2") + sized("write_bag.py")))
        channels, records, times = {}, b"", []
        for sequence, (topic, kind, stamp, data) in enumerate(messages):
            if topic not in channels:
                number = channels[topic] = len(channels)
                records += record(3, struct.pack("<H", number + 1) + sized(ros2_type(kind)) + sized("ros2msg") + sized(""))
                records += record(4, struct.pack("<HH", number, number + 1) + sized(topic) + sized("cdr") + sized(""))
            records += record(5, struct.pack("<HIQQ", channels[topic], sequence, stamp, stamp) + data)
            times.append(stamp)
            if len(records) > 1 << 20:
                file.write(chunk(records, min(times), max(times)))
                records, times = b"", []
        if records:
            file.write(chunk(records, min(times), max(times)))
        file.write(record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic)


def write_ros1(messages, out, compression):
    def record(data, **fields):
        head = b"".join(sized(name.encode() + b"=" + value) for name, value in fields.items())
        return sized(head) + sized(data)

    def chunk(records):
        return record(packed(compression, records), op=b"\5", compression=compression.encode(),
                      size=struct.pack("<I", len(records)))

    with open(out, "wb") as file:
        file.write(b"#ROSBAG V2.0\n")
        file.write(record(b" " * 4000, op=b"\3", index_pos=struct.pack("<Q", 1), conn_count=struct.pack("<I", 4),
                          chunk_count=struct.pack("<I", 1)))
        connections, records = {}, b""
        for topic, kind, stamp, data in messages:
            if topic not in connections:
                connections[topic] = struct.pack("<I", len(connections))
                about = {"topic": topic.encode(), "type": kind.encode(), "md5sum": b"*", "message_definition": b""}
                described = b"".join(sized(name.encode() + b"=" + value) for name, value in about.items())
                records += record(described, op=b"\7", conn=connections[topic], topic=topic.encode())
            time = struct.pack("<II", stamp // 10**9, stamp % 10**9)
            records += record(data, op=b"\2", conn=connections[topic], time=time)
            if len(records) > 1 << 20:
                file.write(chunk(records))
                records = b""
        if records:
            file.write(chunk(records))


def write_db3(messages, out):
    pathlib.Path(out).unlink(missing_ok=True)
    with sqlite3.connect(out) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,"
                         "serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,"
                         "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
        database.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
        topics = {}
        for topic, kind, stamp, data in messages:
            if topic not in topics:
                topics[topic] = len(topics) + 1
                database.execute("INSERT INTO topics VALUES(?,?,?,'cdr','')", (topics[topic], topic, ros2_type(kind)))
            database.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)", (topics[topic], stamp, data))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", type=pathlib.Path)
    parser.add_argument("poses", type=pathlib.Path)
    parser.add_argument("out")
    parser.add_argument("--compression", choices=["none", "lz4", "zstd", "bz2"], default="none")
    given = parser.parse_args()
    messages = list(messages_of(given.scans, given.poses, given.out.endswith(".bag")))
    if given.out.endswith(".mcap"):
        write_mcap(messages, given.out, given.compression)
    elif given.out.endswith(".bag"):
        write_ros1(messages, given.out, given.compression)
    else:
        write_db3(messages, given.out)
    print(f"{len(messages)} messages in {given.out}")


if __name__ == "__main__":
    main()

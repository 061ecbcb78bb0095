#!/usr/bin/python3
"""Makes one PTX or E57 file of a folder of binary PCD files and a file of poses (index time x y z qx qy qz qw a line).

    tests/support/write_survey.py SCANS POSES OUT.ptx|OUT.e57

Written after ASTM E2807 and Leica's description of PTX, and by nothing of what reads them here. Points are written as the
floats they are; PTX begins and ends every scan with a pulse that has no return.
"""
import pathlib
import re
import struct
import sys

PAYLOAD = 1020


def points_of(pcd):
    """Rows of x y z and, if there is one, intensity."""
    head, data = pcd.split(b"DATA binary\n", 1)
    lines = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if line and line[0] != "#"}
    sizes = [int(size) * int(count) for size, count in zip(lines["SIZE"], lines["COUNT"])]
    wanted = [name for name in ("x", "y", "z", "intensity") if name in lines["FIELDS"]]
    offsets = [sum(sizes[:lines["FIELDS"].index(name)]) for name in wanted]
    return [[struct.unpack_from("<f", data, at + offset)[0] for offset in offsets]
            for at in range(0, int(lines["POINTS"][0]) * sum(sizes), sum(sizes))]


def rotation_of(x, y, z, w):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def write_ptx(scans, out):
    with open(out, "w", encoding="ascii") as file:
        for points, pose in scans:
            numbers = [float(word) for word in pose]
            rotation = rotation_of(*numbers[3:])
            columns = [[rotation[row][column] for row in range(3)] for column in range(3)]
            rows = [numbers[:3], *columns, *(column + [0] for column in columns), numbers[:3] + [1]]
            print(len(points) + 2, 1, *(" ".join(map(repr, row)) for row in rows), sep="\n", file=file)
            for point in [[0.0] * 4, *points, [0.0] * 4]:
                print(*(point + [0.5])[:4], file=file)


def crc_of(data, table=[]):
    if not table:
        for byte in range(256):
            for _ in range(8):
                byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
            table.append(byte)
    crc = 0xFFFFFFFF
    for byte in data:
        crc = table[(crc ^ byte) & 255] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


def physical(logical):
    return logical // PAYLOAD * 1024 + logical % PAYLOAD


def packets_of(streams):
    size = 12000
    packets = b""
    for at in range(0, len(streams[0]), size):
        pieces = [stream[at:at + size] for stream in streams]
        body = struct.pack("<H", len(pieces)) + b"".join(struct.pack("<H", len(piece)) for piece in pieces) + b"".join(pieces)
        body += bytes(-len(body) % 4)
        packets += struct.pack("<BBH", 1, 0, len(body) + 3) + body
    return packets


def element(name, kind, content):
    return f'<{name} type="{kind}">{content}</{name}>'


def write_e57(scans, out):
    logical = bytearray(48)
    xml = ""
    for points, pose in scans:
        names = ["cartesianX", "cartesianY", "cartesianZ", "intensity"][:len(points[0])]
        streams = [struct.pack(f"<{len(points)}f", *column) for column in zip(*points)]
        packets = packets_of(streams)
        logical += bytes(-len(logical) % 4)
        at = len(logical)
        logical += struct.pack("<B7xQQQ", 1, 32 + len(packets), physical(at + 32), 0) + packets
        rotation = "".join(element(*field) for field in zip("xyzw", ["Float"] * 4, pose[3:]))
        translation = "".join(element(*field) for field in zip("xyz", ["Float"] * 3, pose[:3]))
        prototype = "".join(f'<{name} type="Float" precision="single"/>' for name in names)
        xml += element("vectorChild", "Structure",
                       element("pose", "Structure", element("rotation", "Structure", rotation)
                               + element("translation", "Structure", translation))
                       + f'<points type="CompressedVector" fileOffset="{physical(at)}" recordCount="{len(points)}">'
                       + element("prototype", "Structure", prototype) + '<codecs type="Vector"/></points>')
    xml = element('e57Root xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0"', "Structure",
                  element("data3D", "Vector", xml)).replace(
                      '</e57Root xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">', "</e57Root>").encode()
    xml_at = len(logical)
    logical += xml
    pages = -(-len(logical) // PAYLOAD)
    struct.pack_into("<8sIIQQQQ", logical, 0, b"ASTM-E57", 1, 0, pages * 1024, physical(xml_at), len(xml), 1024)
    logical += bytes(pages * PAYLOAD - len(logical))
    with open(out, "wb") as file:
        for at in range(0, len(logical), PAYLOAD):
            page = bytes(logical[at:at + PAYLOAD])
            file.write(page + struct.pack(">I", crc_of(page)))


def main():
    folder, poses, out = sys.argv[1:]
    files = sorted(pathlib.Path(folder).glob("*.pcd"), key=lambda path: int(re.findall(r"\d+", path.stem)[-1]))
    lines = [line.split() for line in pathlib.Path(poses).read_text(encoding="ascii").splitlines()]
    pose_of = {int(words[0]): words[2:9] for words in lines if words and words[0][0] != "#"}
    scans = [(points_of(path.read_bytes()), pose_of[int(re.findall(r"\d+", path.stem)[-1])]) for path in files]
    (write_ptx if out.endswith(".ptx") else write_e57)(scans, out)
    print(f"{len(scans)} scans in {out}")


if __name__ == "__main__":
    main()

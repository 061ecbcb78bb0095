#!/usr/bin/python3
"""Prints the points of a pcap file of a Velodyne VLP-16 or HDL-32E, after its user manuals and by nothing of what reads it here.

    tests/support/velodyne_points.py FILE.pcap

A line a point: number of the whole revolution, x, y, z [m], reflectivity, time since the revolution began [s]. Classic pcap,
Ethernet, IPv4.
"""
import math
import struct
import sys

VLP16 = dict(zip(range(16), zip([-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15],
                                [11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1, 5.1, -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2])))
HDL32 = [-30.67, -9.33, -29.33, -8.00, -28.00, -6.67, -26.67, -5.33, -25.33, -4.00, -24.00, -2.67, -22.67, -1.33, -21.33, 0.00,
         -20.00, 1.33, -18.67, 2.67, -17.33, 4.00, -16.00, 5.33, -14.67, 6.67, -13.33, 8.00, -12.00, 9.33, -10.67, 10.67]


def payloads(file):
    order = "<" if file[:4] == b"\xd4\xc3\xb2\xa1" else ">"
    at = 24
    while at + 16 <= len(file):
        size = struct.unpack_from(order + "I", file, at + 8)[0]
        frame = file[at + 16:at + 16 + size]
        at += 16 + size
        if frame[12:14] == b"\x08\x00" and frame[23] == 17:
            yield frame[14 + 4 * (frame[14] & 15) + 8:]


def blocks(file):
    """Each block: azimuth, how far it turns meanwhile, time [µs], shots (distance, reflectivity) and those before them, sensor."""
    for data in payloads(file):
        if len(data) != 1206:
            continue
        stamp, mode, model = struct.unpack_from("<IBB", data, 1200)
        vlp16, dual = model == 0x22, mode == 0x39
        azimuths = [struct.unpack_from("<H", data, 100 * i + 2)[0] for i in range(12)]
        shots = [[struct.unpack_from("<HB", data, 100 * i + 4 + 3 * k) for k in range(32)] for i in range(12)]
        apart = 2 if dual else 1
        for i in range(12):
            gap = (azimuths[i + apart] - azimuths[i]) % 36000 if i + apart < 12 else 99999
            if gap > 200 and i >= apart:
                gap = (azimuths[i] - azimuths[i - apart]) % 36000
            if gap > 200:
                gap = 0
            firing = i // 2 if dual else i
            before = shots[i - 1] if dual and i % 2 else [None] * 32
            yield azimuths[i], gap, stamp + firing * (110.592 if vlp16 else 46.08), shots[i], before, vlp16


def points(file):
    revolution, last, start = -1, None, 0.0
    for azimuth, gap, time, shots, before, vlp16 in blocks(file):
        if last is not None and azimuth < last - 18000:
            revolution, start = revolution + 1, time
        last = azimuth
        if revolution < 0:
            continue
        for k, shot in enumerate(shots):
            if shot[0] == 0 or shot == before[k]:
                continue
            after = (55.296 * (k // 16) + 2.304 * (k % 16)) if vlp16 else 1.152 * k
            alpha = math.radians((azimuth + gap * after / (110.592 if vlp16 else 46.08)) / 100)
            omega, lift = VLP16[k % 16] if vlp16 else (HDL32[k], 0.0)
            omega = math.radians(omega)
            r = shot[0] * 0.002
            # The manuals have y forward and x to the right.
            right, forward = r * math.cos(omega) * math.sin(alpha), r * math.cos(omega) * math.cos(alpha)
            elapsed = time + after - start
            yield revolution, forward, -right, r * math.sin(omega) + lift / 1000, shot[1], (elapsed if elapsed > -1e6 else elapsed + 3.6e9) / 1e6


everything = list(points(open(sys.argv[1], "rb").read()))
whole = max((point[0] for point in everything), default=0)  # the last one has no end
for point in everything:
    if point[0] < whole:
        print("%d %.9g %.9g %.9g %d %.9g" % point)

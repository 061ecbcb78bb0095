#!/usr/bin/python3
"""Makes a bag of a robot whose laser nods while it drives through a room, and the robot's description.

    tests/support/write_laser_bag.py OUT.mcap|OUT.db3|OUT.bag OUT.urdf

The bag has the laser's lines (/scan, 40 Hz, each beam from where it was then), the joints (/joint_states, 100 Hz) and
odometry (/odom, 50 Hz), and no transforms.
"""
import argparse

import numpy
from write_bag import Message, write_db3, write_mcap, write_ros1

START_NS = 1_700_000_000 * 10**9
SECONDS = 16.0
BEAMS, FIRST_RAD, LAST_RAD, BEAM_S = 271, -2.356, 2.356, 5e-5
NEAR_M, FAR_M, NOISE_M = 0.1, 30.0, 0.01
ROBOT = """<robot name="nodder">
  <link name="base_link"/><link name="plate"/><link name="laser"/>
  <joint name="nod" type="revolute"><parent link="base_link"/><child link="plate"/>
    <origin xyz="0.3 0 0.8"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="2"/></joint>
  <joint name="mount" type="fixed"><parent link="plate"/><child link="laser"/><origin xyz="0.05 0 0.1"/></joint>
</robot>
"""
# (low corner, high corner) [m]: seen from inside, then from outside.
ROOM = numpy.array([[-7.0, -5.0, 0.0], [7.0, 5.0, 3.2]])
THINGS = numpy.array([[[-5.0, 2.0, 0.0], [-4.0, 3.0, 1.5]], [[-2.0, -4.0, 0.0], [-1.2, -2.5, 2.2]],
                      [[0.5, 2.2, 0.0], [2.5, 3.0, 0.8]], [[3.5, -3.5, 0.0], [4.2, -2.0, 1.2]],
                      [[4.5, 1.5, 0.0], [5.5, 3.5, 2.0]], [[-6.9, -4.9, 2.4], [-3.0, -4.2, 2.6]]])


def turn(axis, angle):
    """Matrices of rotations about x, y or z (0, 1, 2) for an array of angles."""
    matrix = numpy.zeros((len(angle), 3, 3))
    matrix[:, axis, axis] = 1.0
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[:, i, i] = matrix[:, j, j] = numpy.cos(angle)
    matrix[:, i, j], matrix[:, j, i] = -numpy.sin(angle), numpy.sin(angle)
    return matrix


def nod(t):
    return 0.8 * numpy.cos(numpy.pi * t / 2.0)


def base(t):
    """Where the robot is at times t: x, y, heading."""
    return -4.5 + 0.5 * t, 1.2 * numpy.sin(0.4 * t), 0.5 * numpy.cos(0.4 * t)


def ranges(origin, along):
    """To the first surface from every origin (n, 3) along a direction (n, 3)."""
    with numpy.errstate(divide="ignore"):
        to = (numpy.stack([ROOM, *THINGS])[:, :, None, :] - origin) / along  # box, corner, ray, axis
    near, far = to.min(axis=1).max(axis=2), to.max(axis=1).min(axis=2)
    outside = numpy.where((near[1:] <= far[1:]) & (near[1:] > 0), near[1:], numpy.inf)
    return numpy.minimum(far[0], outside.min(axis=0))


def line(t, random):
    """The ranges of a line that begins at t."""
    at = t + BEAM_S * numpy.arange(BEAMS)
    x, y, heading = base(at)
    robot, plate = turn(2, heading), turn(1, nod(at))
    centre = numpy.stack([x, y, numpy.zeros(BEAMS)], axis=1)
    arm = plate @ numpy.array([0.05, 0.0, 0.1]) + numpy.array([0.3, 0.0, 0.8])
    origin = centre + numpy.einsum("nij,nj->ni", robot, arm)
    angle = numpy.linspace(FIRST_RAD, LAST_RAD, BEAMS)
    beam = numpy.stack([numpy.cos(angle), numpy.sin(angle), numpy.zeros(BEAMS)], axis=1)
    return ranges(origin, numpy.einsum("nij,nj->ni", robot @ plate, beam)) + random.normal(0.0, NOISE_M, BEAMS)


def messages_of(ros1):
    """(topic, type, time in ns, bytes) in the order of time."""
    random = numpy.random.default_rng(1)
    found = []

    def add(topic, kind, t, fill):
        stamp = START_NS + round(1e9 * t)
        found.append((topic, kind, stamp, fill(Message(ros1), stamp).bytes()))

    for t in numpy.arange(0.0, SECONDS + 0.1, 0.01):
        add("/joint_states", "sensor_msgs/JointState", t, lambda m, stamp, t=t: m.header(stamp, "").put("I", 1).text(
            "nod").put("I", 1).put("d", nod(t)).put("I", 0, 0))
    for t in numpy.arange(0.0, SECONDS + 0.1, 0.02):
        x, y, heading = base(t)
        pose = [x, y, 0.0, 0.0, 0.0, numpy.sin(heading / 2), numpy.cos(heading / 2)]
        add("/odom", "nav_msgs/Odometry", t, lambda m, stamp, pose=pose: m.header(stamp, "odom").text(
            "base_link").put("d", *pose, *[0.0] * (36 + 6 + 36)))
    for t in numpy.arange(0.0, SECONDS, 0.025):
        head = [FIRST_RAD, LAST_RAD, (LAST_RAD - FIRST_RAD) / (BEAMS - 1), BEAM_S, 0.025, NEAR_M, FAR_M]
        add("/scan", "sensor_msgs/LaserScan", t, lambda m, stamp, t=t, head=head: m.header(stamp, "laser").put(
            "f", *head).put("I", BEAMS).put("f", *line(t, random)).put("I", 0))
    return sorted(found, key=lambda message: message[2])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("urdf")
    given = parser.parse_args()
    with open(given.urdf, "w", encoding="utf-8") as file:
        file.write(ROBOT)
    messages = messages_of(given.out.endswith(".bag"))
    if given.out.endswith(".mcap"):
        write_mcap(messages, given.out, "none")
    elif given.out.endswith(".bag"):
        write_ros1(messages, given.out, "none")
    else:
        write_db3(messages, given.out)
    print(f"{len(messages)} messages in {given.out}")


if __name__ == "__main__":
    main()

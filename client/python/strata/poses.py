"""Poses T_a_b (p_a = T_a_b * p_b) as 4 × 4 matrices of doubles; metres."""
import numpy as np

from strata.arrays import Array, ArrayLike
from strata.v1 import geometry_pb2

_TOLERANCE = 1e-3  # of a rotation, as the server's


PoseLike = ArrayLike | tuple[ArrayLike, ArrayLike] | None
"""A pose as users write it: a 4 × 4 matrix, (translation, quaternion x y z w), or None for the identity."""


def _matrix_of_quaternion(quaternion: Array | tuple[float, float, float, float]) -> Array:
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def _quaternion_of_matrix(r: Array) -> Array:
    """(x, y, z, w) by Shepperd's method: from the largest of the four, so that nothing is lost."""
    four_squares = 1 + np.array([[1, -1, -1], [-1, 1, -1], [-1, -1, 1], [1, 1, 1]]) @ np.diag(r)
    largest = int(np.argmax(four_squares))
    q = np.empty(4)
    q[largest] = four_squares[largest]
    if largest == 3:
        q[:3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q[j], q[k], q[3] = r[j, i] + r[i, j], r[k, i] + r[i, k], r[k, j] - r[j, k]
    return q / np.linalg.norm(q)


def matrix(pose: PoseLike) -> Array:
    """A pose as users write it: a 4 × 4 matrix, (translation, quaternion x y z w), or None for the identity.

    Raises ValueError for what is no rigid pose.
    """
    result: Array = np.eye(4)
    if pose is None:
        return result
    if isinstance(pose, (tuple, list)) and len(pose) == 2:
        translation, quaternion = (np.asarray(part, dtype=float) for part in pose)
        if translation.shape != (3,) or quaternion.shape != (4,):
            raise ValueError(f"pose of shapes {translation.shape} and {quaternion.shape}; expected (3,) and (4,)")
        norm = np.linalg.norm(quaternion)
        if not abs(norm - 1) <= _TOLERANCE:
            raise ValueError(f"quaternion of length {norm:g}; expected 1")
        result[:3, :3] = _matrix_of_quaternion(quaternion / norm)
        result[:3, 3] = translation
    else:
        result = np.array(pose, dtype=float)
        if result.shape != (4, 4):
            raise ValueError(f"pose of shape {result.shape}; expected (4, 4), or (translation, quaternion)")
        rotation = result[:3, :3]
        rigid = np.allclose(rotation.T @ rotation, np.eye(3), rtol=0, atol=_TOLERANCE) and np.linalg.det(rotation) > 0
        if not rigid or not np.array_equal(result[3], [0, 0, 0, 1]):
            raise ValueError(f"pose is not rigid: {result.tolist()}")
    if not np.isfinite(result).all():
        raise ValueError(f"pose is not finite: {result.tolist()}")
    return result


def to_proto(pose: Array) -> geometry_pb2.Pose:
    """The message of a 4 × 4 matrix."""
    x, y, z, w = _quaternion_of_matrix(pose[:3, :3])
    return geometry_pb2.Pose(translation=vector3(pose[:3, 3]),
                             rotation=geometry_pb2.Quaternion(x=x, y=y, z=z, w=w))


def from_proto(message: geometry_pb2.Pose) -> Array:
    """The 4 × 4 matrix of a message."""
    result = np.eye(4)
    if message.HasField("rotation"):
        q = message.rotation
        result[:3, :3] = _matrix_of_quaternion((q.x, q.y, q.z, q.w))
    result[:3, 3] = array3(message.translation)
    return result


def vector3(numbers: ArrayLike) -> geometry_pb2.Vector3:
    x, y, z = np.asarray(numbers, dtype=float).tolist()
    return geometry_pb2.Vector3(x=x, y=y, z=z)


def array3(message: geometry_pb2.Vector3) -> Array:
    return np.array([message.x, message.y, message.z])


def six_by_six(numbers: ArrayLike, name: str) -> list[float]:
    """The 36 numbers of a covariance or information matrix, row by row."""
    array = np.asarray(numbers, dtype=float)
    if array.shape != (6, 6):
        raise ValueError(f"{name} of shape {array.shape}; expected (6, 6)")
    numbers_of_rows: list[float] = array.ravel().tolist()
    return numbers_of_rows

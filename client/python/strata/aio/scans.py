"""Scans of a map: sending, listing, fetching back, following a robot."""
import collections
import contextlib
import datetime
from collections.abc import AsyncGenerator, Iterable, Mapping
from typing import Any

import numpy as np

from strata import errors, ingest, poses, scan
from strata.aio.calls import MapCalls
from strata.aio.tracking import Tracking
from strata.arrays import Array, ArrayLike
from strata.connection import Pipe, is_passing
from strata.poses import PoseLike
from strata.scan import Ack, Points, Scan, ScanLike, Upload
from strata.v1 import geometry_pb2, posegraph_pb2, scans_pb2


class Scans(MapCalls):
    async def upload(self, points: ArrayLike, pose: PoseLike = None, *, trajectory: str | None = None,
                     sequence: int | None = None, time: float | datetime.datetime | None = None,
                     intensity: ArrayLike | None = None, rgb: ArrayLike | None = None, labels: ArrayLike | None = None,
                     sensor_origin: ArrayLike | None = None, align: bool = True) -> Ack:
        """Sends a scan and returns its Ack once it is durable. The same scan sent again changes nothing.

        points: (n, 3) in the scan frame [m], or (rows, columns, 3) of an organised scan, NaN without a return.
        pose: T_map_scan, roughly: (4, 4), or (translation (3,), quaternion (x, y, z, w)); None: the identity.
        trajectory: name of this run of this robot; None: self.trajectory. sequence: place of the scan in it; None: the
        one after the last. Together they name the scan: another one of that name is refused (AlreadyExists).
        time: seconds since 1970, or a datetime. intensity: (n,). rgb: (n, 3), 0 to 255. labels: (n,) class ids of the
        map, 0: none. sensor_origin: (3,) where the sensor stood, in the scan frame [m]; None: its zero.
        align: False takes the pose as it is.

        Coordinates travel in single precision. Where all points lie kilometres to one side of zero, their rounded
        middle is taken off them and put into the pose first, so that nothing is lost: the scan frame that the map knows
        is then the one moved there.
        """
        upload = scan.Upload(points, pose, time=time, intensity=intensity, rgb=rgb, labels=labels,
                             sensor_origin=sensor_origin, align=align)
        await self._name(upload, trajectory, sequence)

        async def attempt() -> scans_pb2.UploadScanResponse:
            return await self._connection.send(self._scans.Upload, upload.messages(self.name))

        return scan.ack_from_proto(upload.header.id, (await self._connection.repeated(attempt)).ack)

    async def _name(self, upload: Upload, trajectory: str | None, sequence: int | None) -> None:
        trajectory = trajectory or self.trajectory
        if sequence is None:
            sequence = await self._next_sequence(trajectory)
        upload.header.id.CopyFrom(scans_pb2.ScanId(trajectory=trajectory, sequence=sequence))

    async def _next_sequence(self, trajectory: str) -> int:
        if trajectory not in self._last_sequence:
            last = await self.last_sequence(trajectory)
            with self._lock:
                self._last_sequence.setdefault(trajectory, last)
        with self._lock:
            self._last_sequence[trajectory] += 1
            return self._last_sequence[trajectory]

    async def ingest(self, scans: Iterable[Mapping[str, Any]]) -> AsyncGenerator[Ack | errors.StrataError, None]:
        """Sends many scans on one stream, eight of them under way at a time; yields for each, in order, its Ack, or the
        StrataError that says why it was not taken. A stream that breaks off goes on with what was not acknowledged.

            for answer in campus.ingest({"points": points, "pose": pose} for points, pose in drive):
                ...

        scans: arguments of upload(), one dictionary a scan; taken as there is room. Raises ValueError for a scan that is
        none, and what ends the stream.
        """
        source = iter(scans)
        waiting: collections.deque[scan.Upload] = collections.deque()
        backoff = self._connection.new_backoff()
        while True:
            pipe, answers = self._connection.pipe(self._scans.Ingest)
            try:
                async with contextlib.aclosing(answers):
                    for upload in waiting:
                        ingest.put(pipe, upload, self.name)
                    while await self._fill(waiting, source, pipe):
                        answer = await ingest.answer_of(answers)
                        if isinstance(answer, errors.StrataError) and is_passing(answer):
                            raise answer
                        backoff = self._connection.new_backoff()
                        name = waiting.popleft().header.id
                        yield answer if isinstance(answer, errors.StrataError) else scan.ack_from_proto(name, answer)
                    pipe.end()
                    async for _ in answers:
                        pass
                    return
            except errors.StrataError as failure:
                await self._connection.wait(backoff, failure)
            finally:
                pipe.end()

    async def _fill(self, waiting: collections.deque[Upload], source: Any,
                    pipe: Pipe[scans_pb2.IngestScansRequest]) -> bool:
        """Takes scans from the source and sends them while there is room; whether any is under way then."""
        while len(waiting) < ingest.MAX_WAITING and (arguments := next(source, None)) is not None:
            upload, trajectory, sequence = ingest.upload_of(arguments)
            await self._name(upload, trajectory, sequence)
            waiting.append(upload)
            ingest.put(pipe, upload, self.name)
        return bool(waiting)

    async def upload_local_map(self, local_map: bytes, pose: PoseLike = None, *, gap_size: float = 1.0,
                               thickness: float = 0.1, trajectory: str | None = None, sequence: int | None = None,
                               time: float | datetime.datetime | None = None, align: bool = True) -> Ack:
        """Sends a scan as the local map that its robot has made of the points, which stay with the robot → Ack.

        local_map: tiles with all statistics, each after its length (32 bits, little-endian), as the C++ library makes them
        (strata::EncodeLocalMap). gap_size, thickness: it was made with, the map's. Else as upload().
        """
        upload = scan.Upload.of_header(pose, time=time, align=align)
        await self._name(upload, trajectory, sequence)
        start = scans_pb2.UploadLocalMapStart(map=self.name, header=upload.header, cell_size_m=self.cell_size,
                                              gap_size_m=gap_size, thickness_m=thickness)
        requests = [scans_pb2.UploadLocalMapRequest(start=start)]
        requests += [scans_pb2.UploadLocalMapRequest(local_map=part) for part in scan.pieces(local_map)]

        async def attempt() -> scans_pb2.UploadLocalMapResponse:
            return await self._connection.send(self._scans.UploadLocalMap, requests)

        return scan.ack_from_proto(upload.header.id, (await self._connection.repeated(attempt)).ack)

    async def last_sequence(self, trajectory: str) -> int:
        """Highest committed sequence of a trajectory, where a robot goes on; 0 if it has none."""
        request = scans_pb2.GetUploadStateRequest(map=self.name, trajectory=trajectory)
        return (await self._connection.unary(self._scans.GetUploadState, request)).last_sequence

    async def scan(self, which: ScanLike) -> Scan:
        """A scan as it is now: of a Scan, an Ack or (trajectory, sequence); NotFound."""
        request = scans_pb2.GetScanRequest(map=self.name, id=scan.id_of(which))
        return scan.from_proto((await self._connection.unary(self._scans.Get, request)).scan)

    async def scans(self, trajectory: str | None = None, box: ArrayLike | None = None) -> list[Scan]:
        """All Scans in the order of acknowledgement; of one trajectory, or that meet a box (x0, y0, x1, y1) [m]."""
        request = scans_pb2.ListScansRequest(map=self.name, trajectory=trajectory)
        if box is not None:
            x0, y0, x1, y1 = np.asarray(box, dtype=float).tolist()
            request.box.CopyFrom(geometry_pb2.Box2(min=geometry_pb2.Vector2(x=x0, y=y0),
                                                   max=geometry_pb2.Vector2(x=x1, y=y1)))
        answers = await self._connection.collected(self._scans.List, request)
        return [scan.from_proto(info) for answer in answers for info in answer.scans]

    async def points(self, which: ScanLike) -> Points:
        """Points of a scan: of a Scan, an Ack or (trajectory, sequence)."""
        request = scans_pb2.GetScanPointsRequest(map=self.name, id=scan.id_of(which))
        answers = await self._connection.collected(self._scans.GetPoints, request)
        return scan.points_from_proto([answer.chunk for answer in answers])

    async def faded(self, which: ScanLike) -> Array:
        """(n,) uint16: for each point of a scan how many later scans looked through the place where it was, 0 if it has
        not faded; empty if none of them has."""
        request = scans_pb2.GetFadedPointsRequest(map=self.name, id=scan.id_of(which))
        answers = await self._connection.collected(self._scans.GetFaded, request)
        return np.frombuffer(b"".join(answer.scans for answer in answers), "<u2")

    async def set_labels(self, which: ScanLike, labels: ArrayLike, *, update: bool = False) -> None:
        """Says what the points of a scan are: (n,) class ids of the map, one a point in the order of points(), 0: none.

        update: a 0 leaves what people said of the point before; otherwise these labels take the place of all that people
        said. Raises InvalidArgument for more or fewer labels than points.
        """
        start = scans_pb2.SetScanLabelsStart(map=self.name, id=scan.id_of(which), update=update)
        requests = [scans_pb2.SetScanLabelsRequest(start=start)]
        requests += [scans_pb2.SetScanLabelsRequest(labels=part) for part in scan.pieces(scan.label_bytes(labels))]

        async def attempt() -> scans_pb2.SetScanLabelsResponse:
            return await self._connection.send(self._scans.SetLabels, requests)

        await self._connection.repeated(attempt)

    async def delete_scan(self, which: ScanLike) -> None:
        """Takes a scan, its points and its contribution out of the map."""
        await self._connection.once(self._scans.Delete,
                                    scans_pb2.DeleteScanRequest(map=self.name, id=scan.id_of(which)))

    async def follow(self, guess: PoseLike = None, *, guess_radius: float = 20.0) -> Tracking:
        """Follows a robot by its odometry and its scans → Tracking, a context manager: what step() is given comes back as
        poses in the map, with covariance and score. guess: roughly where the first scan is taken, as every pose; None:
        anywhere. guess_radius: not farther from it than that [m]."""
        start = posegraph_pb2.TrackStart(map=self.name, guess_radius_m=guess_radius)
        if guess is not None:
            start.guess.CopyFrom(poses.to_proto(poses.matrix(guess)))

        async def attempt() -> Tracking:
            tracking = Tracking(*self._connection.pipe(self._posegraph.Track))
            await tracking.begin(start)
            return tracking

        return await self._connection.where_the_map_is(attempt)

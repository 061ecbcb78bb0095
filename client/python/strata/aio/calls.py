"""What all calls on one map share."""
import secrets
import threading
import time

from strata.connection import Connection
from strata.v1 import (classifiers_pb2_grpc, jobs_pb2_grpc, maps_pb2_grpc, models_pb2_grpc, objects_pb2_grpc,
                       planning_pb2_grpc, posegraph_pb2_grpc, scans_pb2_grpc, tiles_pb2_grpc)


class MapCalls:
    """A map on a server, and the stubs of all services."""

    def __init__(self, connection: Connection, name: str, cell_size: float) -> None:
        self.name = name
        self.cell_size = cell_size
        """Edge of a cell [m]."""
        self.trajectory = f"run-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())}-{secrets.token_hex(3)}"
        """Of uploads that name none; this object's own."""
        self._connection = connection
        channel = connection.stubs
        self._maps = maps_pb2_grpc.MapsStub(channel)
        self._scans = scans_pb2_grpc.ScansStub(channel)
        self._tiles = tiles_pb2_grpc.TilesStub(channel)
        self._planning = planning_pb2_grpc.PlanningStub(channel)
        self._jobs = jobs_pb2_grpc.JobsStub(channel)
        self._models = models_pb2_grpc.ModelsStub(channel)
        self._objects = objects_pb2_grpc.ObjectsStub(channel)
        self._posegraph = posegraph_pb2_grpc.PoseGraphStub(channel)
        self._classifiers = classifiers_pb2_grpc.ClassifiersStub(channel)
        self._lock = threading.Lock()
        self._last_sequence: dict[str, int] = {}

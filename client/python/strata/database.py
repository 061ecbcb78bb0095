"""A server of maps."""
from strata import plan
from strata.connection import Connection
from strata.errors import AlreadyExists
from strata.map import Map
from strata.v1 import maps_pb2, maps_pb2_grpc


def connect(target="127.0.0.1:50051", **options):
    """The Database at target, HOST:PORT. A context manager: leaving it closes the connection.

    token: the bearer token that the server's owner gave you. Without TLS anybody on the way can read it.
    ca: file of the root certificates to trust, PEM, or True for those of the system; None: no TLS.
    certificate, key: files of this client's own certificate and its key, PEM, for servers that ask for it.
    timeout: seconds that a single call may take, uploads and this one included; None: as long as it takes.
    patience: seconds for which a call that may be repeated puts up with a server that is away or busy.

    Raises Unavailable if nobody answers within ten seconds, or `timeout`.
    """
    return Database(Connection(target, **options))


class Database:
    """Thread-safe."""

    def __init__(self, connection):
        self._connection = connection
        self._stub = maps_pb2_grpc.MapsStub(connection.channel)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._connection.close()

    def create_map(self, name, *, cell_size=None, gap_size=None, thickness=None, profile=None, keep_points=True,
                   fade_after=0, exist_ok=False):
        """A new, empty map.

        cell_size, gap_size, thickness: of its surfaces [m]; None: 0.1, 1 and 0.1. profile: {"radius": 0.3, …} of the
        robot whose traversability the tiles carry, see Map.plan. keep_points False: points are dropped once a scan is
        in the tiles. fade_after: later scans that must have looked through a place for what was there to fade by itself;
        0: nothing does. exist_ok: a map of that name is taken as it is. Raises AlreadyExists, InvalidArgument.
        """
        mls = {"cell_size_m": cell_size, "gap_size_m": gap_size, "thickness_m": thickness}
        parameters = maps_pb2.MapParameters(
            mls=maps_pb2.MlsParameters(**{field: value for field, value in mls.items() if value is not None}),
            default_profile=plan.profile_to_proto(profile or {}), keep_points=keep_points,
            fade_after=fade_after)
        request = maps_pb2.CreateMapRequest(name=name, parameters=parameters)
        call = self._connection.unary if exist_ok else self._connection.once
        try:
            call(self._stub.Create, request)
        except AlreadyExists:
            if not exist_ok:
                raise
        return self.map(name)

    def map(self, name):
        """The map of that name; NotFound."""
        answer = self._connection.unary(self._stub.Get, maps_pb2.GetMapRequest(name=name))
        return Map(self._connection, name, answer.map.parameters.mls.cell_size_m)

    def maps(self):
        """Names of all maps, sorted."""
        answer = self._connection.unary(self._stub.List, maps_pb2.ListMapsRequest())
        return [info.name for info in answer.maps]

    def delete_map(self, name):
        """Deletes the map with all it holds, for good."""
        self._connection.once(self._stub.Delete, maps_pb2.DeleteMapRequest(name=name))

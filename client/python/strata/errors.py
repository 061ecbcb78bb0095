"""What goes wrong, as exceptions."""
from typing import Any

import grpc

from strata.v1 import error_pb2


class StrataError(Exception):
    """A call that did not succeed. `str()` is the message: the thing, its value, the bound or the cure."""

    code: grpc.StatusCode = grpc.StatusCode.UNKNOWN

    def __init__(self, message: str, *, reason: str = "", retry_delay: float | None = None, request_id: str = "",
                 owner: str | None = None) -> None:
        super().__init__(message)
        self.reason = reason
        """Who refused: REQUEST, DATABASE, SERVER_BUSY, SHUTTING_DOWN, SLOW_READER, OTHER_SERVER; "" if nobody said."""
        self.retry_delay = retry_delay
        """Seconds after which the same call may succeed; None where the server named none."""
        self.request_id = request_id
        """Of the call in the server's log."""
        self.owner = owner
        """With OTHER_SERVER: what the server calls itself that has the map; nothing has happened here."""


class InvalidArgument(StrataError, ValueError):
    code = grpc.StatusCode.INVALID_ARGUMENT


class NotFound(StrataError, LookupError):
    code = grpc.StatusCode.NOT_FOUND


class AlreadyExists(StrataError):
    """Also: another scan has the same trajectory and sequence."""

    code = grpc.StatusCode.ALREADY_EXISTS


class FailedPrecondition(StrataError):
    """Also: a job that failed or was cancelled."""

    code = grpc.StatusCode.FAILED_PRECONDITION


class ResourceExhausted(StrataError):
    code = grpc.StatusCode.RESOURCE_EXHAUSTED


class Unavailable(StrataError, ConnectionError):
    code = grpc.StatusCode.UNAVAILABLE


class DeadlineExceeded(StrataError, TimeoutError):
    code = grpc.StatusCode.DEADLINE_EXCEEDED


class Cancelled(StrataError):
    code = grpc.StatusCode.CANCELLED


class Unauthenticated(StrataError):
    code = grpc.StatusCode.UNAUTHENTICATED


class PermissionDenied(StrataError):
    code = grpc.StatusCode.PERMISSION_DENIED


class DataLoss(StrataError):
    """Bytes that are not what was written; also of a tile that this program was given."""

    code = grpc.StatusCode.DATA_LOSS


class Unimplemented(StrataError):
    code = grpc.StatusCode.UNIMPLEMENTED


_BY_CODE = {kind.code: kind for kind in StrataError.__subclasses__()}


def _detail_of(error: Any) -> error_pb2.ErrorDetail:
    for key, value in error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            status = error_pb2.ErrorStatus.FromString(value)
            detail = error_pb2.ErrorDetail()
            if status.details and status.details[0].Unpack(detail):
                return detail
    return error_pb2.ErrorDetail()


def from_detail(code: grpc.StatusCode, message: str, detail: error_pb2.ErrorDetail) -> StrataError:
    """The StrataError of a canonical code and what a server says of it."""
    delay = detail.metadata.get("retry_delay_ms")
    kind = _BY_CODE.get(code, StrataError)
    made = kind(message or code.name, reason=detail.reason, retry_delay=int(delay) / 1000 if delay else None,
                request_id=detail.metadata.get("request_id", ""), owner=detail.metadata.get("owner"))
    made.code = code
    return made


def from_rpc(error: Any) -> StrataError:
    """The StrataError that a grpc.RpcError stands for."""
    detail = _detail_of(error)
    if error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED and not detail.reason and "RST_STREAM" in (error.details() or ""):
        # Below the calls (HTTP/2's ENHANCE_YOUR_CALM), where nobody says when to try again.
        return Unavailable(f"the server was short of memory and dropped the call ({error.details()})")
    return from_detail(error.code(), error.details() or "", detail)

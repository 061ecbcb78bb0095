"""Many scans on one stream."""
from collections.abc import AsyncGenerator, Mapping
from typing import Any

import grpc

from strata import errors, scan
from strata.connection import Pipe
from strata.v1 import scans_pb2

MAX_WAITING = 8
"""Scans on their way at a time; what is not acknowledged is kept, to be sent again."""
_OPTIONAL: dict[str, Any] = {"time": None, "intensity": None, "rgb": None, "labels": None, "sensor_origin": None,
                             "align": True}


def upload_of(arguments: Mapping[str, Any]) -> tuple[scan.Upload, str | None, int | None]:
    """A scan out of arguments of Map.upload, its trajectory and its sequence."""
    unknown = sorted(set(arguments) - {"points", "pose", "trajectory", "sequence", *_OPTIONAL})
    if unknown or "points" not in arguments:
        raise ValueError(f"a scan needs points and has no {', '.join(unknown) or 'others'}; see Map.upload")
    named = {name: arguments.get(name, default) for name, default in _OPTIONAL.items()}
    return (scan.Upload(arguments["points"], arguments.get("pose"), **named), arguments.get("trajectory"),
            arguments.get("sequence"))


def put(pipe: Pipe[scans_pb2.IngestScansRequest], upload: scan.Upload, map_name: str) -> None:
    """All messages of a scan."""
    for message in upload.messages(map_name):
        if message.HasField("start"):
            pipe.put(scans_pb2.IngestScansRequest(start=message.start))
        else:
            pipe.put(scans_pb2.IngestScansRequest(chunk=message.chunk))


async def answer_of(answers: AsyncGenerator[scans_pb2.IngestScansResponse, None]) \
        -> scans_pb2.ScanAck | errors.StrataError:
    """What became of the next scan."""
    async for answer in answers:
        if answer.HasField("ack"):
            return answer.ack
        code = next(code for code in grpc.StatusCode if code.value[0] == answer.error.code)
        return errors.from_detail(code, answer.error.message, answer.error.detail)
    raise errors.Unavailable("the server ended the stream before its last answer")

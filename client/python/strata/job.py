"""Jobs: durable background work on a map."""
import dataclasses
from collections.abc import Mapping

from strata.v1 import jobs_pb2

_STATES = {jobs_pb2.JOB_STATE_QUEUED: "queued", jobs_pb2.JOB_STATE_RUNNING: "running",
           jobs_pb2.JOB_STATE_SUCCEEDED: "succeeded", jobs_pb2.JOB_STATE_FAILED: "failed",
           jobs_pb2.JOB_STATE_CANCELLED: "cancelled", jobs_pb2.JOB_STATE_PROPOSED: "proposed"}


@dataclasses.dataclass(frozen=True)
class Job:
    """A job as it was when it was asked for."""

    id: int
    kind: str
    parameters: dict[str, str]
    state: str
    """queued, running, succeeded, failed, cancelled, or proposed (found by a dry run, or too little speaks for it)."""
    progress: float
    """Share of the work done."""
    phase: str
    """What it does now, for people."""
    message: str
    """Result in one line, or why it failed."""
    metrics: dict[str, float]
    """Numbers of the result by name."""

    @property
    def ended(self) -> bool:
        return self.state not in ("queued", "running")


def from_proto(message: jobs_pb2.Job) -> Job:
    return Job(message.id, message.kind, dict(message.parameters), _STATES.get(message.state, "unknown"),
               message.progress, message.phase, message.message, dict(message.metrics))


JobParameter = str | int | float | bool


def parameters(named: Mapping[str, JobParameter]) -> dict[str, str]:
    """Parameters as text: True and False are 1 and 0."""
    return {name: str(int(value) if isinstance(value, bool) else value) for name, value in named.items()}

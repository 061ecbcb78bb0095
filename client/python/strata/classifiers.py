"""What a map has learned to tell apart."""
import dataclasses

from strata.v1 import classifiers_pb2


@dataclasses.dataclass(frozen=True)
class Classifier:
    """A classifier, without its bytes. It never changes."""

    id: int
    """In the map, never used twice."""
    name: str
    time: float
    """When it was made, by the server's clock: seconds since 1970, UTC."""
    job: int
    """That trained it; 0: imported."""
    description: str
    parameters: dict[str, str]
    """Of its training."""
    scores: dict[str, float]
    """How good it was on scans that it had not seen: accuracy, mean_iou, iou.<class>, folds; may be empty."""
    bytes: int
    """Size as exported."""


def from_proto(message: classifiers_pb2.Classifier) -> Classifier:
    return Classifier(message.id, message.name, message.created.seconds + message.created.nanos * 1e-9, message.job,
                      message.description, dict(message.parameters), dict(message.scores), message.bytes)

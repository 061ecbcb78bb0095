"""The four shapes of gRPC methods, for type checkers: what the stubs of strata.v1 have as attributes."""
from typing import Generic, TypeVar

Q = TypeVar("Q")
"""Request."""
A = TypeVar("A")
"""Answer."""


class UnaryUnary(Generic[Q, A]):
    """One request, one answer."""


class StreamUnary(Generic[Q, A]):
    """Many requests, one answer."""


class UnaryStream(Generic[Q, A]):
    """One request, many answers."""


class StreamStream(Generic[Q, A]):
    """Many requests, many answers."""

"""Methods of stubs that can be called on another channel than the one that their stub was made with."""
from typing import Any


class Method:
    """A method of a stub."""

    def __init__(self, shape: str, arguments: tuple[Any, ...], named: dict[str, Any], channel: Any) -> None:
        self._shape, self._arguments, self._named = shape, arguments, named
        self._own = self._made(channel)

    def _made(self, channel: Any) -> Any:
        return getattr(channel, self._shape)(*self._arguments, **self._named)

    def on(self, channel: Any) -> Any:
        """gRPC's callable; None: on the stub's own channel."""
        return self._own if channel is None else self._made(channel)


class RoutedChannel:
    """A channel that stubs are made with, whose methods are Methods."""

    def __init__(self, channel: Any) -> None:
        self._channel = channel

    def unary_unary(self, *arguments: Any, **named: Any) -> Method:
        return Method("unary_unary", arguments, named, self._channel)

    def unary_stream(self, *arguments: Any, **named: Any) -> Method:
        return Method("unary_stream", arguments, named, self._channel)

    def stream_unary(self, *arguments: Any, **named: Any) -> Method:
        return Method("stream_unary", arguments, named, self._channel)

    def stream_stream(self, *arguments: Any, **named: Any) -> Method:
        return Method("stream_stream", arguments, named, self._channel)

"""Columns of numbers, the layer between tiles and zstd: core/codec/FORMAT.md. Input is treated as hostile."""
import numpy as np
import zstandard

from strata.arrays import Array
from strata.errors import DataLoss

_STORED, _REPEATED, _ZSTD = 0, 1, 2


class ByteReader:
    """Takes little-endian numbers from the front of some bytes; DataLoss beyond their end."""

    def __init__(self, data: bytes | memoryview) -> None:
        self._data = memoryview(data)

    def take(self, size: int) -> memoryview:
        if size > len(self._data):
            raise DataLoss("tile: cut short")
        taken, self._data = self._data[:size], self._data[size:]
        return taken

    def fixed(self, size: int, signed: bool = False) -> int:
        return int.from_bytes(self.take(size), "little", signed=signed)

    def varint(self) -> int:
        value = 0
        for shift in range(0, 64, 7):
            byte = self.fixed(1)
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value & 0xFFFFFFFFFFFFFFFF
        raise DataLoss("tile: a number of more than 64 bits")

    def column(self, max_size: int) -> Array:
        """Bytes of a column as an array of uint8; `max_size` bounds what a hostile one may make it allocate."""
        packing = self.fixed(1)
        size = self.varint()
        if size > max_size:
            raise DataLoss(f"column: announces {size} bytes, at most {max_size} can be")
        if packing == _STORED:
            return np.frombuffer(self.take(size), np.uint8)
        if packing == _REPEATED:
            return np.full(size, self.fixed(1), np.uint8)
        if packing == _ZSTD:
            return np.frombuffer(_decompressed(self.take(self.varint()), size), np.uint8)
        raise DataLoss(f"column: unknown packing {packing}")

    @property
    def remaining(self) -> int:
        return len(self._data)


def _decompressed(packed: memoryview, size: int) -> bytes:
    try:
        announced = zstandard.frame_content_size(packed)  # else it is what would be allocated
        if announced not in (-1, size):
            raise DataLoss(f"column: {announced} bytes in a zstd frame, expected {size}")
        result = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    except zstandard.ZstdError as error:
        raise DataLoss(f"column: {error}") from None
    if len(result) != size:
        raise DataLoss(f"column: {len(result)} bytes in a zstd frame, expected {size}")
    return result


def _bits_at(raw: Array, starts: Array, counts: Array) -> Array:
    """Numbers of `counts` ≤ 62 bits that begin at bit `starts`, lowest bit first."""
    padded = np.concatenate([raw, np.zeros(9, np.uint8)])
    first_byte, offset = starts >> 3, (starts & 7).astype(np.uint64)
    low = padded[first_byte[:, None] + np.arange(8)].view("<u8")[:, 0]
    high = padded[first_byte + 8].astype(np.uint64)
    # A shift by 64 is undefined, so the high byte goes up in two steps.
    bits = (low >> offset) | (high << (np.uint64(63) - offset) << np.uint64(1))
    masked: Array = bits & ((np.uint64(1) << counts.astype(np.uint64)) - np.uint64(1))
    return masked


def numbers_of(tokens: Array, raw: Array) -> Array:
    """Signed numbers of an array of one-byte tokens, in the order of coding, and the raw bits they share."""
    values = tokens.astype(np.uint64)
    large = np.flatnonzero(tokens >= 128)
    large_tokens = tokens[large].astype(np.int64)
    raw_counts = 7 + ((large_tokens - 128) >> 1) - 1
    if (raw_counts > 62).any():
        raise DataLoss("column: a number of more than 64 bits")
    ends = np.cumsum(raw_counts)
    used = int(ends[-1]) if len(ends) else 0
    if (used + 7) // 8 != len(raw):
        raise DataLoss(f"column: {len(raw)} bytes of raw bits, expected {(used + 7) // 8}")
    leading = (2 | large_tokens & 1).astype(np.uint64) << raw_counts.astype(np.uint64)
    values[large] = leading | _bits_at(raw, ends - raw_counts, raw_counts)
    result: Array = (values >> np.uint64(1)).view(np.int64) ^ -(values & np.uint64(1)).view(np.int64)
    return result

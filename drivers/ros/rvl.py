"""RVL, the lossless depth compression of image_transport (A. D. Wilson, "Fast Lossless Depth Image Compression", 2017).

A stream of numbers: how many zeros, how many measured pixels, then each one's difference from the measured one before,
and again. A number is written in nibbles of three bits, the lowest first, the fourth bit saying that more follow; eight
nibbles fill a 32-bit word from its top.
"""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array


class RvlError(ValueError):
    """The bytes are no RVL of that many pixels."""


def encode(values: Array) -> bytes:
    """(h, w) uint16 -> RVL, without a header."""
    flat = values.ravel().astype(np.int64)
    measured = np.concatenate(([False], flat > 0, [False]))
    edges = np.flatnonzero(np.diff(measured.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    steps = np.diff(flat[flat > 0], prepend=0)
    zigzag = (steps << 1) ^ (steps >> 63)
    numbers: list[int] = []
    at = done = 0
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        numbers += [start - at, end - start, *zigzag[done : done + end - start].tolist()]
        at, done = end, done + end - start
    if at < len(flat):
        numbers += [len(flat) - at, 0]
    return _packed([nibble for number in numbers for nibble in _nibbles(number)])


def decode(data: bytes, pixels: int) -> Array:
    """(pixels,) uint16. Raises RvlError."""
    numbers = _numbers(data)
    values = np.zeros(pixels, np.uint16)
    at = read = 0
    before = np.int64(0)
    while at < pixels:
        if read + 1 >= len(numbers):
            raise RvlError(f"the stream ends after {at} of {pixels} pixels")
        zeros, measured = int(numbers[read]), int(numbers[read + 1])
        read += 2
        at += zeros
        if at + measured > pixels or read + measured > len(numbers) or not (zeros or measured):
            raise RvlError(f"the stream does not fit {pixels} pixels")
        if measured:
            zigzag = numbers[read : read + measured]
            run = before + np.cumsum((zigzag >> 1) ^ -(zigzag & 1))
            values[at : at + measured] = run & 0xFFFF
            before = run[-1]
        at, read = at + measured, read + measured
    return values


def _numbers(data: bytes) -> Array:
    """(n,) int64: every number in the stream."""
    words = np.frombuffer(data[: len(data) // 4 * 4], "<u4")
    nibbles = ((words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32)) & 0xF).ravel()
    last = np.flatnonzero(nibbles < 8)
    if not len(last):
        return np.zeros(0, np.int64)
    nibbles = nibbles[: last[-1] + 1].astype(np.int64)
    first = np.concatenate(([0], last[:-1] + 1))
    place = np.arange(len(nibbles)) - np.repeat(first, last - first + 1)
    if place.max() > 10:  # 32 bits fill eleven nibbles
        raise RvlError("a number in the stream is too long")
    return np.add.reduceat((nibbles & 7) << (3 * place), first)


def _nibbles(number: int) -> list[int]:
    nibbles = []
    while number > 7:
        nibbles.append(number & 7 | 8)
        number >>= 3
    return [*nibbles, number]


def _packed(nibbles: list[int]) -> bytes:
    padded = np.array([*nibbles, *[0] * (-len(nibbles) % 8)], np.uint32).reshape(-1, 8)
    words = (padded << np.arange(28, -1, -4, dtype=np.uint32)).sum(axis=1, dtype=np.uint32)
    return words.astype("<u4").tobytes()

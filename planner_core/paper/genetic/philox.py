"""Random numbers by counter: Philox4x32-10, whole numbers alone, so that host and device draw the same ones.

Any number is a function of (seed, iteration, purpose, individual, draw): nothing is carried on from one to the next,
and no order of computing them changes any. kernels/genetic_random.h is the same in OpenCL C.

References
----------
Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3": constants, rounds and test vectors are
those of Philox4x32 with 10 rounds.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BoolArray

UInt32Array = NDArray[np.uint32]
UInt64Array = NDArray[np.uint64]

_MULTIPLY = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_WEYL = (0x9E3779B9, 0xBB67AE85)
_ROUNDS = 10
#: Numbers that `Draws.hits` draws at once: some dozens of bytes each, half a megabyte in all stays in cache.
_NUMBERS_AT_A_TIME = 2**14
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)


class Purpose(IntEnum):
    """What a number is drawn for: numbers for different purposes have nothing to do with each other."""

    RATE = 0
    GENE = 1
    TOURNAMENT = 2
    MATE = 3
    CUT = 4
    MIX = 5
    MUTATE = 6
    FLIP = 7
    MEND = 8


def philox(counter: tuple[UInt64Array | np.uint64, ...], seed: int) -> tuple[UInt64Array, ...]:
    """Four numbers below 2^32 for every counter of four words below 2^32; all uint64, of shapes that broadcast."""
    x0, x1, x2, x3 = (np.asarray(word, dtype=np.uint64) for word in counter)
    k0, k1 = seed & 0xFFFFFFFF, seed >> 32
    for _ in range(_ROUNDS):
        p0, p1 = x0 * _MULTIPLY[0], x2 * _MULTIPLY[1]
        x0, x1, x2, x3 = (p1 >> _HALF) ^ x1 ^ np.uint64(k0), p1 & _LOW, (p0 >> _HALF) ^ x3 ^ np.uint64(k1), p0 & _LOW
        k0, k1 = (k0 + _WEYL[0]) & 0xFFFFFFFF, (k1 + _WEYL[1]) & 0xFFFFFFFF
    return x0, x1, x2, x3


class Draws:
    """All random numbers of one run; `seed` 0 to 2^64 - 1."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def numbers(self, iteration: int, purpose: Purpose, individuals: NDArray[np.integer], n: int) -> UInt64Array:
        """(len(individuals), n) numbers below 2^32: draw d is word d % 4 of the counter's block d / 4."""
        blocks = np.arange(-(-n // 4), dtype=np.uint64)[None, :]
        rows = np.asarray(individuals, dtype=np.uint64)[:, None]
        counter = (np.uint64(iteration), np.uint64(int(purpose)), rows, blocks)
        words = np.stack(np.broadcast_arrays(*philox(counter, self._seed)), axis=-1)
        return words.reshape(rows.size, 4 * blocks.size)[:, :n]

    def hits(
        self, iteration: int, purpose: Purpose, individuals: NDArray[np.integer], n: int, limit: UInt64Array
    ) -> BoolArray:
        """(len(individuals), n): which of their first n numbers are below `limit`, one for each individual."""
        found = np.empty((len(individuals), n), dtype=bool)
        step = max(1, _NUMBERS_AT_A_TIME // n)
        for first in range(0, len(individuals), step):
            own = slice(first, first + step)
            found[own] = self.numbers(iteration, purpose, individuals[own], n) < limit[own, None]
        return found


def below(number: UInt64Array, n: int | UInt64Array) -> NDArray[np.int64]:
    """Map numbers below 2^32 to 0 .. n - 1, each within n / 2^32 of equally often."""
    return ((number * np.asarray(n, dtype=np.uint64)) >> _HALF).astype(np.int64)


def threshold(rate: float) -> int:
    """How many of the 2^32 numbers count as a hit of probability `rate`; 2^32 for 1."""
    return round(rate * 2**32)

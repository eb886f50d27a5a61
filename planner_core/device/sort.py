"""A stable radix sort on a device: keys of 64 bits, each with a value of 32 bits; kernels/sort.cl.

Also how work on a row of elements is divided into chunks, which all kernels that take prefix sums share.
"""

from __future__ import annotations

import numpy as np

from planner_core.device.runtime import Buffer, Device

#: Chunks at most, by kind of device: a CPU takes several a core, so that cores that finish early find more (two cores
#: take the same time for 64 and 256); others need thousands to be busy. Results do not depend on them.
_MAX_CHUNKS = {"cpu": 256}
_DEFAULT_MAX_CHUNKS = 8192
#: Elements a chunk at least: below it, summing the chunks' counts costs more than it saves.
_MIN_CHUNK = 256
#: Bits a pass, by kind of device: a chunk holds 2^bits counters in registers or cache. With 9 a Morton code takes six.
_DIGIT_BITS = {"cpu": 9}
_DEFAULT_DIGIT_BITS = 4


def chunk_count(device: Device, n: int) -> int:
    """Into how many chunks (kernels/chunks.h) work on `n` elements is divided on a device; at least 1."""
    most = _MAX_CHUNKS.get(device.kind, _DEFAULT_MAX_CHUNKS)
    return max(1, min(most, -(-n // _MIN_CHUNK)))


def sort_pairs(
    device: Device, keys: Buffer, values: Buffer, spare_keys: Buffer, spare_values: Buffer, *, n: int, n_bits: int
) -> tuple[Buffer, Buffer]:
    """Queue sorting `n` pairs by the last `n_bits` bits of their keys, in whole passes; equal ones keep their order.

    Parameters
    ----------
    keys, spare_keys
        (n,) uint64 each; the spare's content does not matter. Both are overwritten.
    values, spare_values
        (n,) int32 each, likewise.

    Returns
    -------
    keys, values
        The two of the given buffers that hold the result.
    """
    bits = _DIGIT_BITS.get(device.kind, _DEFAULT_DIGIT_BITS)
    program = device.program("sort.cl", {"DIGIT_BITS": bits})
    n_chunks = chunk_count(device, n)
    counts = device.allocate("digits of a sort", (4 << bits) * n_chunks)
    totals = device.allocate("digits of a sort", 4 << bits)
    source, target = (keys, values), (spare_keys, spare_values)
    for shift in range(0, n_bits, bits):
        at = (np.int32(n), np.int32(shift))
        program.run("count_digits", (n_chunks,), source[0], *at, counts)
        program.run("place_digits", (1 << bits,), counts, np.int32(n_chunks), totals)
        program.run("move_elements", (n_chunks,), *source, *at, counts, totals, *target)
        source, target = target, source
    return source

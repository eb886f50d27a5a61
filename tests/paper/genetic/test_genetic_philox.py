"""Random numbers by counter: against the published vectors, and against what random numbers must look like."""

import numpy as np
import pytest
from scipy import stats

from planner_core.device.sources import expand_includes
from planner_core.paper.genetic.philox import Draws, Purpose, below, philox, threshold

#: Counter, key, result: known answers of Philox4x32-10 (Salmon et al. 2011, Random123).
KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "expected"), KNOWN)
def test_host_numbers_are_the_published_ones(counter, key, expected):
    words = philox(tuple(np.uint64(word) for word in counter), key[0] | key[1] << 32)
    assert tuple(int(word) for word in words) == expected


@pytest.mark.parametrize(("counter", "key", "expected"), KNOWN)
def test_device_numbers_are_the_published_ones(device, counter, key, expected):
    source = expand_includes(
        """#include "genetic_random.h"
        kernel void once(global const uint *x, ulong seed, global uint *out)
        {
            const uint4 words = philox((uint4)(x[0], x[1], x[2], x[3]), seed);
            for (int k = 0; k < 4; ++k) out[k] = word_of(words, k);
        }""",
        "once",
    )
    program = device.program_from_source(source, title="once", defines={})
    out = np.zeros(4, dtype=np.uint32)
    at = device.upload("test", {"x": np.array(counter, dtype=np.uint32)})
    with device.outputs("test", {"out": out}) as buffers:
        program.run("once", (1,), at["x"], np.uint64(key[0] | key[1] << 32), buffers["out"])
    assert tuple(out.tolist()) == expected


def test_draws_do_not_depend_on_what_else_is_drawn():
    draws = Draws(7)
    many = draws.numbers(3, Purpose.GENE, np.arange(20), 50)
    alone = draws.numbers(3, Purpose.GENE, np.array([13]), 9)
    assert (many[13, :9] == alone[0]).all()


def test_draws_differ_by_seed_iteration_purpose_and_individual():
    def numbers(seed, iteration, purpose, individual):
        return Draws(seed).numbers(iteration, purpose, np.array([individual]), 4).tobytes()

    base = (1, 1, Purpose.MATE, 1)
    others = [(2, 1, Purpose.MATE, 1), (1 + 2**32, 1, Purpose.MATE, 1), (1, 2, Purpose.MATE, 1)]
    others += [(1, 1, Purpose.CUT, 1), (1, 1, Purpose.MATE, 2)]
    assert len({numbers(*each) for each in [base, *others]}) == 6


def test_draws_below_n_are_uniform():
    numbers = Draws(5).numbers(0, Purpose.MIX, np.arange(2000), 10).reshape(-1)
    counts = np.bincount(below(numbers, 7), minlength=7)
    assert counts.sum() == 20_000
    assert stats.chisquare(counts).pvalue > 1e-3


def test_draws_below_n_reach_both_ends_and_no_further():
    ends = np.array([0, 2**32 - 1], dtype=np.uint64)
    assert below(ends, 1000).tolist() == [0, 999]
    assert below(ends, 1).tolist() == [0, 0]


@pytest.mark.parametrize(("rate", "expected"), [(0.0, 0), (1.0, 2**32), (0.5, 2**31)])
def test_threshold_turns_a_rate_into_numbers_that_hit(rate, expected):
    assert threshold(rate) == expected

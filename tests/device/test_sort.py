"""The radix sort against NumPy's stable argsort."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device, open_device, sort
from planner_core.device.sort import chunk_count, sort_pairs


@pytest.fixture(scope="module")
def sorting_device(needs_opencl: None) -> Device:
    return open_device()


def sort_on(device: Device, keys: np.ndarray, n_bits: int) -> tuple[np.ndarray, np.ndarray]:
    n = keys.size
    put = device.upload("test", {"keys": keys, "values": np.arange(n, dtype=np.int32)[::-1]})
    spare = device.allocate("test", 8 * n), device.allocate("test", 4 * n)
    in_order = sort_pairs(device, put["keys"], put["values"], *spare, n=n, n_bits=n_bits)
    got = np.empty(n, dtype=np.uint64), np.empty(n, dtype=np.int32)
    for buffer, array in zip(in_order, got, strict=True):
        device.read(buffer, array)
    return got


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(1, 3000), n_bits=st.integers(1, 64), n_different=st.integers(1, 5000)
)
def test_pairs_are_sorted_by_the_last_bits_of_their_keys_and_equal_ones_keep_their_order(
    sorting_device: Device, seed: int, n: int, n_bits: int, n_different: int
) -> None:
    rng = np.random.default_rng(seed)
    keys = rng.integers(0, 2**64, n_different, dtype=np.uint64)[rng.integers(0, n_different, n)]
    a_pass = sort._DIGIT_BITS.get(sorting_device.kind, sort._DEFAULT_DIGIT_BITS)
    last = keys & np.uint64(2 ** min(64, a_pass * -(-n_bits // a_pass)) - 1)
    order = np.argsort(last, kind="stable")
    got_keys, got_values = sort_on(sorting_device, keys, n_bits)
    np.testing.assert_array_equal(got_keys, keys[order])
    np.testing.assert_array_equal(got_values, np.arange(n)[::-1][order])


def test_an_odd_and_an_even_number_of_passes_both_say_where_the_result_is(sorting_device: Device) -> None:
    keys = np.random.default_rng(1).integers(0, 2**16, 1000, dtype=np.uint64)
    for n_bits in (16, 27):
        np.testing.assert_array_equal(sort_on(sorting_device, keys, n_bits)[0], np.sort(keys))


def test_the_result_does_not_depend_on_chunks_or_digits(
    sorting_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = np.random.default_rng(2).integers(0, 50, 5000, dtype=np.uint64)
    first = sort_on(sorting_device, keys, 8)
    monkeypatch.setattr(sort, "_MIN_CHUNK", 3)
    monkeypatch.setattr(sort, "_DIGIT_BITS", {})
    for a, b in zip(first, sort_on(sorting_device, keys, 8), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(("kind", "most"), [("cpu", 256), ("gpu", 8192)])
def test_chunks_are_few_on_a_cpu_and_never_none(kind: str, most: int) -> None:
    device: Any = SimpleNamespace(kind=kind)
    assert chunk_count(device, 0) == 1
    assert chunk_count(device, 1) == 1
    assert 1 < chunk_count(device, 10**9) <= most

"""patch.h and patch_parts.h alone, in tiny kernels, against the host's patch_code: the same bits at every width."""

import numpy as np
import pytest
from slow_cases import all_slow_but

from planner_core.device import Device
from planner_core.device.sources import expand_includes
from planner_core.scene.patches import patch_code

PROBE = """
#include "patch_parts.h"
kernel void probe(global const float *weights, global const float *edges, int depth, int n, global int *code)
{
    Bisection of_packet[TOGETHER];
    for (int k = 0; k < TOGETHER; ++k) {
        const int at = (get_global_id(0) * TOGETHER + k) * LANES;
        global const float *w = weights + at, *e = edges + at;
        of_packet[k].l0 = LANES_LOAD(w), of_packet[k].l1 = LANES_LOAD(w + n), of_packet[k].l2 = LANES_LOAD(w + 2 * n);
        of_packet[k].q01 = LANES_LOAD(e), of_packet[k].q12 = LANES_LOAD(e + n);
        of_packet[k].q20 = LANES_LOAD(e + 2 * n);
        of_packet[k].code = 0;
    }
    patch_codes(of_packet, depth);
    for (int k = 0; k < TOGETHER; ++k) store_lanes(of_packet[k].code, code + (get_global_id(0) * TOGETHER + k) * LANES);
}
kernel void probe_parts(global const float *weights, global const float *edges, int depth, int n, global int *seen,
                        global int *n_seen)
{
    const int item = get_global_id(0), first = item * (WINDOW * LANES);
    lanes_f weight[3][WINDOW];
    lanes_i number[WINDOW], todo[WINDOW];
    for (int k = 0; k < WINDOW; ++k) {
        for (int i = 0; i < 3; ++i) weight[i][k] = LANES_LOAD(weights + i * n + first + k * LANES);
        todo[k] = k % 3 == 2 ? 4 : 7; /* every third packet is on another triangle */
    }
    const uint packets = take_triangle(todo, 0, 7, number);
    int codes[WINDOW * LANES];
    n_seen[item] = parts_hit(weight, number, packets, edges + 3 * item, depth, codes);
    for (int k = 0; k < n_seen[item]; ++k) seen[first + k] = codes[k];
}
"""
WINDOW = 8


def codes_of(device: Device, weights: np.ndarray, edges: np.ndarray, depth: int, lanes: int) -> np.ndarray:
    program = device.program_from_source(
        expand_includes(PROBE, "probe.cl"), title="probe.cl", defines={"LANES": lanes, "WINDOW": WINDOW}
    )
    count = len(weights)
    given = device.upload("probe", {"weights": weights.T.copy(), "edges": edges.T.copy()})
    code = np.empty(count, dtype=np.int32)
    n_items = count // (2 * lanes)
    with device.outputs("probe", {"code": code}) as out:
        program.run(
            "probe", (n_items,), given["weights"], given["edges"], np.int32(depth), np.int32(count), out["code"]
        )
    return code


def parts_of(device: Device, weights: np.ndarray, edges: np.ndarray, depth: int, lanes: int) -> list[np.ndarray]:
    """Codes that are seen of each of some triangles, edges (n, 3), that WINDOW * lanes of the hits lie on each."""
    program = device.program_from_source(
        expand_includes(PROBE, "probe.cl"), title="probe.cl", defines={"LANES": lanes, "WINDOW": WINDOW}
    )
    given = device.upload("probe", {"weights": weights.T.copy(), "edges": edges})
    seen = np.empty((len(edges), WINDOW * lanes), dtype=np.int32)
    n_seen = np.empty(len(edges), dtype=np.int32)
    with device.outputs("probe", {"seen": seen, "n_seen": n_seen}) as out:
        program.run(
            "probe_parts",
            (len(edges),),
            given["weights"],
            given["edges"],
            np.int32(depth),
            np.int32(len(weights)),
            out["seen"],
            out["n_seen"],
        )
    return [row[:n] for row, n in zip(seen, n_seen, strict=True)]


def cases(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random triangles and hits; a third with equal edges, some on dividing lines, some a little outside."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 3, 3))
    edges = np.stack([((corners[:, k] - corners[:, (k + 1) % 3]) ** 2).sum(axis=1) for k in range(3)], axis=1)
    edges[: count // 6] = 1.0
    edges[count // 6 : count // 3, 1] = edges[count // 6 : count // 3, 0]
    weights = rng.dirichlet([1, 1, 1], size=count)
    weights[::7] = np.round(weights[::7] * 8) / 8
    weights[::11] += rng.normal(size=(len(weights[::11]), 3)) * 1e-6
    return weights.astype(np.float32), edges.astype(np.float32)


@pytest.mark.parametrize("lanes", [1, 4, 8, 16])
@pytest.mark.parametrize("depth", all_slow_but([0, 7], [0, 1, 7, 20]))
def test_kernel_and_host_give_the_same_address(device: Device, lanes: int, depth: int) -> None:
    if lanes > device.max_lanes:
        pytest.skip(f"{device.label} has no vectors of {lanes}")
    weights, edges = cases(5_120, seed=depth)
    expected = patch_code(weights, edges, np.full(len(weights), depth))
    np.testing.assert_array_equal(codes_of(device, weights, edges, depth, lanes), expected)


@pytest.mark.parametrize("lanes", [1, 4, 8, 16])
@pytest.mark.parametrize("depth", all_slow_but([2, 20], [1, 2, 7, 20]))
def test_the_parts_that_a_tile_sees_are_those_of_its_hits_each_once(device: Device, lanes: int, depth: int) -> None:
    if lanes > device.max_lanes:
        pytest.skip(f"{device.label} has no vectors of {lanes}")
    weights, edges = cases(2_560, seed=depth)
    n_hits = WINDOW * lanes
    edges = np.ascontiguousarray(edges[::n_hits])
    seen = parts_of(device, weights, edges, depth, lanes)
    mine = np.arange(n_hits) // lanes % 3 != 2
    for item, codes in enumerate(seen):
        own = weights[item * n_hits : (item + 1) * n_hits][mine]
        expected = np.unique(patch_code(own, np.tile(edges[item], (len(own), 1)), np.full(len(own), depth)))
        np.testing.assert_array_equal(codes, expected)

"""patch.h alone, through a tiny kernel, against the host's patch_code: the same bits at every packet width."""

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.device.runtime import expand_includes
from planner_core.scene.patches import patch_code

PROBE = """
#include "patch.h"
kernel void probe(global const float *weights, global const float *edges, int depth, int n, global int *code)
{
    const int at = get_global_id(0) * LANES;
    global const float *w = weights + at, *e = edges + at;
    store_lanes(patch_code(LANES_LOAD(w), LANES_LOAD(w + n), LANES_LOAD(w + 2 * n), LANES_LOAD(e), LANES_LOAD(e + n),
                           LANES_LOAD(e + 2 * n), depth), code + at);
}
"""


def codes_of(device: Device, weights: np.ndarray, edges: np.ndarray, depth: int, lanes: int) -> np.ndarray:
    program = device.program_from_source(expand_includes(PROBE, "probe.cl"), title="probe.cl", defines={"LANES": lanes})
    count = len(weights)
    given = device.upload("probe", {"weights": weights.T.copy(), "edges": edges.T.copy()})
    code = np.empty(count, dtype=np.int32)
    with device.outputs("probe", {"code": code}) as out:
        program.run(
            "probe", (count // lanes,), given["weights"], given["edges"], np.int32(depth), np.int32(count), out["code"]
        )
    return code


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
@pytest.mark.parametrize("depth", [0, 1, 7, 20])
def test_kernel_and_host_give_the_same_address(device: Device, lanes: int, depth: int) -> None:
    if lanes > device.max_lanes:
        pytest.skip(f"{device.label} has no vectors of {lanes}")
    weights, edges = cases(20_000, seed=depth)
    expected = patch_code(weights, edges, np.full(len(weights), depth))
    np.testing.assert_array_equal(codes_of(device, weights, edges, depth, lanes), expected)

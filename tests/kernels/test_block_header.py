"""block.h alone, through a tiny kernel, against float64: bounds of rounding, and edges walked both ways."""

import numpy as np
import pytest

from planner_core.device import Device
from planner_core.device.sources import expand_includes

PROBE = """
#include "block.h"
/* out (blocks, 16, 8): n0 n1 n2 m (3 x 4), rounding 0 1 2, clear */
kernel void probe(global const float *geometry, float ox, float oy, float oz, global float *out)
{
    const int b = get_global_id(0);
    const Block block = prepare_block(geometry, b, ox, oy, oz);
    const float *from = (const float *)&block;
    for (int k = 0; k < 15 * 8; ++k) out[b * 128 + k] = from[k];
    const int *clear = (const int *)&block.clear;
    for (int j = 0; j < 8; ++j) out[b * 128 + 120 + j] = clear[j] ? 1.0f : 0.0f;
}
"""


def prepare(device: Device, corners: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(T, 16) of the probe for triangles (T, 3, 3) float32, T a multiple of 8."""
    wide = corners.astype(np.float64)
    cross = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    normal = (cross / np.linalg.norm(cross, axis=1, keepdims=True)).astype(np.float32)
    packed = np.concatenate([corners.reshape(-1, 9), normal], axis=1).reshape(-1, 8, 12).transpose(0, 2, 1)
    given = device.upload("probe", {"geometry": np.ascontiguousarray(packed)})
    out = np.empty((len(corners) // 8, 16, 8), dtype=np.float32)
    program = device.program_from_source(expand_includes(PROBE, "probe.cl"), title="probe.cl", defines={"LANES": 8})
    with device.outputs("probe", {"out": out}) as buffers:
        program.run("probe", (len(out),), given["geometry"], *(np.float32(x) for x in origin), buffers["out"])
    return out.transpose(0, 2, 1).reshape(-1, 16).astype(np.float64)


def triangles(count: int, seed: int, size: float, centre: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    middle = rng.normal(size=(count, 1, 3)) * 5 + centre
    return (middle + rng.normal(size=(count, 3, 3)) * size).astype(np.float32)


@pytest.mark.parametrize("size", [1e-3, 0.05, 3.0])
@pytest.mark.parametrize("centre", [0.0, 400.0])
def test_edge_functions_lie_within_their_bound_of_the_truth(device: Device, size: float, centre: float) -> None:
    corners = triangles(8000, 1, size, centre)
    origin = np.float32([centre + 0.3, centre - 0.2, centre + 0.1])
    got = prepare(device, corners, origin)
    rng = np.random.default_rng(2)
    beams = rng.normal(size=(len(corners), 3))
    beams = (beams / np.linalg.norm(beams, axis=1, keepdims=True)).astype(np.float32)
    # Aim half of them at the triangles, where the signs matter.
    aim = corners[::2].astype(np.float64).mean(axis=1) - origin
    beams[::2] = (aim / np.linalg.norm(aim, axis=1, keepdims=True)).astype(np.float32)
    a, b, c = (corners[:, k].astype(np.float64) - origin.astype(np.float64) for k in range(3))
    side = np.sign((np.cross(b - a, c - a) * a).sum(axis=1))[:, None]
    clear = got[:, 15] == 1
    assert clear.mean() > 0.9
    for k, (p, q) in enumerate(((b, c), (c, a), (a, b))):
        truth = (side * 2 * np.cross(p, q) * beams).sum(axis=1)
        computed = (got[:, 3 * k : 3 * k + 3] * beams).sum(axis=1)
        error, bound = np.abs(computed - truth), got[:, 12 + k]
        assert (error[clear] <= bound[clear]).all(), f"edge {k}: {np.max(error[clear] / bound[clear])} of the bound"
        # The bound is no excuse either: it is worth some 2e-6 rad and not more.
        length = np.linalg.norm(q - p, axis=1)
        reach = np.max([np.linalg.norm(x, axis=1) for x in (a, b, c)], axis=0)
        assert (bound <= 2.0e-6 * length * reach).all()


def test_inverse_ranges_are_those_of_the_plane(device: Device) -> None:
    corners = triangles(8000, 3, 0.5, 0.0)
    origin = np.float32([0.3, -0.2, 0.1])
    got = prepare(device, corners, origin)
    wide = corners.astype(np.float64)
    normal = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    constraint = wide.mean(axis=1) - origin.astype(np.float64)
    distance = np.linalg.norm(constraint, axis=1)
    beam = constraint / distance[:, None]
    cosine = np.abs((normal * beam).sum(axis=1)) / np.linalg.norm(normal, axis=1)
    inverse = (got[:, 9:12] * beam).sum(axis=1)
    sound = (got[:, 15] == 1) & (cosine > 0.01)
    assert sound.mean() > 0.9
    error = np.abs(1 / inverse - distance)[sound] / distance[sound] * cosine[sound]
    assert error.max() < 8 * 2.0**-24


def test_an_edge_walked_the_other_way_is_exactly_negated(device: Device) -> None:
    corners = triangles(8000, 4, 0.7, 50.0)
    origin = np.float32([50.3, 49.8, 50.1])
    swapped = corners[:, [1, 0, 2]].copy()
    one, other = prepare(device, corners, origin), prepare(device, swapped, origin)
    # Both are turned to face the origin, so that edge AB of one is edge BA of the other: the same vector, bit for bit.
    both = (one[:, 15] == 1) & (other[:, 15] == 1)
    np.testing.assert_array_equal(one[both, 6:9], other[both, 6:9])
    np.testing.assert_array_equal(one[both, 0:3], other[both, 3:6])


def test_needles_and_edge_on_triangles_are_not_clear(device: Device) -> None:
    needle = [[1, 0, 0], [1, 1, 0], [1, 0.5, 1e-7]]
    edge_on = [[1, 0, 0], [2, 0, 0], [1.5, 0, 1]]
    good = [[1, -1, -1], [1, 1, -1], [1, 0, 1]]
    none = [[1, 1, 1], [1, 1, 1], [1, 1, 1]]
    corners = np.array([needle, edge_on, good, good, good, good, good, needle], dtype=np.float32)
    got = prepare(device, corners, np.zeros(3, dtype=np.float32))
    assert got[:, 15].tolist() == [0, 0, 1, 1, 1, 1, 1, 0]
    with np.errstate(invalid="ignore"):
        flat = prepare(device, np.array([none] * 8, dtype=np.float32), np.zeros(3, dtype=np.float32))
    assert (flat[:, 15] == 0).all()

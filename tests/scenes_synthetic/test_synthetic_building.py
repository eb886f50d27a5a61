"""Doors, windows, walls: they fill their openings and swing to the side that was asked for."""

import numpy as np
import pytest
import trimesh

from scenes_synthetic.building import Opening, door, railing, wall, window
from scenes_synthetic.model import Hole, Part

SIDES = {"+x": (0, 1), "-x": (0, -1), "+y": (1, 1), "-y": (1, -1)}


def hole_in_wall(axis: int) -> Hole:
    """A doorway of 1 x 2.1 m in a wall 0.2 m thick whose normal is `axis`."""
    size = (0.2, 1.0) if axis == 0 else (1.0, 0.2)
    return Hole("opening", (3.0, 4.0, 0.5), (3.0 + size[0], 4.0 + size[1], 2.6))


def bodies(part: Part) -> list[trimesh.Trimesh]:
    """Lining and leaf, the lining first: it is the higher one."""
    split = trimesh.Trimesh(part.solid.vertices_m, part.solid.triangles, process=False).split()
    return sorted(split, key=lambda body: -body.bounds[1][2])


@pytest.mark.parametrize("hinge", ["left", "right"])
@pytest.mark.parametrize("towards", SIDES)
def test_open_door_stands_on_its_side_at_its_hinge(towards: str, hinge: str) -> None:
    axis, sign = SIDES[towards]
    hole = hole_in_wall(axis)
    lining, leaf = bodies(door("D", 0, hole, towards=towards, hinge=hinge, open_deg=90.0))
    np.testing.assert_allclose(lining.bounds, [hole.low_m, hole.high_m], atol=1e-6)
    face = (hole.high_m if sign > 0 else hole.low_m)[axis]
    beyond = sign * (leaf.bounds[:, axis] - face)
    assert beyond.min() == pytest.approx(0.0, abs=1e-6)
    assert beyond.max() > 0.8
    # Left and right as seen by somebody who stands on that side and looks at the door.
    look = np.zeros(3)
    look[axis] = -sign
    right = np.cross(look, [0.0, 0.0, 1.0])
    middle = (np.asarray(hole.low_m) + hole.high_m) / 2
    offset = float((leaf.bounds.mean(axis=0) - middle) @ right)
    assert (offset > 0.35) == (hinge == "right")
    assert abs(offset) < 0.5


@pytest.mark.parametrize("towards", SIDES)
def test_shut_door_stays_in_its_opening(towards: str) -> None:
    hole = hole_in_wall(SIDES[towards][0])
    for body in bodies(door("D", 0, hole, towards=towards, hinge="left", open_deg=0.0)):
        assert (body.bounds[0] >= np.asarray(hole.low_m) - 1e-6).all()
        assert (body.bounds[1] <= np.asarray(hole.high_m) + 1e-6).all()


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("width_m", [0.8, 2.0])
def test_window_fills_the_middle_of_its_opening(axis: int, width_m: float) -> None:
    high = (3.3, 4.0 + width_m, 2.0) if axis == 0 else (3.0 + width_m, 4.3, 2.0)
    hole = Hole("opening", (3.0, 4.0, 0.9), high)
    low, top = window("W", 0, hole).solid.bounds_m
    across, along = axis, 1 - axis
    assert (low[along], top[along]) == pytest.approx((hole.low_m[along], hole.high_m[along]))
    assert (low[across] + top[across]) / 2 == pytest.approx((hole.low_m[across] + hole.high_m[across]) / 2)
    assert top[across] - low[across] == pytest.approx(0.08)


def test_opening_of_a_wall_goes_through_it_at_its_sill() -> None:
    part = wall("W", 0, (1.0, 2.0, 3.0), (1.2, 8.0, 5.5), [Opening("o", 4.0, 1.5, 1.2, sill_m=0.9)])
    assert part.pierced_box is not None
    (hole,) = part.pierced_box.holes
    assert (hole.low_m, hole.high_m) == ((1.0, 4.0, 3.9), (1.2, 5.5, 5.1))
    assert part.solid.volume_m3 == pytest.approx(0.2 * (6.0 * 2.5 - 1.5 * 1.2))


def test_railing_reaches_its_height_on_balusters_close_together() -> None:
    solid = railing("R", 0, (0.0, 0.0, 2.8), (0.0, 3.0, 2.8)).solid
    assert solid.bounds_m[:, 2].tolist() == pytest.approx([2.8, 3.8])
    split = trimesh.Trimesh(solid.vertices_m, solid.triangles, process=False).split()
    posts = sorted(body.bounds.mean(axis=0)[1] for body in split if body.bounds[0][2] < 3.0)
    assert max(np.diff(posts)) < 0.3

"""Solids: closed, right way out, of the area and volume that their dimensions say."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes_synthetic.solids import Solid, box, join, pierced_box, place, prism, rectilinear

lengths = st.floats(0.01, 20.0)


def closed(solid: Solid) -> bool:
    mesh = trimesh.Trimesh(solid.vertices_m, solid.triangles, process=False)
    return bool(mesh.is_watertight and mesh.is_winding_consistent)


@given(size=st.tuples(lengths, lengths, lengths))
def test_box_has_the_area_and_volume_of_its_sides(size: tuple[float, float, float]) -> None:
    a, b, c = np.round(size, 6)
    solid = box((0.0, 0.0, 0.0), (a, b, c))
    assert closed(solid)
    assert solid.area_m2 == pytest.approx(2 * (a * b + b * c + c * a))
    assert solid.volume_m3 == pytest.approx(a * b * c)


def test_wall_with_a_door_and_a_window_has_their_reveals() -> None:
    # 5 x 0.3 x 2.5 m; a window of 1.2 x 1 m at 0.9 m, a door of 1 x 2 m that reaches the foot.
    window = ((0.5, 0.0, 0.9), (1.7, 0.3, 1.9))
    door = ((3.0, 0.0, 0.0), (4.0, 0.3, 2.0))
    solid = pierced_box((0.0, 0.0, 0.0), (5.0, 0.3, 2.5), [window, door])
    faces = 2 * (5 * 2.5 - 1.2 * 1.0 - 1.0 * 2.0)
    rim = 0.3 * (5 + 2 * 2.5) + 0.3 * (5 - 1.0)  # top and ends; the foot lacks the doorway
    reveals = 0.3 * 2 * (1.2 + 1.0) + 0.3 * (2.0 + 2.0 + 1.0)
    assert closed(solid)
    assert solid.area_m2 == pytest.approx(faces + rim + reveals)
    assert solid.volume_m3 == pytest.approx(0.3 * faces / 2)


def test_hole_that_leaves_its_box_is_refused() -> None:
    with pytest.raises(ValueError, match="outside the box"):
        pierced_box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), [((0.5, 0.0, 0.5), (1.5, 1.0, 0.8))])


def test_cells_that_touch_along_an_edge_are_refused() -> None:
    filled = np.zeros((2, 2, 1), dtype=bool)
    filled[0, 0, 0] = filled[1, 1, 0] = True
    with pytest.raises(ValueError, match="touch along an edge"):
        rectilinear([0, 1, 2], [0, 1, 2], [0, 1], filled=filled)


@settings(max_examples=60, deadline=None)
@given(bits=st.integers(1, 2**12 - 1), seed=st.integers(0, 1000))
def test_rectilinear_solid_has_the_volume_of_its_cells(bits: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    filled = np.array([bool(bits >> i & 1) for i in range(12)]).reshape(3, 2, 2)
    x, y, z = (np.cumsum(np.round(rng.uniform(0.1, 2.0, n + 1), 3)) for n in filled.shape)
    cells = np.einsum("i,j,k->ijk", np.diff(x), np.diff(y), np.diff(z))
    try:
        solid = rectilinear(x, y, z, filled=filled)
    except ValueError:
        return
    assert solid.volume_m3 == pytest.approx(cells[filled].sum()), f"bits {bits} seed {seed}"
    edges = np.sort(solid.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1].tolist()) == {2}


def test_prism_of_a_staircase_has_the_volume_of_its_outline() -> None:
    outline = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 2.0), (1.0, 2.0), (1.0, 1.0), (0.0, 1.0)]
    solid = prism(outline, axis="x", low_m=1.0, high_m=3.0)
    assert closed(solid)
    assert solid.volume_m3 == pytest.approx(6.0 * 2.0)
    assert solid.area_m2 == pytest.approx(2 * 6.0 + 2.0 * (3 + 3 + 6))
    assert solid.bounds_m.tolist() == [[1.0, 0.0, 0.0], [3.0, 3.0, 3.0]]


def test_prism_of_a_clockwise_outline_is_refused() -> None:
    with pytest.raises(ValueError, match="counter-clockwise"):
        prism([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)], axis="z", low_m=0.0, high_m=1.0)


@given(turn=st.floats(-720, 720))
def test_placing_keeps_volume_and_moves_the_origin(turn: float) -> None:
    solid = place(box((0.0, 0.0, 0.0), (2.0, 1.0, 3.0)), (5.0, -4.0, 1.0), turn_deg=turn)
    assert solid.volume_m3 == pytest.approx(6.0, rel=1e-5)
    assert (np.abs(solid.vertices_m - [5.0, -4.0, 1.0]).sum(axis=1) < 1e-6).any()


@pytest.mark.parametrize(
    ("turn", "low", "high"),
    [
        (0, (0, 0), (2, 1)),
        (90, (-1, 0), (0, 2)),
        (180, (-2, -1), (0, 0)),
        (270, (0, -2), (1, 0)),
        (-90, (0, -2), (1, 0)),
    ],
)
def test_quarter_turns_are_exact(turn: float, low: tuple[int, int], high: tuple[int, int]) -> None:
    bounds = place(box((0.0, 0.0, 0.0), (2.0, 1.0, 3.0)), (0.0, 0.0, 0.0), turn_deg=turn).bounds_m
    assert bounds[:, :2].tolist() == [list(map(float, low)), list(map(float, high))]


def test_join_keeps_each_solid_closed() -> None:
    both = join([box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), box((2.0, 0.0, 0.0), (3.0, 1.0, 2.0))])
    assert closed(both)
    assert both.volume_m3 == pytest.approx(3.0)

"""Polygons become triangles that cover them exactly, notches included."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.errors import SceneError
from planner_core.scene.raw import triangulate

L_SHAPE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=np.float64)


def in_space(flat, normal_axis=2):
    """A ring of the plane, stood up so that its normal is the given axis."""
    return np.roll(np.column_stack([flat, np.full(len(flat), 0.5)]), normal_axis - 2, axis=1)


def areas(points, triangles):
    """(T, 3) vector areas."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a) / 2


def split(points, rings, **options):
    counts = np.array([len(r) for r in rings], dtype=np.int64)
    corners = np.concatenate([np.asarray(r, dtype=np.int64) for r in rings])
    return triangulate(points, counts, corners, name="a.obj", **({"skip_bad_faces": False} | options))


@pytest.mark.parametrize("normal_axis", [0, 1, 2])
@pytest.mark.parametrize("start", range(6))
@pytest.mark.parametrize("turn", [1, -1])
def test_l_shape_is_covered_without_overlap_from_any_first_corner(normal_axis, start, turn):
    points = in_space(L_SHAPE, normal_axis)
    ring = np.roll(np.arange(6)[::turn], start)
    faces = split(points, [ring])
    pieces = areas(points, faces.triangles)
    assert len(pieces) == 4
    assert pieces.sum(axis=0)[normal_axis] == pytest.approx(3.0 * turn)
    assert np.linalg.norm(pieces, axis=1).sum() == pytest.approx(3.0)


def star(radii):
    """A star-shaped ring around the origin: simple whatever the radii."""
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * np.asarray(radii)[:, None]


@pytest.mark.slow
@given(st.lists(st.floats(0.2, 5.0), min_size=4, max_size=14), st.integers(0, 2), st.booleans())
@settings(max_examples=200, deadline=None)
def test_star_shaped_polygon_is_covered_without_overlap(radii, normal_axis, reverse):
    points = in_space(star(radii), normal_axis)
    ring = np.arange(len(radii))[:: -1 if reverse else 1]
    pieces = areas(points, split(points, [ring]).triangles)
    x, y = star(radii).T
    shoelace = abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2
    assert len(pieces) == len(radii) - 2
    assert np.linalg.norm(pieces, axis=1).sum() == pytest.approx(shoelace, rel=1e-6)


def test_convex_polygon_becomes_a_fan_around_its_first_corner():
    faces = split(in_space(star([1.0] * 5)), [[2, 3, 4, 0, 1]])
    assert faces.triangles.tolist() == [[2, 3, 4], [2, 4, 0], [2, 0, 1]]


def test_faces_of_mixed_size_keep_their_order():
    points = in_space(L_SHAPE)
    faces = split(points, [[0, 1, 2, 3], [0, 1, 2], range(6), [3, 4, 5]])
    assert faces.polygon.tolist() == [0, 0, 1, 2, 2, 2, 2, 3]
    assert faces.triangles[2].tolist() == [0, 1, 2]
    assert faces.triangles[-1].tolist() == [3, 4, 5]


def test_faces_of_fewer_than_three_corners_are_counted_as_degenerate():
    faces = split(in_space(L_SHAPE), [[0, 1], [0, 1, 2], [5]])
    assert faces.triangles.tolist() == [[0, 1, 2]]
    assert faces.report().n_degenerate == 2
    assert faces.report().n_faces_read == 2
    assert faces.dropped == ("face 0: has fewer than three corners", "face 2: has fewer than three corners")


def test_polygon_that_names_a_missing_vertex_is_refused_or_counted_as_its_triangles():
    points = in_space(L_SHAPE)
    with pytest.raises(SceneError, match="1 of 2 faces names vertex 6, the file has 6"):
        split(points, [[0, 1, 2], [0, 1, 2, 3, 6]])
    faces = split(points, [[0, 1, 2], [0, 1, 2, 3, 6]], skip_bad_faces=True)
    assert faces.n_bad_index == 3
    assert faces.triangles.tolist() == [[0, 1, 2]]


def test_polygon_with_a_coordinate_that_is_not_finite_still_has_all_its_triangles():
    points = in_space(L_SHAPE)
    points[3] = np.nan
    assert len(split(points, [range(6)]).triangles) == 4


def test_polygon_without_area_still_has_all_its_triangles():
    points = np.column_stack([np.arange(6.0), np.zeros(6), np.zeros(6)])
    assert len(split(points, [range(6)]).triangles) == 4


def test_polygon_that_crosses_itself_still_has_all_its_triangles():
    bow = in_space(np.array([[0, 0], [2, 2], [2, 0], [0, 2], [-1, 1.5]], dtype=np.float64))
    assert len(split(bow, [range(5)]).triangles) == 3

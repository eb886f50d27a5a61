"""Weld, repair, frames: what `scene_from_arrays` keeps, drops, counts and moves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner_core.errors import SceneError
from planner_core.model import Element, Storey
from planner_core.scene.build import FAR_ORIGIN_M, scene_from_arrays
from planner_core.scene.repair import MAX_DROPPED_LINES, face_height_m

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
SQUARE_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def corners_of(scene) -> np.ndarray:
    """(T, 3, 3) corners in the scene frame."""
    return scene.vertices_m[scene.triangles] + scene.offset_m


def test_soup_of_triangles_is_welded_and_keeps_its_order():
    soup = SQUARE[SQUARE_FACES].reshape(-1, 3)
    scene = scene_from_arrays(soup, np.arange(6).reshape(2, 3))
    assert scene.vertices_m.tolist() == SQUARE.tolist()
    assert scene.triangles.tolist() == SQUARE_FACES.tolist()


def test_minus_zero_and_zero_are_one_place():
    soup = SQUARE[SQUARE_FACES].reshape(-1, 3).copy()
    soup[3] = [-0.0, -0.0, -0.0]
    scene = scene_from_arrays(soup, np.arange(6).reshape(2, 3))
    assert len(scene.vertices_m) == 4
    assert not np.signbit(scene.vertices_m).any()


def test_vertices_that_differ_in_their_last_bit_stay_apart():
    soup = SQUARE[SQUARE_FACES].reshape(-1, 3).copy()
    soup[4] = np.nextafter(soup[4], 2)
    assert len(scene_from_arrays(soup, np.arange(6).reshape(2, 3)).vertices_m) == 5


def test_vertices_without_a_face_are_left_out():
    scene = scene_from_arrays(np.vstack([SQUARE, [[50.0, 50, 50]]]), SQUARE_FACES)
    assert len(scene.vertices_m) == 4


def test_each_fault_is_counted_and_listed():
    vertices = np.vstack([SQUARE, [[0.5, 0, 0], [np.nan, 0, 0], [0, np.inf, 0]]])
    faces = np.array(
        [
            [0, 1, 2],
            [0, 1, 4],  # a line
            [0, 0, 2],  # a corner twice
            [0, 1, 5],  # NaN
            [1, 2, 6],  # infinite
            [2, 0, 1],  # the first one, turned
            [1, 0, 2],  # the first one, from the other side
            [0, 2, 3],
            [0, 1, 77],  # missing vertex
        ]
    )
    scene = scene_from_arrays(vertices, faces, skip_bad_faces=True)
    report = scene.report
    assert scene.triangles.tolist() == SQUARE_FACES.tolist()
    assert report.n_faces_read == 9
    assert (report.n_degenerate, report.n_non_finite, report.n_duplicate, report.n_bad_index) == (2, 2, 2, 1)
    assert sorted(report.dropped) == [
        "mesh, face 1: is a line: its corners lie on it",
        "mesh, face 2: has two corners in one place",
        "mesh, face 3: has a coordinate that is not finite",
        "mesh, face 4: has a coordinate that is not finite",
        "mesh, face 5: is the same as face 0",
        "mesh, face 6: is the same as face 0",
        "mesh, face 8: names a vertex that does not exist",
    ]


@pytest.mark.parametrize("unit", [1.0, 1000.0])
@pytest.mark.parametrize("value", [2e9, -1e300, 1.7e308])
def test_coordinates_beyond_the_earth_are_dropped_as_not_finite(value, unit):
    vertices = np.vstack([SQUARE, [[value, 0, 0]]])
    with np.errstate(all="raise"):
        scene = scene_from_arrays(vertices, [[0, 1, 2], [0, 1, 4]], metres_per_unit=unit)
    assert (scene.n_triangles, scene.report.n_non_finite) == (1, 1)


def test_repeated_face_of_another_element_names_that_element():
    elements = [Element("Wall", "IfcWall", "w"), Element("Slab", "IfcSlab", "s")]
    faces = np.vstack([SQUARE_FACES, SQUARE_FACES[:1]])
    scene = scene_from_arrays(SQUARE, faces, element_of_triangle=[0, 0, 1], elements=elements)
    assert scene.report.dropped == ("Slab, face 2: is the same as face 0 of Wall",)
    assert scene.elements == tuple(elements)


@pytest.mark.parametrize("name", ["Wall {A1-B2}", "{face}", "{", "50 % %s {0}"])
def test_names_of_elements_are_told_as_they_are(name):
    faces = np.vstack([SQUARE_FACES, SQUARE_FACES[:1]])
    elements = [Element(name, "Mesh", "0"), Element("Slab", "Mesh", "1")]
    own = scene_from_arrays(SQUARE, faces, elements=elements)
    assert own.report.dropped == (f"{name}, face 2: is the same as face 0",)
    other = scene_from_arrays(SQUARE, faces, element_of_triangle=[0, 0, 1], elements=elements)
    assert other.report.dropped == (f"Slab, face 2: is the same as face 0 of {name}",)


def test_names_that_no_encoding_can_write_are_mended():
    elements = [Element("Wall \ud800", "Mesh", "\udfff")]
    storeys = [Storey("Floor \udc00", "\ud800", 0.0)]
    scene = scene_from_arrays(SQUARE, SQUARE_FACES, elements=elements, storeys=storeys)
    assert scene.elements == (Element("Wall \ufffd", "Mesh", "\ufffd"),)
    assert scene.storeys == (Storey("Floor \ufffd", "\ufffd", 0.0),)


def test_report_says_names_with_line_breaks_on_one_line():
    faces = np.vstack([SQUARE_FACES, SQUARE_FACES[:1]])
    scene = scene_from_arrays(SQUARE, faces, elements=[Element("Wall\r\nB", "Mesh", "0")])
    assert scene.report.dropped == ("Wall B, face 2: is the same as face 0",)
    assert scene.elements[0].name == "Wall\r\nB"


def test_long_lists_of_dropped_faces_are_cut_and_say_how_many_are_missing():
    faces = np.vstack([SQUARE_FACES, np.tile(SQUARE_FACES[:1], (1230, 1))])
    report = scene_from_arrays(SQUARE, faces).report
    assert report.n_duplicate == 1230
    assert len(report.dropped) == MAX_DROPPED_LINES
    assert report.dropped[-1] == "... and 1 131 more"  # 99 lines before it


def test_missing_vertex_is_an_error_unless_skipped():
    with pytest.raises(SceneError, match="1 of 2 faces names vertex 9, the scene has 4"):
        scene_from_arrays(SQUARE, [[0, 1, 2], [0, 1, 9]])
    with pytest.raises(SceneError, match="names vertex -1"):
        scene_from_arrays(SQUARE, [[0, 1, 2], [0, 1, -1]])


def test_scene_without_a_usable_face_is_an_error():
    with pytest.raises(SceneError, match="it has no faces"):
        scene_from_arrays(SQUARE, np.zeros((0, 3), dtype=int))
    with pytest.raises(SceneError, match="none of its 1 faces can be used"):
        scene_from_arrays(SQUARE, [[0, 1, 1]])
    with pytest.raises(SceneError, match="none of its 1 faces can be used"):
        scene_from_arrays(np.zeros((0, 3)), [[0, 1, 2]], skip_bad_faces=True)


@pytest.mark.parametrize(
    ("vertices", "triangles", "more", "message"),
    [
        (SQUARE[:, :2], SQUARE_FACES, {}, "vertices have the shape"),
        (SQUARE, SQUARE_FACES.astype(float), {}, "expected .T, 3. integers"),
        (SQUARE, [[0, 1, 2, 3]], {}, "triangles have the shape"),
        (SQUARE, SQUARE_FACES, {"element_of_triangle": [0]}, "element_of_triangle has the shape"),
        (SQUARE, SQUARE_FACES, {"element_of_triangle": [0, 1]}, "element_of_triangle goes from 0 to 1"),
        (SQUARE, SQUARE_FACES, {"metres_per_unit": -1.0}, "metres per unit"),
        (SQUARE, SQUARE_FACES, {"up_axis": "X"}, "upward axis"),
        (SQUARE, SQUARE_FACES, {"elements": [Element("a", "b", "c", storey=0)]}, "on storey 0"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(vertices, triangles, more, message):
    with pytest.raises(SceneError, match=message):
        scene_from_arrays(vertices, triangles, **more)


# ------------------------------------------------------------------------------------------------ frames
def test_unit_and_y_up_are_converted_and_keep_the_winding():
    scene = scene_from_arrays(SQUARE * 1000 + [0, 0, 500], SQUARE_FACES, metres_per_unit=0.001, up_axis="Y")
    a, b, c = corners_of(scene)[0]
    assert a.tolist() == [0.0, -0.5, 0.0]
    assert c.tolist() == [1.0, -0.5, 1.0]
    assert np.cross(b - a, c - a).tolist() == [0.0, -1.0, 0.0]  # source +z is scene -y


@pytest.mark.parametrize(
    ("centre", "offset"),
    [
        ((FAR_ORIGIN_M, 0, 0), (0, 0, 0)),
        ((FAR_ORIGIN_M + 1, 0, 0), (FAR_ORIGIN_M + 1, 0, 0)),
        ((500_000.3, -5_400_000.7, 431.0), (500_000, -5_400_001, 0)),
        ((0, 0, -2000.0), (0, 0, -2000)),
    ],
)
def test_far_scene_is_moved_by_whole_metres_on_its_far_axes_only(centre, offset):
    scene = scene_from_arrays(SQUARE - SQUARE.mean(axis=0) + centre, SQUARE_FACES)
    assert scene.offset_m.tolist() == list(offset)
    np.testing.assert_allclose(corners_of(scene)[0, 0], [centre[0] - 0.5, centre[1] - 0.5, centre[2]], atol=1e-9)
    assert len(scene.report.warnings) == int(any(offset))


def test_far_vertex_that_no_face_uses_moves_nothing():
    scene = scene_from_arrays(np.vstack([SQUARE, [[1e7, 0, 0]]]), SQUARE_FACES)
    assert not scene.offset_m.any()


def test_storeys_are_sorted_made_local_and_still_found_by_their_elements():
    storeys = [Storey("Top", "t", 5003.0), Storey("Low", "l", 5000.0)]
    elements = [Element("a", "x", "1", storey=0), Element("b", "x", "2", storey=1), Element("c", "x", "3")]
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 3]])
    scene = scene_from_arrays(
        SQUARE + np.array([0, 0, 5000]), faces, element_of_triangle=[0, 1, 2], elements=elements, storeys=storeys
    )
    assert [(s.name, s.elevation_m) for s in scene.storeys] == [("Low", 0.0), ("Top", 3.0)]
    assert [e.storey for e in scene.elements] == [1, 0, -1]


# -------------------------------------------------------------------------------------------- properties
lattice = st.integers(min_value=-3, max_value=3)
meshes = arrays(np.int64, st.tuples(st.integers(4, 12), st.just(3)), elements=lattice).flatmap(
    lambda points: st.tuples(
        st.just(points.astype(np.float64)),
        arrays(np.int64, st.tuples(st.integers(1, 25), st.just(3)), elements=st.integers(0, len(points) - 1)),
    )
)


def kept(vertices, triangles):
    """Oracle: set of corner sets of triangles with area, by exact integer arithmetic; None where nothing is left."""
    found = []
    for triangle in np.asarray(vertices)[triangles].astype(np.int64).tolist():
        a, b, c = (np.array(p, dtype=np.int64) for p in triangle)
        if np.cross(b - a, c - a).any() and frozenset(map(tuple, triangle)) not in found:
            found.append(frozenset(map(tuple, triangle)))
    return found


@pytest.mark.slow
@given(meshes)
@settings(max_examples=50, deadline=None)
def test_repair_keeps_what_an_exact_oracle_keeps(mesh):
    vertices, triangles = mesh
    expected = kept(vertices, triangles)
    if not expected:
        with pytest.raises(SceneError):
            scene_from_arrays(vertices, triangles)
        return
    scene = scene_from_arrays(vertices, triangles)
    assert [frozenset(map(tuple, t)) for t in corners_of(scene).astype(int).tolist()] == expected
    report = scene.report
    assert report.n_faces_read == len(triangles) == scene.n_triangles + report.n_degenerate + report.n_duplicate
    assert len(np.unique(scene.vertices_m, axis=0)) == len(scene.vertices_m)
    assert np.unique(scene.triangles).tolist() == list(range(len(scene.vertices_m)))


@pytest.mark.slow
@given(meshes, st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_faults_put_among_good_faces_never_change_what_is_kept(mesh, seed):
    vertices, triangles = mesh
    if not kept(vertices, triangles):
        return
    clean = scene_from_arrays(vertices, triangles)
    rng = np.random.default_rng(seed)
    picks = triangles[rng.integers(0, len(triangles), 5)]
    n = len(vertices)
    faults = np.vstack([np.roll(picks, 1, axis=1), picks[:, [0, 0, 1]], [[0, 1, n]], [[n, n, n]]])
    after = np.sort(rng.integers(1, len(triangles) + 1, len(faults)))  # never before a face's first appearance ...
    rows = [*triangles]
    for at, fault in zip(after[::-1], faults, strict=True):
        originals = {frozenset(t.tolist()) for t in triangles[:at]}
        rows.insert(at if frozenset(fault.tolist()) in originals else len(rows), fault)  # ... of a repeated one
    dirty = scene_from_arrays(np.vstack([vertices, [[np.nan, 0, 0]]]), np.array(rows))
    assert dirty.vertices_m.tobytes() == clean.vertices_m.tobytes()
    assert dirty.triangles.tobytes() == clean.triangles.tobytes()
    assert dirty.report.n_faces_read == len(triangles) + len(faults)


@pytest.mark.slow
@given(meshes, st.floats(0.001, 1000.0), st.integers(-(10**7), 10**7))
@settings(max_examples=50, deadline=None)
def test_unit_and_distance_from_the_origin_never_change_the_shape(mesh, unit, shift_m):
    vertices, triangles = mesh
    if not kept(vertices, triangles):
        return
    near = scene_from_arrays(vertices, triangles)
    far = scene_from_arrays((vertices + np.array([shift_m, 0, 0])) / unit, triangles, metres_per_unit=unit)
    assert near.n_triangles == far.n_triangles
    np.testing.assert_allclose(corners_of(far) - [shift_m, 0, 0], corners_of(near), atol=1e-8)
    assert np.abs(far.vertices_m).max() <= FAR_ORIGIN_M + 4


def test_face_height_is_that_over_the_longest_edge():
    corners = np.array([[[0, 0, 0], [4, 0, 0], [1, 0.5, 0]], [[2, 2, 2], [2, 2, 2], [2, 2, 2]]], dtype=np.float64)
    assert face_height_m(corners).tolist() == [0.5, 0.0]


def test_sliver_thinner_than_any_scanner_sees_is_kept_and_a_line_is_not():
    sliver = np.array([[0, 0, 0], [10.0, 0, 0], [5, 1e-7, 0], [5, 1e-9, 0]])
    scene = scene_from_arrays(sliver, [[0, 1, 2], [0, 1, 3]])
    assert (scene.n_triangles, scene.report.n_degenerate) == (1, 1)


@pytest.mark.slow
def test_soup_of_a_few_hundred_thousand_triangles_is_built_right():
    n = 400
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    grid = np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    soup = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    scene = scene_from_arrays(soup, np.arange(len(soup)).reshape(-1, 3))
    assert scene.n_triangles == 2 * n * n
    assert len(scene.vertices_m) == (n + 1) ** 2
    assert np.array_equal(scene.vertices_m[scene.triangles].reshape(-1, 3), soup)


def test_optics_follow_the_triangles_that_are_kept() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [np.nan, 0, 0]]
    triangles = [[0, 1, 2], [0, 1, 4], [0, 1, 1], [0, 1, 3], [2, 1, 0], [0, 2, 3]]
    scene = scene_from_arrays(points, triangles, optics_of_triangle=[0, 2, 1, 1, 2, 2])
    assert scene.optics_of_triangle is not None
    assert scene.optics_of_triangle.dtype == np.uint8
    assert scene.optics_of_triangle.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("optics", "counts"), [([1, 0], 0), ([0, 1], 0), ([1, 2], 2), ([2, 1], 2), ([1, 1, 0, 2], 0), ([1, 1, 2, 0], 2)]
)
def test_surfaces_in_the_place_of_a_pane_are_not_lost_to_it(optics: list[int], counts: int) -> None:
    turns = [[0, 1, 2], [0, 2, 1], [1, 2, 0], [2, 1, 0]][: len(optics)]
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    scene = scene_from_arrays(points, [[0, 1, 3], *turns], optics_of_triangle=[1, *optics])
    assert scene.optics_of_triangle is not None
    assert scene.optics_of_triangle.tolist() == [1, counts]


def test_optics_of_nothing_but_returning_surfaces_are_left_out() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert scene_from_arrays(points, [[0, 1, 2]], optics_of_triangle=[0]).optics_of_triangle is None


@pytest.mark.parametrize("optics", [[3], [-1], [0, 0]])
def test_optics_that_mean_nothing_are_refused(optics: list[int]) -> None:
    with pytest.raises(SceneError, match=r"^optics_of_triangle .* expected .*; pass .*\.$"):
        scene_from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], optics_of_triangle=optics)

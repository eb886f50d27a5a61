"""Patch mode against analytic scenes, brute force in float64, Open3D's occlusion test, and the beams themselves."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.engine.open_engine import open_engine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.patch_samples import (
    ALL_RIM,
    N_FINE,
    N_RIM,
    SLACK,
    expected_returns,
    places_of,
    sample_pattern,
    share_of,
    view_of,
)
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import DeviceMemoryError, RequirementError
from planner_core.model import Optics, Patches, Scene
from planner_core.progress import ProgressEvent
from planner_core.scene.patches import make_patches, patch_triangles

ENGINES = ("opencl", "open3d")
#: Twice the width of the margin that makes triangles watertight, radians: inside it either answer is right.
GRAZING_RAD = 5e-6


def marks_of(mode: PatchMode, template, positions_m: np.ndarray, *, least_returns: float = 0.0) -> np.ndarray:
    """(S, P) marks: bit s, sample s is seen."""
    return mode._patch_engine.marks(view_of(template), positions_m.astype(np.float32), least_returns)


def mode_of(scene: Scene, name: str, max_area_m2: float) -> tuple[PatchMode, Patches, ScanEngine]:
    patches = make_patches(scene, max_area_m2=max_area_m2)
    engine = open_engine(scene, patches, engine=name)
    return PatchMode(engine, scene, patches), patches, engine


def square_at(x: float, half: float, *, y: float = 0.0, z: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A square that faces along x."""
    corners = np.array(
        [[x, y - half, z - half], [x, y + half, z - half], [x, y + half, z + half], [x, y - half, z + half]]
    )
    return corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.cumsum([0] + [len(v) for v, _ in parts[:-1]])
    return np.concatenate([v for v, _ in parts]), np.concatenate(
        [t + offset for (_, t), offset in zip(parts, offsets, strict=True)]
    ).astype(np.int32)


# --------------------------------------------------------------------------------------- analytic scenes
@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
def test_all_of_a_box_room_is_seen_with_exact_range_incidence_and_spacing(shapes: SimpleNamespace, name: str) -> None:
    low, high = np.array([-3.0, -2.0, 0.0]), np.array([4.0, 5.0, 2.5])
    scene = shapes.scene_of(*shapes.box_of(tuple(low), tuple(high)))
    mode, patches, _ = mode_of(scene, name, 0.04)
    template = shapes.template_of(1801, 3600, low_deg=-90, high_deg=90)
    position = np.array([[0.3, 0.4, 1.1]])
    views = mode.see(template, position)
    np.testing.assert_array_equal(views.patch, np.arange(patches.n_patches))
    assert (views.n_visible == N_RIM).all()
    assert (views.n_samples == N_RIM).all()
    at = patch_triangles(scene, patches).mean(axis=1) - position.astype(np.float32)
    range_m = np.linalg.norm(at, axis=1)
    np.testing.assert_allclose(views.range_m, range_m, rtol=1e-5)
    axis = np.argmin(np.minimum(np.abs(at + position - low), np.abs(at + position - high)), axis=1)
    np.testing.assert_allclose(views.cos_incidence, np.abs(at[np.arange(len(at)), axis]) / range_m, rtol=1e-4)
    # Spacing by moving the beam: where the neighbouring column's and row's beams meet the wall's plane.
    azimuth, elevation = np.arctan2(at[:, 1], at[:, 0]), np.arcsin(at[:, 2] / range_m)
    plane = at[np.arange(len(at)), axis]
    tiny = 1e-6
    for column, (da, de, step) in enumerate([(tiny, 0, 2 * np.pi / 3600), (0, tiny, np.deg2rad(0.1))]):
        a, e = azimuth + da, elevation + de
        beam = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1)
        moved = np.linalg.norm(beam * (plane / beam[np.arange(len(at)), axis])[:, None] - at, axis=1) / tiny * step
        np.testing.assert_allclose(views.spacing_m[:, column], moved, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("name", ENGINES)
def test_a_hole_in_a_wall_lets_exactly_the_samples_behind_it_through(shapes: SimpleNamespace, name: str) -> None:
    around = [square_at(1.0, 0.5, y=y, z=z) for y in (-1, 0, 1) for z in (-1, 0, 1) if (y, z) != (0, 0)]
    scene = shapes.scene_of(*joined(*around, square_at(3.0, 2.2)))
    mode, patches, _ = mode_of(scene, name, 0.02)
    position = np.array([[0.0, 0.13, 0.07]])
    marks = marks_of(mode, shapes.template_of(1800, 3600, low_deg=-89, high_deg=89), position)[0]
    behind = np.arange(patches.first_patch[16], patches.n_patches)
    corners = patch_triangles(scene, patches)[behind]
    weights = sample_pattern()[:, :2]
    samples = corners[:, :1] + np.einsum("sk,nki->nsi", weights, corners[:, 1:] - corners[:, :1])
    line = position[0] + (samples - position[0]) / (samples[..., :1])  # where it passes x = 1
    inside = np.abs(line[..., 1:]).max(axis=2)
    wall_ends = 1.5  # beyond it, samples see round the wall
    clear = (np.abs(inside - 0.5) > 1e-5) & (np.abs(inside - wall_ends) > 1e-5)
    seen = (inside < 0.5) | (inside > wall_ends)
    bits = marks[behind, None] >> np.arange(N_RIM + N_FINE) & 1 == 1
    np.testing.assert_array_equal(bits[:, :N_RIM][clear[:, :N_RIM]], seen[:, :N_RIM][clear[:, :N_RIM]])
    again = marks[behind] != ALL_RIM
    np.testing.assert_array_equal(bits[again][clear[again]], seen[again][clear[again]])
    np.testing.assert_array_equal(marks[behind] == 0, ~seen.any(axis=1))
    assert 0 < (again & (marks[behind] != 0)).sum() < behind.size / 2
    assert (marks[: behind[0]] == ALL_RIM).all(), "the near wall is seen whole"


@pytest.mark.parametrize("name", ENGINES)
def test_two_surfaces_in_one_place_are_both_seen_and_a_millimetre_apart_one(shapes: SimpleNamespace, name: str) -> None:
    for gap_m, seen in ((0.0, 4), (1e-3, 2)):
        scene = shapes.scene_of(*joined(square_at(4.0, 0.3), square_at(4.0 + gap_m, 0.2)))
        mode, _, _ = mode_of(scene, name, 1.0)
        row = mode.visible_patches(shapes.template_of(900, 1800), np.zeros((1, 3))).row(0)
        np.testing.assert_array_equal(row, np.arange(seen), err_msg=f"gap {gap_m} m")


@pytest.mark.parametrize("name", ENGINES)
def test_a_surface_is_seen_from_both_sides(shapes: SimpleNamespace, name: str) -> None:
    mode, patches, _ = mode_of(shapes.scene_of(*square_at(2.0, 0.5)), name, 0.1)
    visibility = mode.visible_patches(shapes.template_of(900, 1800), np.array([[0.0, 0, 0], [4.0, 0, 0]]))
    assert visibility.row(0).size == visibility.row(1).size == patches.n_patches


@pytest.mark.opencl
def test_a_patch_is_not_hidden_by_its_own_triangle_however_grazing(shapes: SimpleNamespace) -> None:
    rng = np.random.default_rng(18)
    for height_m in (1e-2, 1e-3, 1e-4, 3e-5, 1e-5, 3e-6):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        flat = np.array([[2.0, -1, 0], [4, -1, 0], [2, 1.5, 0]]) - (0, 0, height_m)
        mode, patches, _ = mode_of(shapes.scene_of(flat @ turn.T, np.array([[0, 1, 2]], dtype=np.int32)), "opencl", 0.1)
        marks = marks_of(mode, shapes.template_of(181, 360, low_deg=-90, high_deg=90), np.zeros((1, 3)))
        np.testing.assert_array_equal(marks, np.full((1, patches.n_patches), ALL_RIM), err_msg=f"{height_m} m above")


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("limit", ["range", "elevation", "azimuth", "incidence", "turn"])
def test_samples_count_within_the_limits_of_the_scanner_alone(shapes: SimpleNamespace, name: str, limit: str) -> None:
    scene = shapes.scene_of(*shapes.box_of((-3, -2, -1), (4, 5, 2)))
    mode, patches, _ = mode_of(scene, name, 0.02)
    template = shapes.template_of(901, 1800, low_deg=-90, high_deg=90)
    position = np.array([0.31, 0.42, 0.13])
    at = patch_triangles(scene, patches) - position
    at = at[:, :1] + np.einsum("sk,nki->nsi", sample_pattern()[:N_RIM, :2], at[:, 1:] - at[:, :1])
    range_m = np.linalg.norm(at, axis=2)
    azimuth, elevation = np.arctan2(at[..., 1], at[..., 0]), np.arcsin(at[..., 2] / range_m)
    max_incidence = None
    if limit == "range":
        template = replace(template, range_min_m=1.2, range_max_m=3.1)
        value, low, high = range_m, 1.2, 3.1
    elif limit == "elevation":
        template = shapes.template_of(700, 1800, low_deg=-60, high_deg=15)
        value, low, high = elevation, np.deg2rad(-60), np.deg2rad(15)
    elif limit == "azimuth":
        template = replace(template, azimuth_rad=np.linspace(0.4, 2.9, 1000))
        value, low, high = azimuth, 0.4, 2.9
    elif limit == "turn":  # more than half a turn, across the seam at pi
        template = replace(template, azimuth_rad=np.linspace(1.0, 5.5, 1000))
        value, low, high = azimuth % (2 * np.pi), 1.0, 5.5
    else:
        max_incidence = np.deg2rad(50)
        corners = patch_triangles(scene, patches)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        cosine = np.abs((at * (normal / np.linalg.norm(normal, axis=1, keepdims=True))[:, None]).sum(axis=2)) / range_m
        value, low, high = np.arccos(cosine), 0.0, max_incidence
    view = view_of(template, max_incidence_rad=max_incidence)
    marks = mode._patch_engine.marks(view, position[None].astype(np.float32), 0.0)[0]
    bits = marks[:, None] >> np.arange(N_RIM) & 1 == 1
    clear = (np.abs(value - low) > 1e-5) & (np.abs(value - high) > 1e-5)
    expected = (value >= low) & (value <= high)
    assert 0.05 < expected.mean() < 0.95
    np.testing.assert_array_equal(bits[clear], expected[clear])


@pytest.mark.parametrize("name", ENGINES)
def test_a_patch_counts_where_a_beam_is_to_be_expected_on_it(shapes: SimpleNamespace, name: str) -> None:
    template = shapes.template_of(1201, 3600)  # steps of 0.1 degrees both ways
    distance_m, area_m2 = 8.0, 0.5 * 0.02 * 0.02
    vertices, triangles = square_at(distance_m, 0.01)
    mode, _, _ = mode_of(shapes.scene_of(vertices, triangles), name, 1.0)
    expected = area_m2 / distance_m**2 / np.deg2rad(0.1) ** 2
    assert 0.9 < expected < 1.1
    for share, seen in ((0.99, 2), (1.01, 0)):
        visibility = mode.visible_patches(template, np.zeros((1, 3)), least_returns=share * expected)
        assert visibility.patch.size == seen
    assert mode.visible_patches(template, np.zeros((1, 3)), least_returns=0).patch.size == 2


@pytest.mark.slow
@pytest.mark.opencl
def test_patches_that_hardly_a_beam_meets_are_left_out_by_the_number_to_be_expected_alone(
    shapes: SimpleNamespace,
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(150, seed=14))
    mode, patches, _ = mode_of(scene, "opencl", 0.002)
    template, position = shapes.template_of(301, 720, low_deg=-60, high_deg=90), np.array([[0.013, 0.027, 1.51]])
    position = position.astype(np.float32).astype(np.float64)
    all_seen = marks_of(mode, template, position)[0]
    seen = np.flatnonzero(all_seen).astype(np.int32)
    places = places_of(scene, patches, seen)
    expected = expected_returns(view_of(template), places.corners_m - position, places.normal, places.area_m2)
    expected *= share_of(all_seen[seen])
    for least in (0.05, 0.5, 1.0, 3.0):
        marks = marks_of(mode, template, position, least_returns=least)[0]
        counts, sure = expected >= least, np.abs(expected - least) > 1e-4 * least
        # Whether a span is half a row is as sharp: a few patches lie within rounding of it.
        assert ((marks[seen] != 0) != counts)[sure].sum() <= 2
        kept = seen[marks[seen] != 0]
        np.testing.assert_array_equal(marks[kept], all_seen[kept])
        assert marks[all_seen == 0].max() == 0
        assert 0.01 < counts.mean() < 0.99, "some of either"


# ------------------------------------------------------------------------------------------ brute force
def brute_force(
    corners: np.ndarray, position: np.ndarray, samples: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whether each sample (n, 3) is hidden, and whether it grazes an edge or lies within rounding of a hit; float64."""
    a, b, c = (corners[:, k] - position for k in range(3))
    p = samples - position
    edges = [np.cross(b, c), np.cross(c, a), np.cross(a, b)]
    length = [np.linalg.norm(x, axis=1) for x in (c - b, a - c, b - a)]
    reach = np.maximum.reduce([np.linalg.norm(x, axis=1) for x in (a, b, c)])
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = p @ (normal / (normal * a).sum(axis=1, keepdims=True)).T
    side = np.sign((normal * a).sum(axis=1))
    inside = np.stack([side * (p @ n.T) for n in edges])
    off = GRAZING_RAD * np.linalg.norm(p, axis=1)[None, :, None] * reach * np.stack(length)[:, None, :]
    in_front = depth > 1 + SLACK
    surely = (inside > off).all(axis=0) & (depth > 1 + 3 * SLACK)
    maybe = (inside > -off).all(axis=0) & (depth > 1 + SLACK / 3)
    for array in (surely, maybe, in_front):
        array[np.arange(len(own)), own] = False
    return surely.any(axis=1), maybe.any(axis=1) & ~surely.any(axis=1)


@pytest.mark.slow
@pytest.mark.opencl
def test_samples_in_a_cluttered_room_are_hidden_as_brute_force_says(shapes: SimpleNamespace) -> None:
    """By the kernel; those of Open3D are the kernel's (the next test) and its own rays' (test_open3d_samples.py)."""
    scene = shapes.scene_of(*shapes.clutter_of(25, seed=11))
    mode, patches, _ = mode_of(scene, "opencl", 0.4)
    template = shapes.template_of(901, 1800, low_deg=-90, high_deg=90)
    position = np.array([[0.0131, 0.0273, 1.511]])
    marks = marks_of(mode, template, position)[0]
    corners = patch_triangles(scene, patches)
    weights = sample_pattern()[:, :2]
    samples = corners[:, :1] + np.einsum("sk,nki->nsi", weights, corners[:, 1:] - corners[:, :1])
    again = marks != ALL_RIM
    cast = np.repeat(again[:, None], N_RIM + N_FINE, axis=1)
    cast[:, :N_RIM] = True
    own = np.repeat(patches.triangle_of_patch[:, None], N_RIM + N_FINE, axis=1)[cast]
    hidden, grazing = brute_force(scene.vertices_m[scene.triangles], position[0], samples[cast], own)
    seen = (marks[:, None] >> np.arange(N_RIM + N_FINE) & 1 == 1)[cast]
    np.testing.assert_array_equal(seen[~grazing], ~hidden[~grazing])
    assert grazing.mean() < 3e-3
    assert 0.1 < seen.mean() < 0.9


@pytest.mark.slow
def test_engines_mark_the_same_samples_but_for_grazing_ones(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(250, seed=12))
    ours, oracle, patches = open_both(scene, 0.01)
    template = shapes.template_of(901, 1800, low_deg=-60, high_deg=90, range_max_m=6.0)
    positions = np.array([[0.013, 0.027, 1.51], [0.11, -0.23, 0.42], [0.21, 0.33, 2.71]])
    a, b = (marks_of(PatchMode(engine, scene, patches), template, positions) for engine in (ours, oracle))
    apart = ((a ^ b)[..., None] >> np.arange(N_RIM + N_FINE, dtype=np.uint32)) & 1 == 1
    # A sample within some 1e-6 rad of a silhouette: either answer is right. A patch seen almost edge-on lies within the
    # margin of its neighbours all over; such are left out here, and are no more than a few.
    places = places_of(scene, patches, np.arange(patches.n_patches, dtype=np.int32))
    at = places.corners_m.mean(axis=1) - positions[:, None]
    edge_on = np.abs((at * places.normal).sum(axis=2)) < 0.02 * np.linalg.norm(at, axis=2)
    assert edge_on.mean() < 0.02
    assert (a != b)[~edge_on].sum() <= 12, f"{apart.sum(axis=2)[~edge_on].sum()} samples of {(a != 0).sum()} patches"
    assert ((a == 0) != (b == 0))[~edge_on].sum() <= 3


def test_a_fence_of_more_triangles_than_are_remembered_hides_what_it_hides(
    open_both: Callable, shapes: SimpleNamespace
) -> None:
    slats = []
    for y in np.linspace(-0.6, 0.6, 1200):
        slats.append(
            (np.array([[1.0, y, -1], [1.0, y + 3e-4, -1], [1.0, y + 3e-4, 1], [1.0, y, 1]]), square_at(0, 1)[1])
        )
    scene = shapes.scene_of(*joined(*slats, square_at(2.0, 0.9)))
    ours, oracle, patches = open_both(scene, 0.05)
    template = shapes.template_of(900, 3600)
    position = np.array([[0.0, 0.0123, 0.0217]])
    a, b = (marks_of(PatchMode(engine, scene, patches), template, position)[0] for engine in (ours, oracle))
    wall = np.arange(patches.first_patch[2400], patches.n_patches)
    assert (a[wall] != 0).mean() > 0.2
    # Slats of 0.3 mm a millimetre apart: one sample in some hundred lies within the margin of an edge.
    apart = ((a[wall] ^ b[wall])[:, None] >> np.arange(N_RIM + N_FINE, dtype=np.uint32) & 1).sum()
    assert apart <= 0.02 * wall.size * (N_RIM + N_FINE)
    np.testing.assert_array_equal(a[wall] != 0, b[wall] != 0)


# -------------------------------------------------------------------------------------------- invariance
@pytest.mark.slow
def test_results_do_not_depend_on_the_batch_and_progress_tells_every_position(
    open_both: Callable, shapes: SimpleNamespace
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(80, seed=13))
    ours, _, patches = open_both(scene, 0.04)
    template = shapes.template_of(901, 1800)
    positions = np.random.default_rng(14).uniform((-0.4, -0.4, 0.3), (0.4, 0.4, 2.6), (7, 3))
    whole = PatchMode(ours, scene, patches).see(template, positions)
    events: list[ProgressEvent] = []
    small = PatchMode(ours, scene, patches, mark_bytes=2 * 4 * patches.n_patches).see(
        template, positions, progress=events.append
    )
    for field in ("starts", "patch", "n_visible", "n_samples", "share", "range_m", "cos_incidence", "spacing_m"):
        assert getattr(whole, field).tobytes() == getattr(small, field).tobytes(), field
    assert [(event.done, event.total) for event in events] == [(2, 7), (4, 7), (6, 7), (7, 7)]
    rows = PatchMode(ours, scene, patches).visible_patches(template, positions[::-1])
    assert [rows.row(6 - i).tolist() for i in range(7)] == [whole.visibility.row(i).tolist() for i in range(7)]


@pytest.mark.parametrize("engine", ENGINES)
def test_patches_that_are_not_asked_about_hide_and_change_nothing_else(engine: str, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(80, seed=13))
    # A fifth of it is glass that beams pass: patches of what is traced have other numbers.
    passes = np.random.default_rng(15).random(scene.n_triangles) < 0.2
    scene = replace(scene, optics_of_triangle=np.where(passes, Optics.PASSES, Optics.RETURNS).astype(np.uint8))
    patches = make_patches(scene, max_area_m2=0.04)
    opened = open_engine(scene, patches, engine=engine)
    template = shapes.template_of(901, 1800)
    rng = np.random.default_rng(14)
    positions = rng.uniform((-0.4, -0.4, 0.3), (0.4, 0.4, 2.6), (5, 3))
    only = rng.random(patches.n_patches) < 0.3
    only[np.repeat(rng.random(scene.n_triangles) < 0.4, np.diff(patches.first_patch))] = False
    whole = PatchMode(opened, scene, patches).see(template, positions)
    some = PatchMode(opened, scene, patches, only=only).see(template, positions)
    kept = only[whole.patch]
    assert 0 < kept.sum() < kept.size
    for field in ("patch", "n_visible", "n_samples", "share", "range_m", "cos_incidence", "spacing_m"):
        assert getattr(some, field).tobytes() == getattr(whole, field)[kept].tobytes(), field
    assert np.diff(some.starts).tolist() == [int(only[whole.visibility.row(i)].sum()) for i in range(5)]
    rows = PatchMode(opened, scene, patches, only=only).visible_patches(template, positions)
    assert rows.patch.tobytes() == some.patch.tobytes()


def test_raising_from_progress_cancels_and_the_next_call_works(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(20, seed=15))
    ours, _, patches = open_both(scene, 0.1)
    mode = PatchMode(ours, scene, patches, mark_bytes=1)
    template, positions = shapes.template_of(200, 400), np.full((3, 3), 0.3)

    def cancel(event: ProgressEvent) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mode.visible_patches(template, positions, progress=cancel)
    assert mode.visible_patches(template, positions).n_positions == 3


def test_one_patch_at_a_time_or_eight_side_by_side_mark_the_same(
    device: Device, open_both: Callable, shapes: SimpleNamespace
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=16))
    ours, _, patches = open_both(scene, 0.04)
    template = shapes.template_of(901, 1800)
    position = np.array([[0.017, 0.023, 1.31]])
    mode = PatchMode(ours, scene, patches)
    eight = marks_of(mode, template, position)
    mode._patch_engine._program = device.program("sample_patches.cl", {"LANES": 1, "STACK": ours.on_device[2]})
    one = marks_of(mode, template, position)
    np.testing.assert_array_equal(one, eight)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_order_of_triangles_changes_no_mark(device: Device, shapes: SimpleNamespace, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = shapes.clutter_of(30, seed=seed)
    order = rng.permutation(len(triangles))
    marks = []
    for number in (np.arange(len(triangles)), order):
        scene = shapes.scene_of(vertices, triangles[number])
        patches = make_patches(scene, max_area_m2=0.1)
        mode = PatchMode(OpenCLEngine(scene, patches, device), scene, patches)
        row = marks_of(mode, shapes.template_of(200, 400), np.array([[0.0, 0.1, 1.4]]))[0]
        marks.append(
            {int(t): row[patches.first_patch[i] : patches.first_patch[i + 1]].tolist() for i, t in enumerate(number)}
        )
    assert marks[0] == marks[1], f"seed {seed}"


# ------------------------------------------------------------------------------------ against the beams
def test_patch_mode_and_beams_agree_on_what_is_seen(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=17))
    ours, _, patches = open_both(scene, 0.04)
    template = shapes.template_of(1500, 3600, low_deg=-60, high_deg=90)
    positions = np.array([[0.013, 0.027, 1.51], [0.11, -0.23, 0.82]])
    views = PatchMode(ours, scene, patches).see(template, positions)
    beams = ours.visible_patches(template, positions)
    for row in range(2):
        of_beams, of_samples = beams.row(row), views.visibility.row(row)
        area = patches.area_m2
        either = area[np.union1d(of_beams, of_samples)].sum()
        apart = area[np.setxor1d(of_beams, of_samples)].sum()
        # Of all area, and of what either sees, which is a fifth to a third of it in buildings.
        assert apart < 0.01 * area.sum(), f"{apart} of {area.sum()} m2"
        assert apart < 0.02 * either, f"{apart} of {either} m2"
        whole = views.n_visible[views.starts[row] : views.starts[row + 1]] == N_RIM
        cosine = views.cos_incidence[views.starts[row] : views.starts[row + 1]]
        large = (area[of_samples] > 0.005) & (cosine > 0.05)
        assert np.isin(of_samples[whole & large], of_beams).all(), "a patch that is seen whole has a return"
    scan = ours.scan(template, positions[:1])
    of = scan.patch[0].ravel()
    hit = of >= 0
    count = np.bincount(of[hit], minlength=patches.n_patches)
    mean_range = np.bincount(of[hit], weights=scan.range_m[0].ravel()[hit], minlength=patches.n_patches)
    whole = (views.n_visible == N_RIM)[: views.starts[1]] & (count[views.patch[: views.starts[1]]] > 20)
    seen = views.patch[: views.starts[1]][whole]
    assert seen.size > 500
    # Returns crowd on the near side of a patch that is met at a slant: by less than a third of its 0.3 m.
    gap_m = np.abs(mean_range[seen] / count[seen] - views.range_m[: views.starts[1]][whole])
    assert gap_m.max() < 0.1
    assert np.median(gap_m) < 0.003
    # As many returns as the spacing says: area / (spacing across x spacing along x sine between them).
    sparse = 1.0 / np.prod(views.spacing_m[: views.starts[1]][whole], axis=1)
    density = count[seen] / patches.area_m2[seen]
    facing = views.cos_incidence[: views.starts[1]][whole] > 0.9
    assert np.median(density[facing] / sparse[facing]) == pytest.approx(1.0, abs=0.05)


# ------------------------------------------------------------------------------------------------ errors
def test_what_makes_no_sense_is_refused_in_one_line(shapes: SimpleNamespace, open_both: Callable) -> None:
    scene = shapes.scene_of(*shapes.box_of((-1, -1, -1), (1, 1, 1)))
    ours, _, patches = open_both(scene, 1.0)
    mode = PatchMode(ours, scene, patches)
    good = shapes.template_of(10, 20)
    with pytest.raises(RequirementError, match="at least 2 x 2"):
        mode.visible_patches(shapes.template_of(1, 20, low_deg=0, high_deg=0), np.zeros((1, 3)))
    with pytest.raises(RequirementError, match="max_incidence_rad: got 0"):
        mode.visible_patches(good, np.zeros((1, 3)), max_incidence_rad=0)
    with pytest.raises(RequirementError, match="least_returns: got -1"):
        mode.visible_patches(good, np.zeros((1, 3)), least_returns=-1)
    with pytest.raises(RequirementError, match="expected finite metres"):
        mode.see(good, np.full((1, 3), np.nan))
    with pytest.raises(RequirementError, match="got engine 'other'"):
        PatchMode(SimpleNamespace(name="other"), scene, patches)  # type: ignore[arg-type]
    assert mode.visible_patches(good, np.zeros((0, 3))).n_positions == 0
    assert mode.see(good, np.zeros((0, 3))).patch.size == 0


@pytest.mark.usefixtures("no_collections")
def test_a_device_short_of_memory_gets_smaller_batches_and_the_user_one_line(
    open_both: Callable, shapes: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(20, seed=19))
    ours, _, patches = open_both(scene, 0.1)
    template, positions = shapes.template_of(200, 400), np.full((5, 3), 0.3)
    mode = PatchMode(ours, scene, patches)
    expected = mode.visible_patches(template, positions)
    cast = mode._patch_engine.marks

    def short_of_memory(view: object, positions_m: np.ndarray, least_returns: float) -> np.ndarray:
        if len(positions_m) > 2:
            raise DeviceMemoryError("no memory, expected some")
        return cast(view, positions_m, least_returns)

    monkeypatch.setattr(mode._patch_engine, "marks", short_of_memory)
    again = mode.visible_patches(template, positions)
    np.testing.assert_array_equal(again.patch, expected.patch)
    np.testing.assert_array_equal(again.starts, expected.starts)
    assert len(ours.warnings) == 1
    assert "went on with 2" in ours.warnings[0]

"""Both engines against analytic truth, and against each other: every disagreement is counted and explained."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.engine import opencl
from planner_core.engine.open_engine import open_engine
from planner_core.engine.opencl import OpenCLEngine
from planner_core.errors import RequirementError, SceneError
from planner_core.model import ScanBatch
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches, patch_of_points

ENGINES = ("opencl", "open3d")


@pytest.mark.parametrize("name", ENGINES)
def test_ranges_in_a_box_room_are_the_slab_formula(shapes: SimpleNamespace, name: str) -> None:
    low, high = np.array([-3.0, -2.0, 0.0]), np.array([4.0, 5.0, 2.5])
    scene = shapes.scene_of(*shapes.box_of(tuple(low), tuple(high)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=0.5), engine=name)
    template = shapes.template_of(33, 250)
    positions = np.array([[0.3, 0.4, 1.1], [-2.5, 4.0, 2.0]])
    batch = engine.scan(template, positions)
    beams = directions(template).astype(np.float32).astype(np.float64)
    for position, range_m, cosine in zip(
        positions.astype(np.float32).astype(np.float64), batch.range_m, batch.cos_incidence, strict=True
    ):
        walls = np.where(beams > 0, high, low)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_walls = np.abs((walls - position) / beams)
        truth = np.nanmin(to_walls, axis=2)
        # Rounding: some ulp over the cosine of the incidence, which is at least 0.03 here.
        np.testing.assert_allclose(range_m, truth, rtol=2e-5)
        nearest = np.sort(to_walls, axis=2)
        clear = nearest[..., 1] - nearest[..., 0] > 1e-4  # not on an edge of the room, where two walls are right
        axis = np.argmin(to_walls, axis=2)
        expected = np.abs(np.take_along_axis(beams, axis[..., None], axis=2)[..., 0])
        np.testing.assert_allclose(cosine[clear], expected[clear], atol=1e-6)
    assert (batch.triangle >= 0).all()


@pytest.mark.parametrize("name", ENGINES)
def test_range_limits_are_returns_and_a_near_surface_blocks(shapes: SimpleNamespace, name: str) -> None:
    near, far = shapes.box_of((1, -1, -1), (1, 1, 1)), shapes.box_of((4, -8, -8), (4, 8, 8))
    # Flat boxes: keep their one face of full area, looking along x.
    vertices = np.concatenate([near[0], far[0]])
    triangles = np.concatenate([near[1][:2], far[1][:2] + 8])
    scene = shapes.scene_of(vertices, triangles)
    engine = open_engine(scene, make_patches(scene, max_area_m2=100.0), engine=name)
    template = shapes.template_of(1, 4, low_deg=0, high_deg=0)

    def first_range(low: float, high: float) -> float:
        return float(
            engine.scan(replace(template, range_min_m=low, range_max_m=high), np.zeros((1, 3))).range_m[0, 0, 0]
        )

    plate = first_range(0.0, 10.0)
    assert plate == pytest.approx(1.0, rel=2e-7)
    assert first_range(plate, plate) == plate
    assert np.isnan(first_range(1.001, 10.0)), "the near plate blocks the beam, the far one is no return"
    assert np.isnan(first_range(0.0, 0.999))
    behind = engine.scan(replace(template, range_min_m=0.0, range_max_m=3.0), np.array([[2.0, 0.0, 0.0]]))
    assert behind.range_m[0, 0, 0] == pytest.approx(2.0, rel=2e-7), "seen from both sides: the far plate ahead"
    assert behind.range_m[0, 0, 2] == pytest.approx(1.0, rel=2e-7), "and the near plate from behind"


def explain(ours: ScanBatch, oracle: ScanBatch, tolerance: float) -> tuple[int, int]:
    """Count beams with another triangle at one range (shared edge or coincident surface), and beams unexplained."""
    other = ours.triangle != oracle.triangle
    with np.errstate(invalid="ignore"):
        same_range = np.abs(ours.range_m - oracle.range_m) <= tolerance * np.maximum(1.0, oracle.range_m)
    return int((other & same_range).sum()), int((other & ~same_range).sum())


def test_scans_of_a_cluttered_room_agree_with_the_oracle(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(250, seed=3))
    ours, oracle, _ = open_both(scene)
    template = shapes.template_of(96, 500, range_max_m=6.0)
    positions = np.array([[0.013, 0.027, 1.51], [0.11, -0.23, 0.42], [0.21, 0.33, 2.71], [-2.03, 1.07, 1.02]])
    a, b = ours.scan(template, positions), oracle.scan(template, positions)
    at_edges, unexplained = explain(a, b, 1e-5)
    # A beam within some 1e-6 rad of a silhouette: either answer is right. Expected of 192 000: one or two.
    assert unexplained <= 4, f"{unexplained} beams differ in range, {at_edges} only in triangle"
    assert at_edges <= 20
    same = (a.triangle == b.triangle) & (a.triangle >= 0)
    np.testing.assert_allclose(a.range_m[same], b.range_m[same], rtol=3e-5)
    np.testing.assert_allclose(a.cos_incidence[same], b.cos_incidence[same], atol=2e-6)
    # Patches differ only where the hit lies within rounding of the line between two of them.
    assert (a.patch != b.patch)[same].sum() <= 40


def test_patches_are_those_of_the_hit_points(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(60, seed=4))
    ours, _, patches = open_both(scene, 0.01)
    template = shapes.template_of(64, 400)
    position = np.array([[0.0137, -0.0219, 1.2571]])  # on no line of symmetry, where patches meet
    batch = ours.scan(template, position)
    beams = directions(template)
    hit = batch.triangle[0] >= 0
    points = position[0] + beams[hit] * batch.range_m[0][hit][:, None].astype(np.float64)
    expected = patch_of_points(scene, patches, points_m=points, triangle=batch.triangle[0][hit])
    assert hit.all()
    assert (expected != batch.patch[0][hit]).mean() < 2e-4
    np.testing.assert_array_equal(patches.triangle_of_patch[batch.patch[0][hit]], batch.triangle[0][hit])


def test_free_rays_agree_with_the_oracle(open_both: Callable, shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(250, seed=5))
    ours, oracle, _ = open_both(scene)
    rng = np.random.default_rng(6)
    origins = rng.uniform((-4, -3, 0), (4, 3, 3), (50_000, 3))
    rays = rng.normal(size=(50_000, 3)) * rng.uniform(1e-3, 1e3, (50_000, 1))
    for range_max_m in (np.inf, 1.5):
        a = ours.cast_rays(origins, rays, range_max_m=range_max_m)
        b = oracle.cast_rays(origins, rays, range_max_m=range_max_m)
        other = a.triangle != b.triangle
        assert other.sum() <= 5, f"rays {np.flatnonzero(other)[:10]}: {a.range_m[other]} {b.range_m[other]}"
        np.testing.assert_allclose(a.range_m[~other], b.range_m[~other], rtol=1e-3, atol=1e-5)


def test_a_free_ray_and_the_same_beam_of_a_scan_have_the_same_bits(
    open_both: Callable, shapes: SimpleNamespace
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(100, seed=7))
    ours, _, _ = open_both(scene)
    template = shapes.template_of(40, 300)
    position = np.array([[0.1, 0.2, 1.0]])
    batch = ours.scan(template, position)
    beams = directions(template).reshape(-1, 3)
    hits = ours.cast_rays(np.repeat(position, len(beams), axis=0), beams, range_max_m=np.inf)
    # The ray kernel normalises its input again: a beam whose bits that changes by an ulp is left out.
    scaled = beams / np.abs(beams).max(axis=1, keepdims=True)
    again = (scaled / np.sqrt((scaled * scaled).sum(axis=1))[:, None]).astype(np.float32)
    same = (again == beams.astype(np.float32)).all(axis=1)
    assert same.mean() > 0.9
    np.testing.assert_array_equal(hits.range_m[same], batch.range_m.ravel()[same])
    np.testing.assert_array_equal(hits.triangle[same], batch.triangle.ravel()[same])


@pytest.mark.parametrize(
    ("waves", "all_widths"),
    [
        (((64, 5), (1, 1)), False),
        pytest.param(((256, 32), (64, 5), (3, 7), (1, 1)), True, marks=pytest.mark.slow),  # built for seconds
    ],
)
def test_a_free_ray_does_not_depend_on_those_beside_it(
    device: Device,
    shapes: SimpleNamespace,
    monkeypatch: pytest.MonkeyPatch,
    waves: tuple[tuple[int, int], ...],
    all_widths: bool,
) -> None:
    scene = shapes.scene_of(*shapes.clutter_of(100, seed=7))
    engine = OpenCLEngine(scene, make_patches(scene, max_area_m2=1e7), device)
    rng = np.random.default_rng(9)
    rays = np.concatenate([rng.uniform((-4, -3, 0), (4, 3, 3), (700, 3)), rng.normal(size=(700, 3))], axis=1)
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    rays = rays.astype(np.float32)
    hits = engine.cast_prepared(rays, range_max_m=1.0)
    assert 0.2 < np.isnan(hits.range_m).mean() < 0.8
    for lanes in {8, device.max_lanes} if all_widths else {device.max_lanes}:
        monkeypatch.setattr(device, "max_lanes", lanes)
        for per_item, walks in waves:
            monkeypatch.setattr(opencl, "_RAYS", {device.kind: (per_item, walks)})
            for order in (np.arange(700), rng.permutation(700), rng.permutation(700)[:61]):
                other = engine.cast_prepared(rays[order], range_max_m=1.0)
                np.testing.assert_array_equal(other.range_m, hits.range_m[order])
                np.testing.assert_array_equal(other.triangle, hits.triangle[order])


@pytest.mark.parametrize("name", ENGINES)
def test_axis_parallel_rays_are_cast(shapes: SimpleNamespace, name: str) -> None:
    scene = shapes.scene_of(*shapes.box_of((-1, -2, -3), (1, 2, 3)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=100.0), engine=name)
    rays = np.concatenate([np.eye(3), -np.eye(3)])
    hits = engine.cast_rays(np.full((6, 3), 0.25), rays, range_max_m=100.0)
    np.testing.assert_allclose(hits.range_m, [0.75, 1.75, 2.75, 1.25, 2.25, 3.25], rtol=2e-7)
    # In the plane of a wall, beside it: nothing is there.
    outside = engine.cast_rays(np.array([[-5.0, 2.5, 0.0]]), np.array([[1.0, 0.0, 0.0]]), range_max_m=100.0)
    assert np.isnan(outside.range_m[0])
    assert outside.triangle[0] == -1


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_order_of_triangles_changes_no_range(device: Device, shapes: SimpleNamespace, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = shapes.clutter_of(40, seed=seed)
    order = rng.permutation(len(triangles))
    template = shapes.template_of(24, 100)
    position = np.array([[0.0, 0.1, 1.4]])
    scenes = [shapes.scene_of(vertices, triangles), shapes.scene_of(vertices, triangles[order])]
    batches = [
        OpenCLEngine(scene, make_patches(scene, max_area_m2=0.1), device).scan(template, position) for scene in scenes
    ]
    np.testing.assert_array_equal(batches[0].range_m, batches[1].range_m)
    # Where two triangles are hit at one range, each scene names its lower number.
    assert (batches[0].triangle != order[batches[1].triangle]).sum() <= 4


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), quarter_turns=st.integers(1, 3))
def test_a_rigid_motion_moves_the_scan_along(
    device: Device, shapes: SimpleNamespace, seed: int, quarter_turns: int
) -> None:
    rng = np.random.default_rng(seed)
    vertices, triangles = shapes.clutter_of(40, seed=seed)
    columns = 96
    template = shapes.template_of(24, columns)
    angle = quarter_turns * np.pi / 2
    turn = np.round([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    shift = rng.uniform(-20, 20, 3)
    position = np.array([[0.0, 0.1, 1.4]])
    moved = shapes.scene_of(vertices @ turn.T + shift, triangles)
    scene = shapes.scene_of(vertices, triangles)
    patches = make_patches(scene, max_area_m2=0.1)
    before = OpenCLEngine(scene, patches, device).scan(template, position)
    after = OpenCLEngine(moved, patches, device).scan(template, position @ turn.T + shift)
    # A quarter turn of the scene is a quarter turn of the columns.
    expected = np.roll(before.range_m, quarter_turns * columns // 4, axis=2)
    differs = ~np.isclose(after.range_m, expected, rtol=1e-3, atol=1e-4)
    assert differs.sum() <= 5, f"seed {seed}: {after.range_m[differs]} {expected[differs]}"


def test_an_incoherent_template_is_scanned_all_the_same(open_both: Callable, shapes: SimpleNamespace) -> None:
    """Tiles that span more than half a turn can't be bounded by a pyramid; zenith and nadir are in one tile."""
    scene = shapes.scene_of(*shapes.clutter_of(80, seed=9))
    ours, oracle, _ = open_both(scene)
    for rows, columns in ((1, 1), (3, 5), (7, 33), (90, 40)):
        template = shapes.template_of(rows, columns, low_deg=-90, high_deg=90)
        a, b = (engine.scan(template, np.array([[0.0, 0.0, 1.4]])) for engine in (ours, oracle))
        assert explain(a, b, 1e-5)[1] == 0
        assert not np.isnan(a.range_m).any()


@pytest.mark.opencl
def test_auto_takes_opencl_without_a_warning(shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 1)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0))
    assert engine.name == "opencl"
    assert engine.warnings == ()


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize(
    ("origins", "rays"),
    [
        ([[0, 0, 0]], [[0, 0, 0]]),
        ([[0, 0, 0]], [[np.nan, 0, 1]]),
        ([[0, 0, 0]], [[np.inf, 0, 1]]),
        ([[0, np.nan, 0]], [[1, 0, 0]]),
        ([[0, np.inf, 0]], [[1, 0, 0]]),
        ([[0, 0, 0], [1, 1, 1]], [[1, 0, 0]]),
        ([[0, 0]], [[1, 0]]),
    ],
)
def test_a_ray_that_is_none_is_refused(shapes: SimpleNamespace, name: str, origins: list, rays: list) -> None:
    scene = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 1)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0), engine=name)
    with pytest.raises(RequirementError, match="expected"):
        engine.cast_rays(np.array(origins, dtype=np.float64), np.array(rays, dtype=np.float64), range_max_m=1.0)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("range_max_m", [0.0, -1.0, float("nan")])
def test_a_range_that_is_none_is_refused(shapes: SimpleNamespace, name: str, range_max_m: float) -> None:
    scene = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 1)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0), engine=name)
    with pytest.raises(RequirementError, match="range_max_m"):
        engine.cast_rays(np.zeros((1, 3)), np.ones((1, 3)), range_max_m=range_max_m)


@pytest.mark.parametrize("name", ENGINES)
def test_tiny_and_huge_directions_are_directions(shapes: SimpleNamespace, name: str) -> None:
    scene = shapes.scene_of(*shapes.box_of((-1, -1, -1), (1, 1, 1)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0), engine=name)
    rays = np.array([[1e-300, 0, 0], [1e300, 1e290, 0], [5e-324, 0, 0]])
    hits = engine.cast_rays(np.full((3, 3), 0.1), rays, range_max_m=10.0)
    np.testing.assert_allclose(hits.range_m, 0.9, rtol=1e-6)
    for one in rays:  # the same for many
        hits = engine.cast_rays(np.full((3, 3), 0.1), np.broadcast_to(one, (3, 3)), range_max_m=10.0)
        np.testing.assert_allclose(hits.range_m, 0.9, rtol=1e-6)


@pytest.mark.parametrize("name", ENGINES)
def test_nothing_to_cast_gives_empty_results(shapes: SimpleNamespace, name: str) -> None:
    scene = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 1)))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0), engine=name)
    none = np.empty((0, 3))
    assert engine.cast_rays(none, none, range_max_m=1.0).range_m.shape == (0,)
    assert engine.scan(shapes.template_of(4, 8), none).patch.shape == (0, 4, 8)
    visibility = engine.visible_patches(shapes.template_of(4, 8), none)
    assert (visibility.n_positions, visibility.patch.size) == (0, 0)


def test_wrong_questions_are_refused(shapes: SimpleNamespace) -> None:
    scene = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 1)))
    patches = make_patches(scene, max_area_m2=1.0)
    with pytest.raises(RequirementError, match="embree"):
        open_engine(scene, patches, engine="embree")
    with pytest.raises(RequirementError, match="device"):
        open_engine(scene, patches, engine="open3d", device="0")
    with pytest.raises(SceneError, match="no triangles"):
        open_engine(shapes.scene_of(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)), patches)
    other = shapes.scene_of(*shapes.clutter_of(2, seed=1))
    with pytest.raises(SceneError, match="make them of this scene"):
        open_engine(other, patches)
    far = shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 1, 2e5)))
    with pytest.raises(SceneError, match="100 km"):
        open_engine(far, patches)


@pytest.mark.parametrize("where", [(0.3, -0.2, -1.0), (1.0, 0.4, 0.25), (-1.0, -1.0, 0.5), (1.0, 1.0, 1.0)])
def test_a_position_on_a_surface_sees_nothing_beyond_it(
    open_both: Callable, shapes: SimpleNamespace, where: tuple[float, float, float]
) -> None:
    """On a face, an edge and a vertex. A building's corner was taken for a place to stand: it saw the facades."""
    ours, oracle, _ = open_both(shapes.scene_of(*shapes.box_of((-1, -1, -1), (1, 1, 1))))
    rays = np.random.default_rng(1).normal(size=(200, 3))
    rays[:6] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    at = np.broadcast_to(np.array(where), rays.shape)
    assert (ours.cast_rays(at, rays, range_max_m=np.inf).range_m <= 1e-5).all()
    assert (oracle.cast_rays(at, rays, range_max_m=np.inf).range_m[6:] <= 1e-5).all()
    scan = ours.scan(shapes.template_of(8, 64), np.array([where]))
    assert (scan.range_m <= 1e-5).all()
    beside = np.array([where]) * 0.999
    assert np.nanmax(ours.scan(shapes.template_of(8, 64), beside).range_m) > 0.5

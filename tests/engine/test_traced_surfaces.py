"""Glass and mirrors: both engines, by beams and by patches, against first hits computed one by one in NumPy float64."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.engine.open_engine import open_engine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.traced_surfaces import traced_surfaces
from planner_core.errors import SceneError
from planner_core.model import FloatArray, Int64Array, Optics, Scene
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches

ENGINES = ("opencl", "open3d")


def first_hits(scene: Scene, origin: FloatArray, beams: FloatArray) -> tuple[FloatArray, Int64Array, FloatArray]:
    """Range, triangle and margin of beams (N, 3): how far from an edge (in barycentric weight) all hits keep."""
    a, b, c = (scene.vertices_m[scene.triangles[:, k]] for k in range(3))
    e1, e2 = b - a, c - a
    across = np.cross(beams[:, None], e2)
    volume = np.einsum("nti,ti->nt", across, e1)
    with np.errstate(divide="ignore", invalid="ignore"):
        to = origin - a
        u = np.einsum("nti,ti->nt", across, to) / volume
        turned = np.cross(to, e1)
        v = beams @ turned.T / volume
        range_m = np.einsum("ti,ti->t", e2, turned) / volume
        least = np.fmin(np.fmin(u, v), 1 - u - v)
    range_m[~((least >= 0) & (range_m > 0))] = np.inf
    triangle = range_m.argmin(axis=1)
    return range_m.min(axis=1), triangle, np.abs(least).min(axis=1)


def glazed(shapes: SimpleNamespace, seed: int, *, passing: float = 0.3, stopping: float = 0.2) -> Scene:
    """Clutter in a room of which some triangles are glass and some mirrors."""
    scene = shapes.scene_of(*shapes.clutter_of(25, seed=seed))
    drawn = np.random.default_rng(seed).random(scene.n_triangles)
    optics = np.where(drawn < passing, Optics.PASSES, np.where(drawn > 1 - stopping, Optics.STOPS, Optics.RETURNS))
    return replace(scene, optics_of_triangle=optics.astype(np.uint8))


def expected_scan(scene: Scene, origin: FloatArray, beams: FloatArray) -> tuple[FloatArray, Int64Array, FloatArray]:
    """What a scan returns: the first hit of what does not let beams pass, and nothing where that is a mirror."""
    assert scene.optics_of_triangle is not None
    meets = np.flatnonzero(scene.optics_of_triangle != Optics.PASSES)
    range_m, triangle, margin = first_hits(replace(scene, triangles=scene.triangles[meets]), origin, beams)
    triangle = meets[triangle]
    none = ~np.isfinite(range_m) | (scene.optics_of_triangle[triangle] == Optics.STOPS)
    return np.where(none, np.nan, range_m), np.where(none, -1, triangle), margin


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scan_is_first_hit_beyond_glass_and_nothing_in_mirrors(shapes: SimpleNamespace, name: str, seed: int) -> None:
    scene = glazed(shapes, seed)
    patches = make_patches(scene, max_area_m2=0.2)
    engine = open_engine(scene, patches, engine=name)
    template = shapes.template_of(17, 90)
    position = np.array([[0.1, -0.2, 1.3]])
    batch = engine.scan(template, position)
    beams = directions(template).astype(np.float32).astype(np.float64).reshape(-1, 3)
    origin = position[0].astype(np.float32).astype(np.float64)
    range_m, triangle, margin = expected_scan(scene, origin, beams)
    clear = margin > 1e-4
    assert clear.mean() > 0.9
    assert (triangle[clear] == -1).sum() > 20
    np.testing.assert_array_equal(batch.triangle.reshape(-1)[clear], triangle[clear])
    np.testing.assert_allclose(batch.range_m.reshape(-1)[clear], range_m[clear], rtol=1e-4)
    seen = triangle[clear] >= 0
    patch = batch.patch.reshape(-1)[clear]
    assert (patch[~seen] == -1).all()
    np.testing.assert_array_equal(np.searchsorted(patches.first_patch, patch[seen], "right") - 1, triangle[clear][seen])
    assert np.isnan(batch.cos_incidence[np.isnan(batch.range_m)]).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
def test_visible_patches_and_returns_are_those_of_the_scan(shapes: SimpleNamespace, name: str) -> None:
    scene = glazed(shapes, 5)
    engine = open_engine(scene, make_patches(scene, max_area_m2=0.1), engine=name)
    template, positions = shapes.template_of(17, 90), np.array([[0.1, -0.2, 1.3], [0.4, 0.4, 2.0]])
    batch = engine.scan(template, positions)
    visibility = engine.visible_patches(template, positions)
    returns = engine.patch_returns(template, positions, moments=True)
    for index in range(2):
        patch = batch.patch[index][batch.patch[index] >= 0]
        np.testing.assert_array_equal(visibility.row(index), np.unique(patch))
        row = returns.row(index)
        np.testing.assert_array_equal(returns.patch[row], np.unique(patch))
        np.testing.assert_array_equal(returns.n_returns[row], np.unique(patch, return_counts=True)[1])


@pytest.mark.slow
@pytest.mark.opencl
def test_engines_agree_on_patch_mode_behind_glass(shapes: SimpleNamespace) -> None:
    scene = glazed(shapes, 7)
    patches = make_patches(scene, max_area_m2=0.1)
    template, positions = shapes.template_of(400, 900), np.array([[0.1, -0.2, 1.3], [0.4, 0.4, 2.0]])
    rows = [
        PatchMode(open_engine(scene, patches, engine=name), scene, patches).visible_patches(template, positions)
        for name in ENGINES
    ]
    assert scene.optics_of_triangle is not None
    optics_of_patch = scene.optics_of_triangle[patches.triangle_of_patch]
    for index in range(2):
        ours, oracle = (set(one.row(index).tolist()) for one in rows)
        assert len(ours) > 300
        assert len(ours ^ oracle) <= 0.01 * len(oracle)
        assert (optics_of_patch[list(ours)] == Optics.RETURNS).all()
    beams = open_engine(scene, patches, engine="open3d").visible_patches(template, positions)
    for index in range(2):  # a beam sees slivers that no sample falls on; but never what patch mode calls hidden whole
        ours, by_beams = set(rows[0].row(index).tolist()), set(beams.row(index).tolist())
        area_m2 = patches.area_m2
        assert area_m2[list(ours ^ by_beams)].sum() < 0.05 * area_m2[list(by_beams)].sum()


@pytest.mark.parametrize("name", ENGINES)
def test_free_rays_meet_glass_and_mirrors(shapes: SimpleNamespace, name: str) -> None:
    scene = glazed(shapes, 9)
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0), engine=name)
    beams = np.random.default_rng(3).normal(size=(500, 3))
    beams = (beams / np.linalg.norm(beams, axis=1)[:, None]).astype(np.float32).astype(np.float64)
    origin = np.array([0.25, -0.25, 1.25])
    hits = engine.cast_rays(np.tile(origin, (500, 1)), beams, range_max_m=np.inf)
    _, triangle, margin = first_hits(scene, origin, beams)
    np.testing.assert_array_equal(hits.triangle[margin > 1e-4], triangle[margin > 1e-4])


def test_a_scan_without_glass_is_the_same_bits_as_before(shapes: SimpleNamespace) -> None:
    scene = glazed(shapes, 11, passing=0.0, stopping=0.0)
    assert traced_surfaces(scene, make_patches(scene, max_area_m2=0.1)).scene is scene


@settings(max_examples=50, deadline=None)
@given(st.lists(st.sampled_from(list(Optics)), min_size=12, max_size=12))
def test_traced_surfaces_keep_numbers_of_triangles_and_patches(shapes: SimpleNamespace, optics: list[Optics]) -> None:
    scene = replace(
        shapes.scene_of(*shapes.box_of((0, 0, 0), (1, 2, 3))), optics_of_triangle=np.array(optics, dtype=np.uint8)
    )
    patches = make_patches(scene, max_area_m2=0.3)
    traced = traced_surfaces(scene, patches)
    whole = [i for i, one in enumerate(optics) if one != Optics.PASSES]
    numbers = np.arange(traced.scene.n_triangles, dtype=np.int32)
    assert traced.in_whole_scene(np.append(numbers, np.int32(-1))).tolist() == [*whole, -1]
    np.testing.assert_array_equal(traced.scene.triangles, scene.triangles[whole])
    np.testing.assert_array_equal(traced.patches.depth, patches.depth[whole])
    for place, number in enumerate(whole):
        stops = optics[number] == Optics.STOPS
        assert traced.first_patch[place] == (-1 if stops else patches.first_patch[number])


@pytest.mark.parametrize("name", ENGINES)
def test_a_scene_all_of_mirrors_returns_nothing_and_one_of_glass_is_refused(shapes: SimpleNamespace, name: str) -> None:
    scene = shapes.scene_of(*shapes.box_of((-2, -2, 0), (2, 2, 3)))
    patches = make_patches(scene, max_area_m2=0.5)
    mirrors = replace(scene, optics_of_triangle=np.full(12, Optics.STOPS, dtype=np.uint8))
    engine, position = open_engine(mirrors, patches, engine=name), np.array([[0.0, 0.0, 1.5]])
    assert (engine.scan(shapes.template_of(5, 20), position).triangle == -1).all()
    assert engine.visible_patches(shapes.template_of(5, 20), position).patch.size == 0
    assert PatchMode(engine, mirrors, patches).visible_patches(shapes.template_of(50, 20), position).patch.size == 0
    glass = replace(scene, optics_of_triangle=np.full(12, Optics.PASSES, dtype=np.uint8))
    with pytest.raises(SceneError, match="all of it is glass, expected a surface that returns beams"):
        open_engine(glass, patches, engine=name)


@pytest.mark.parametrize("name", ENGINES)
def test_rays_that_go_through_glass_meet_what_is_behind_it_by_its_number(shapes: SimpleNamespace, name: str) -> None:
    scene = glazed(shapes, 4)
    assert scene.optics_of_triangle is not None
    engine = open_engine(scene, make_patches(scene, max_area_m2=0.2), engine=name)
    beams = np.random.default_rng(4).normal(size=(2000, 3)).astype(np.float32).astype(np.float64)
    beams /= np.linalg.norm(beams, axis=1)[:, None]
    origin = np.array([0.1, -0.2, 1.3], dtype=np.float32).astype(np.float64)
    from_m = np.broadcast_to(origin, beams.shape)
    meets = np.flatnonzero(scene.optics_of_triangle != Optics.PASSES)
    range_m, triangle, margin = first_hits(replace(scene, triangles=scene.triangles[meets]), origin, beams)
    clear = (margin > 1e-4) & np.isfinite(range_m)
    hits = engine.cast_rays(from_m, beams, range_max_m=100.0, through_glass=True)
    np.testing.assert_array_equal(hits.triangle[clear], meets[triangle][clear])
    np.testing.assert_allclose(hits.range_m[clear], range_m[clear], rtol=1e-4)
    # Mirrors are met, and without being told so, rays meet the glass.
    assert (scene.optics_of_triangle[hits.triangle[clear]] == Optics.STOPS).sum() > 20
    plain = engine.cast_rays(from_m, beams, range_max_m=100.0)
    assert (scene.optics_of_triangle[plain.triangle[clear]] == Optics.PASSES).sum() > 20

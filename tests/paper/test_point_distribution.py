"""F2 against a float64 oracle written from Eq. 2, all pairs of points, of the engine's own returns."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner_core.device import Device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate, Patches, ReturnMoments, Scene
from planner_core.paper import point_distribution as module
from planner_core.paper import reference_distance
from planner_core.paper.point_distribution import PointDistribution, f2_of_set_m2
from planner_core.paper.reference_distance import reference_distances_of_patches_m2
from planner_core.scanner.template import directions
from planner_core.scene.patches import make_patches, patch_triangles

BOTH = pytest.mark.parametrize("which", ["opencl", "open3d"])
DENSITY = 400.0


def halton(number: int, base: int) -> float:
    """One number of the sequence, digit by digit."""
    value, weight = 0.0, 1.0
    while number:
        weight /= base
        value += weight * (number % base)
        number //= base
    return value


def mean_over_pairs(points: np.ndarray, weights: np.ndarray) -> float:
    """Eq. 2's inner sums: for each point the weighted sum over all others; then the mean."""
    n, total = len(points), 0.0
    for i in range(n):
        inner = sum(((points[i] - points[j]) ** 2).sum() for j in range(n))
        total += inner / max(n - 1, 1) * weights[i]
    return total / max(n, 1)


def corners_of(scene: Scene, patches: Patches) -> np.ndarray:
    held = replace(scene, vertices_m=scene.vertices_m.astype(np.float32).astype(np.float64))
    return patch_triangles(held, patches)


def references(corners: np.ndarray, area_m2: np.ndarray, density: float) -> np.ndarray:
    """Eq. 6 of Halton points mapped one by one by Eq. 7, vertices included."""
    found = []
    for (p1, p2, p3), area in zip(corners, area_m2, strict=True):
        points = [p1, p2, p3]
        for number in range(1, max(1, int(np.ceil(round(area * density, 9)))) + 1):
            u, v = halton(number, 2), halton(number, 3)
            points.append((1 - np.sqrt(u)) * p1 + np.sqrt(u) * (1 - v) * p2 + v * np.sqrt(u) * p3)
        points = np.array(points)
        n = len(points)
        squares = ((points[:, None] - points[None]) ** 2).sum(axis=2)
        found.append((squares.sum(axis=1) / max(n - 1, 1)).sum() / max(n, 1))
    return np.array(found)


def oracle(
    room: SimpleNamespace, engine: ScanEngine, template: BeamTemplate, position: np.ndarray, reference: np.ndarray
) -> tuple[int, float, float, float]:
    """F1, F1 by area, F2, and F2 without its second sum, of one position."""
    batch = engine.scan(template, position[None])
    origin = position.astype(np.float32).astype(np.float64)
    corners = corners_of(room.scene, room.patches)
    beams = directions(template).astype(np.float32).astype(np.float64)
    reached = np.unique(batch.patch[batch.patch >= 0])
    excess = 0.0
    for patch in reached:
        mine = batch.patch[0] == patch
        returns = origin + beams[mine] * batch.range_m[0][mine][:, None].astype(np.float64)
        points = np.concatenate([returns, corners[patch]])
        normal = np.cross(corners[patch, 1] - corners[patch, 0], corners[patch, 2] - corners[patch, 0])
        normal /= np.linalg.norm(normal)
        away = origin - points
        weights = 2 - np.abs(away @ normal) / np.linalg.norm(away, axis=1)
        excess += mean_over_pairs(points, weights) - reference[patch]
    area = room.patches.area_m2[reached].sum()
    without = reference.sum() + excess
    return reached.size, area, without - reference[reached].sum(), without


@pytest.fixture(scope="module")
def expected_references(furnished: SimpleNamespace) -> np.ndarray:
    return references(corners_of(furnished.scene, furnished.patches), furnished.patches.area_m2, DENSITY)


@pytest.mark.slow
@BOTH
def test_reference_distances_are_those_of_scattered_points(
    furnished: SimpleNamespace, expected_references: np.ndarray, which: str
) -> None:
    found = PointDistribution(furnished.scene, furnished.patches, getattr(furnished, which), points_per_m2=DENSITY)
    np.testing.assert_allclose(found.reference_m2, expected_references, rtol=1e-11)
    assert found.reference_total_m2 == pytest.approx(expected_references.sum())


@BOTH
def test_f2_is_that_of_the_equation(
    furnished: SimpleNamespace, rooms: SimpleNamespace, expected_references: np.ndarray, which: str
) -> None:
    engine, template = getattr(furnished, which), rooms.template_of(40, 60)
    distribution = PointDistribution(furnished.scene, furnished.patches, engine, points_per_m2=DENSITY)
    found = distribution.of(template, furnished.positions_m)
    sums = distribution.sums(template, furnished.positions_m)
    for index, position in enumerate(furnished.positions_m):
        n_patches, area, f2, without = oracle(furnished, engine, template, position, expected_references)
        assert n_patches > 100
        assert found.n_patches[index] == n_patches
        assert found.area_m2[index] == pytest.approx(area)
        # Moments are rounded to some 1e-6 of a patch's edge.
        assert found.f2_m2[index] == pytest.approx(f2, rel=1e-5)
        assert sums.f2_m2(keep_reached=True)[index] == pytest.approx(without, rel=1e-5)
        assert abs(f2 - without) > 0.1 * abs(without)


def test_device_and_host_give_the_same_sums(furnished: SimpleNamespace, rooms: SimpleNamespace) -> None:
    template = rooms.template_of(30, 50)
    distribution = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    returns = furnished.opencl.patch_returns(template, furnished.positions_m, moments=True)
    host = module._HostSums(furnished.scene, furnished.patches, distribution.reference_m2)
    on_host = host.by_position(returns, furnished.positions_m)
    np.testing.assert_allclose(distribution._sums.by_position(returns, furnished.positions_m), on_host, rtol=1e-12)
    assert distribution.device != "host"


def test_device_without_float64_is_told_and_gives_the_same_figures(
    furnished: SimpleNamespace, rooms: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    template = rooms.template_of(20, 30)
    on_device = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    monkeypatch.setattr(module, "has_float64", lambda device: False)
    on_host = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    assert on_device.warnings == ()
    assert [("float64" in line, "\n" in line) for line in on_host.warnings] == [(True, False)]
    assert on_host.device == "host"
    for one, other in zip(
        on_device.of(template, furnished.positions_m), on_host.of(template, furnished.positions_m), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_figures_do_not_depend_on_the_batch(
    furnished: SimpleNamespace, rooms: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    template = rooms.template_of(20, 30)
    positions = np.concatenate([furnished.positions_m] * 3)
    distribution = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    together = distribution.of(template, positions)
    heard: list[int] = []
    monkeypatch.setattr(module, "_BATCH_BYTES", 1)
    monkeypatch.setattr(module, "_CHUNKS", {"cpu": 7})
    alone = PointDistribution(furnished.scene, furnished.patches, furnished.opencl).of(
        template, positions, progress=lambda event: heard.append(event.done)
    )
    assert heard == list(range(1, len(positions) + 1))
    for one, other in zip(together, alone, strict=True):
        assert one.tobytes() == other.tobytes()
    np.testing.assert_array_equal(alone.f2_m2[:3], alone.f2_m2[3:6])


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 30))
def test_moments_give_the_sum_over_all_pairs(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    corners, origin = rng.normal(size=(3, 3)), rng.normal(size=3) * 5
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    shares = rng.dirichlet(np.ones(3), n)
    points = np.concatenate([shares @ corners, corners])
    away = points - origin
    weights = 2 - np.abs(away @ normal) / np.linalg.norm(away, axis=1)
    p, w = points[:n] - corners[0], weights[:n]
    square = (p**2).sum(axis=1)
    moments = ReturnMoments(
        point_sum_m=p.sum(axis=0)[None],
        square_sum_m2=square.sum()[None],
        weight_sum=w.sum()[None],
        weighted_point_sum_m=(w[:, None] * p).sum(axis=0)[None],
        weighted_square_sum_m2=(w * square).sum()[None],
        range_sum_m=np.zeros(1),
        least_range_m=np.zeros(1, dtype=np.float32),
        greatest_cos_incidence=np.zeros(1, dtype=np.float32),
    )
    found = module.mean_distances_m2(
        np.array([n], dtype=np.int32), moments, slice(0, 1), corners[None], normal[None], origin
    )
    assert found[0] == pytest.approx(mean_over_pairs(points, weights), rel=1e-10), seed


@BOTH
def test_position_that_sees_nothing_has_the_sum_of_all_references(
    furnished: SimpleNamespace, rooms: SimpleNamespace, which: str
) -> None:
    distribution = PointDistribution(furnished.scene, furnished.patches, getattr(furnished, which))
    blind = rooms.template_of(5, 8, range_max_m=0.001)
    found = distribution.of(blind, furnished.positions_m)
    assert found.n_patches.tolist() == [0, 0, 0]
    assert found.area_m2.tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_array_equal(found.f2_m2, distribution.reference_total_m2)
    none = distribution.of(blind, np.empty((0, 3)))
    assert [x.shape for x in none] == [(0,), (0,), (0,)]


def test_f2_of_a_set_is_the_sum_over_its_positions(furnished: SimpleNamespace, rooms: SimpleNamespace) -> None:
    distribution = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    template = rooms.template_of(10, 20)
    each = [distribution.of(template, at[None]).f2_m2[0] for at in furnished.positions_m]
    assert distribution.of_set(template, furnished.positions_m) == pytest.approx(sum(each), rel=1e-14)
    assert f2_of_set_m2(np.empty(0)) == 0.0


def test_finer_scans_are_more_even(furnished: SimpleNamespace, rooms: SimpleNamespace) -> None:
    distribution = PointDistribution(furnished.scene, furnished.patches, furnished.opencl)
    at = furnished.positions_m[:1]
    f2 = [distribution.of(rooms.template_of(n, 2 * n), at).f2_m2[0] for n in (20, 80, 320)]
    assert f2[0] > f2[1] > f2[2]


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan, np.inf])
def test_density_that_makes_no_sense_is_refused(furnished: SimpleNamespace, density: float) -> None:
    with pytest.raises(RequirementError, match="points_per_m2"):
        PointDistribution(furnished.scene, furnished.patches, furnished.opencl, points_per_m2=density)


def test_patch_numbers_are_found_on_meshes_of_many_depths(rooms: SimpleNamespace, device: Device) -> None:
    """Areas from 1e-4 to 50 m^2 side by side: the search for a patch's triangle jumps over short and long runs."""
    rng = np.random.default_rng(5)
    size = 10.0 ** rng.uniform(-2, 1, 300)
    corners = rng.uniform(-20, 20, (300, 1, 3)) + rng.normal(size=(300, 3, 3)) * size[:, None, None]
    # Edges of exactly one length, the longest ones among them, whichever vertex comes first: the rule breaks ties.
    tied = np.array([[[1, 0, 0], [0, 4, 0], [-1, 0, 0]], [[4, 0, 0], [0, 4, 0], [0, 0, 4]]], dtype=float)
    corners = np.concatenate([corners, *(np.roll(tied, turn, axis=1) for turn in range(3))])
    scene = rooms.scene_of(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    patches = make_patches(scene, max_area_m2=0.2)
    assert len(set(patches.depth.tolist())) > 5
    assert patches.n_patches > 5000
    found = PointDistribution(scene, patches, OpenCLEngine(scene, patches, device), points_per_m2=50.0)
    expected = reference_distances_of_patches_m2(scene, patches, points_per_m2=50.0)
    np.testing.assert_allclose(found.reference_m2, expected, rtol=1e-12)
    half = np.concatenate(
        [rng.permutation(patches.n_patches)[:50], np.arange(patches.first_patch[300], patches.n_patches)]
    )
    by_points = references(corners_of(scene, patches)[half], patches.area_m2[half], 50.0)
    np.testing.assert_allclose(found.reference_m2[half], by_points, rtol=1e-11)


def test_host_goes_through_patches_in_parts_with_the_same_result(
    furnished: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = reference_distances_of_patches_m2(furnished.scene, furnished.patches, points_per_m2=100.0)
    monkeypatch.setattr(reference_distance, "_PATCHES_AT_ONCE", 10)
    parts = reference_distances_of_patches_m2(furnished.scene, furnished.patches, points_per_m2=100.0)
    assert whole.tobytes() == parts.tobytes()

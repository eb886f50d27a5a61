"""F2 by plain distances against SciPy's distances of all pairs, on both engines."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.distance import pdist, squareform

from planner_core.errors import RequirementError
from planner_core.model import F2Settings
from planner_core.model.options import method_of
from planner_core.paper import euclidean_distance as module
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.reference_distance import SampleKind, sample_triangle
from planner_core.scanner.template import directions
from planner_core.scene.patches import patch_triangles

BOTH = pytest.mark.parametrize("which", ["opencl", "open3d"])
DENSITY = 400.0


def opened(furnished: SimpleNamespace, which: str, **options: object) -> PointDistribution:
    return PointDistribution(
        furnished.scene, furnished.patches, getattr(furnished, which), points_per_m2=DENSITY, **options
    )


def corners_of(furnished: SimpleNamespace) -> np.ndarray:
    return patch_triangles(furnished.scene, furnished.patches)


def references(furnished: SimpleNamespace) -> np.ndarray:
    """Eq. 6 with d: mean distance of each of the points to the others, Halton's and the vertices."""
    found = []
    for corners, area in zip(corners_of(furnished), furnished.patches.area_m2, strict=True):
        n = max(1, int(np.ceil(round(area * DENSITY, 9))))
        found.append(pdist(np.concatenate([sample_triangle(corners, n, SampleKind.HALTON), corners])).mean())
    return np.array(found)


def weighted_mean(point_m: np.ndarray, corners_m: np.ndarray, position_m: np.ndarray) -> float:
    """Eq. 2's inner sums with d, of the returns on a patch and its vertices."""
    points = np.concatenate([point_m, corners_m])
    normal = np.cross(corners_m[1] - corners_m[0], corners_m[2] - corners_m[0])
    away = points - position_m
    weight = 2 - np.abs(away @ normal) / np.linalg.norm(away, axis=1) / np.linalg.norm(normal)
    return float(np.mean(squareform(pdist(points)).sum(axis=1) / (len(points) - 1) * weight))


@pytest.mark.slow
@BOTH
def test_f2_is_that_of_the_equation_with_plain_distances(
    furnished: SimpleNamespace, rooms: SimpleNamespace, which: str
) -> None:
    template, reference = rooms.template_of(40, 60), references(furnished)
    found = opened(furnished, which, distance="euclidean")
    np.testing.assert_allclose(found.reference_m2, reference, rtol=1e-5)  # vertices are held in float32
    sums = found.sums(template, furnished.positions_m)
    beams, corners = directions(template), corners_of(furnished)
    for index, position in enumerate(furnished.positions_m):
        batch = getattr(furnished, which).scan(template, position[None])
        reached = np.unique(batch.patch[batch.patch >= 0])
        mean = sum(
            weighted_mean(position + beams[mine] * batch.range_m[0][mine][:, None], corners[patch], position)
            for patch in reached
            for mine in [batch.patch[0] == patch]
        )
        assert reached.size > 100
        assert sums.n_patches[index] == reached.size
        assert sums.area_m2[index] == pytest.approx(furnished.patches.area_m2[reached].sum())
        assert sums.mean_distance_m2[index] == pytest.approx(mean, rel=1e-5)
        expected = reference.sum() + mean - 2 * reference[reached].sum()
        assert sums.f2_m2()[index] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
def test_the_choice_of_distance_changes_f2_and_nothing_else(furnished: SimpleNamespace, rooms: SimpleNamespace) -> None:
    template = rooms.template_of(20, 30)
    squared, plain = (
        opened(furnished, "opencl", distance=name).of(template, furnished.positions_m)
        for name in ("squared", "euclidean")
    )
    np.testing.assert_array_equal(squared.n_patches, plain.n_patches)
    np.testing.assert_allclose(squared.area_m2, plain.area_m2, rtol=1e-12)
    assert np.abs(squared.f2_m2 - plain.f2_m2).min() > 0.1


def test_both_engines_give_one_figure(furnished: SimpleNamespace, rooms: SimpleNamespace) -> None:
    template = rooms.template_of(20, 30)
    opencl, open3d = (
        opened(furnished, which, distance="euclidean").of(template, furnished.positions_m)
        for which in ("opencl", "open3d")
    )
    np.testing.assert_allclose(opencl.f2_m2, open3d.f2_m2, rtol=1e-3)


def test_the_figure_does_not_depend_on_batch_or_threads(
    furnished: SimpleNamespace, rooms: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    template = rooms.template_of(20, 30)
    together = opened(furnished, "opencl", distance="euclidean").of(template, furnished.positions_m)
    monkeypatch.setattr("planner_core.paper.point_distribution._BATCH_BYTES", 1)
    monkeypatch.setattr("planner_core.compiled.n_usable_cores", lambda: 3)
    alone = opened(furnished, "opencl", distance="euclidean").of(template, furnished.positions_m)
    assert together.f2_m2.tobytes() == alone.f2_m2.tobytes()


@pytest.mark.slow
def test_a_part_of_very_many_returns_stands_for_all() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]])
    position = np.array([0.1, 0.1, 0.5])
    points = sample_triangle(corners, 3000, SampleKind.RANDOM, seed=4)
    points = points[np.lexsort(np.round(points, 2).T)]  # in rows, as beams come
    for n, tolerance in ((1, 1e-12), (module.MOST_POINTS, 1e-12), (3000, 0.01)):
        starts = np.array([0, n], dtype=np.int64)
        found = module.mean_distances_m(points[:n], starts, corners[None], position)[0]
        assert found == pytest.approx(weighted_mean(points[:n], corners, position), rel=tolerance), n


def test_a_position_that_sees_nothing_has_the_sum_of_all_references(
    furnished: SimpleNamespace, rooms: SimpleNamespace
) -> None:
    distribution = opened(furnished, "opencl", distance="euclidean")
    found = distribution.of(rooms.template_of(5, 8, range_max_m=0.001), furnished.positions_m)
    np.testing.assert_array_equal(found.f2_m2, distribution.reference_total_m2)
    assert found.n_patches.tolist() == [0, 0, 0]


def test_the_method_takes_it_as_an_option(furnished: SimpleNamespace) -> None:
    assert method_of("paper", [("f2.distance", "euclidean")]).f2 == F2Settings("euclidean")
    assert method_of("paper").f2.distance == "squared"
    for wrong in (
        lambda: method_of("paper", [("f2.distance", "cubed")]),
        lambda: opened(furnished, "opencl", distance="d"),
    ):
        with pytest.raises(RequirementError, match=r"^f2\.distance: got '.*', expected one of squared, euclidean"):
            wrong()

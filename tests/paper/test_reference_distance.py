"""Point sets of a triangle and reference distances against scipy's sequences, all pairs, and integrals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist
from scipy.stats import qmc

from planner_core.errors import RequirementError
from planner_core.paper import reference_distance as rd
from planner_core.paper import reference_distance as tp
from planner_core.paper.reference_distance import SampleKind

SCALENE = np.array([[0.2, -0.1, 0.4], [1.3, 0.2, 0.3], [0.5, 0.9, 1.1]])
seeds = st.integers(0, 2**32 - 1)


def triangle_of(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(3, 3))


def squared_edges(corners: np.ndarray) -> float:
    return float(((corners - np.roll(corners, 1, axis=0)) ** 2).sum())


def test_sequence_is_that_of_halton() -> None:
    expected = qmc.Halton(d=2, scramble=False).random(1001)[1:]
    found = np.stack([tp.radical_inverse(1000, base) for base in (2, 3)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_points_are_those_of_equation_7() -> None:
    u, v = qmc.Halton(d=2, scramble=False).random(51)[1:].T[..., None]
    p1, p2, p3 = SCALENE
    expected = (1 - np.sqrt(u)) * p1 + np.sqrt(u) * (1 - v) * p2 + v * np.sqrt(u) * p3
    np.testing.assert_allclose(tp.sample_triangle(SCALENE, 50, SampleKind.HALTON), expected, rtol=1e-13)


@pytest.mark.parametrize("kind", SampleKind)
def test_points_lie_in_the_triangle(kind: SampleKind) -> None:
    points = tp.sample_triangle(SCALENE, 200, kind, seed=3)
    assert len(points) == {SampleKind.GRID: 210, SampleKind.THREE: 3}.get(kind, 200)
    weights = np.linalg.solve(np.concatenate([SCALENE.T, np.ones((1, 3))])[[0, 1, 3]], _plan_rows(points)).T
    assert weights.min() > -1e-12
    np.testing.assert_allclose(weights @ SCALENE, points, atol=1e-12)


def _plan_rows(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points[:, :2].T, np.ones((1, len(points)))])


@pytest.mark.parametrize(
    ("kind", "slack"), [(SampleKind.GRID, 1e-12), (SampleKind.HALTON, 2e-3), (SampleKind.RANDOM, 0.03)]
)
def test_even_sets_have_their_middle_at_the_centroid(kind: SampleKind, slack: float) -> None:
    middle = tp.sample_triangle(SCALENE, 2000, kind, seed=1).mean(axis=0)
    np.testing.assert_allclose(middle, SCALENE.mean(axis=0), atol=slack)


def test_without_the_root_points_crowd_at_the_first_vertex() -> None:
    # A mean of u (1 - v) and u v is 1/4 instead of 1/3.
    middle = tp.sample_triangle(SCALENE, 20000, SampleKind.RANDOM_UV, seed=1).mean(axis=0)
    np.testing.assert_allclose(middle, 0.5 * SCALENE[0] + 0.25 * (SCALENE[1] + SCALENE[2]), atol=0.02)


def test_random_sets_follow_their_seed() -> None:
    one, same, other = (tp.sample_triangle(SCALENE, 20, SampleKind.RANDOM, seed=s) for s in (1, 1, 2))
    assert one.tobytes() == same.tobytes() != other.tobytes()


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(1, 60))
def test_mean_distances_are_those_of_all_pairs(seed: int, n: int) -> None:
    points = np.random.default_rng(seed).normal(size=(n, 3)) + 5.0
    pairs = pdist(points)
    assert tp.mean_distance_m(points) == pytest.approx(pairs.mean() if n > 1 else 0.0, abs=1e-12)
    expected = 2 * (pairs**2).sum() / (n * (n - 1)) if n > 1 else 0.0
    assert tp.mean_squared_distance_m2(points) == pytest.approx(expected, abs=1e-12)


def test_kinds_stand_to_one_another_as_the_paper_draws_them() -> None:
    found = {kind: tp.mean_distance_m(tp.sample_triangle(SCALENE, 300, kind, seed=4)) for kind in SampleKind}
    even = found[SampleKind.HALTON]
    assert found[SampleKind.GRID] == pytest.approx(even, rel=0.08)
    assert found[SampleKind.RANDOM] == pytest.approx(even, rel=0.08)
    assert found[SampleKind.PART] == pytest.approx(even * tp.PART_SIDE, rel=0.1)
    assert found[SampleKind.THREE] > 1.2 * even


def test_no_points_are_refused() -> None:
    with pytest.raises(RequirementError, match="at least 1"):
        tp.sample_triangle(SCALENE, 0, SampleKind.RANDOM)


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(0, 150))
def test_reference_is_equation_6_of_the_points_and_the_vertices(seed: int, n: int) -> None:
    corners = triangle_of(seed)
    points = np.concatenate([corners, tp.sample_triangle(corners, n, SampleKind.HALTON)]) if n else corners
    expected = 2 * (pdist(points) ** 2).sum() / (len(points) * (len(points) - 1))
    found = rd.reference_distances_m2(corners[None], rd.spread_table(150)[n][None])
    assert found[0] == pytest.approx(expected, rel=1e-11), seed


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(0, 500))
def test_reference_grows_with_the_square_of_the_size_and_not_with_a_turn(seed: int, n: int) -> None:
    corners = triangle_of(seed)
    turn, _ = np.linalg.qr(np.random.default_rng(seed + 1).normal(size=(3, 3)))
    factors = rd.spread_table(500)[n][None]
    one, larger, turned = (
        rd.reference_distances_m2(c[None], factors)[0] for c in (corners, 3 * corners, corners @ turn + 7.0)
    )
    assert larger == pytest.approx(9 * one, rel=1e-10)
    assert turned == pytest.approx(one, rel=1e-9)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_reference_goes_from_that_of_vertices_to_that_of_the_whole_triangle(seed: int) -> None:
    # Mean squared distance of two points of a triangle: squared edges / 18. Of its vertices: squared edges / 3.
    corners, edges = triangle_of(seed), squared_edges(triangle_of(seed))
    table = rd.spread_table(50_000)
    found = rd.reference_distances_m2(np.broadcast_to(corners, (4, 3, 3)), table[[0, 1, 100, 50_000]])
    assert found[0] == pytest.approx(edges / 3, rel=1e-12)
    assert found[3] == pytest.approx(edges / 18, rel=1e-3)
    assert found[0] > found[1] > found[2] > found[3]
    # What the default density is chosen by, for a patch of the default size.
    assert 1.04 < found[2] * 18 / edges < 1.13


def test_number_of_points_is_in_proportion_to_the_area_and_at_least_one() -> None:
    area = np.array([0.0, 1e-9, 0.01, 0.04, 0.04 * (1 + 1e-15), 0.0401, 1e9])
    found = rd.reference_points(area, points_per_m2=2500.0)
    assert found.tolist() == [1, 1, 25, 100, 100, 101, rd.MAX_REFERENCE_POINTS]
    assert found.dtype == np.int32

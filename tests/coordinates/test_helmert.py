"""Fits of control points against transformations known beforehand, and against NumPy's least squares."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner_core.coordinates.frame import matrix_of
from planner_core.coordinates.helmert import fit_4, fit_7
from planner_core.errors import CoordinatesError

SCENE_M = np.array([[0.0, 0, 0], [40, 1, 0.2], [38, 25, 3.1], [-2, 22, 2.9], [17, 11, 1.0]])
EAST_NORTH = st.tuples(
    st.floats(-1e6, 1e6), st.floats(-6e6, 6e6), st.floats(-500, 5000)
)  # fmt: skip
ANGLES = st.floats(-math.pi, math.pi)
SCALES = st.floats(0.995, 1.005)


def ones(points: np.ndarray) -> np.ndarray:
    return np.ones(len(points))


def moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3])


def turn_of(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    k = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)


@given(origin=EAST_NORTH, angle=ANGLES, scale=SCALES)
def test_exact_points_give_back_the_transformation_they_were_moved_by(
    origin: tuple[float, float, float], angle: float, scale: float
) -> None:
    matrix = matrix_of(origin, angle, scale)
    fit = fit_4(SCENE_M, moved(matrix, SCENE_M), ones(SCENE_M))
    assert np.abs(moved(fit.matrix, SCENE_M) - moved(matrix, SCENE_M)).max() < 1e-8 * 10
    assert fit.scale == pytest.approx(scale, abs=1e-9)
    assert math.cos(fit.rotation_rad - angle) == pytest.approx(1.0, abs=1e-12)
    assert fit.off_m.max() < 1e-7
    assert fit.matrix[2].tolist()[:3] == [0, 0, 1]


@given(origin=EAST_NORTH, axis_tilt=st.floats(0, 0.05), angle=ANGLES, scale=SCALES)
def test_seven_parameters_give_back_a_tilted_transformation(
    origin: tuple[float, float, float], axis_tilt: float, angle: float, scale: float
) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn_of((1, 0.3, 0), axis_tilt) @ turn_of((0, 0, 1), angle)
    matrix[:3, 3] = origin
    fit = fit_7(SCENE_M, moved(matrix, SCENE_M), ones(SCENE_M))
    assert np.abs(moved(fit.matrix, SCENE_M) - moved(matrix, SCENE_M)).max() < 1e-7
    assert fit.scale == pytest.approx(scale, abs=1e-9)
    assert fit.tilt_rad == pytest.approx(axis_tilt, abs=1e-7)


def with_noise(seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Site coordinates with errors of millimetres, and weights."""
    rng = np.random.default_rng(seed)
    exact = moved(matrix_of((458_870, 5_438_260, 110), 0.4, 0.9996), SCENE_M)
    return exact + rng.normal(0, 0.004, exact.shape), rng.uniform(0.5, 3.0, len(exact))


def test_four_parameters_are_the_least_squares_of_numpy() -> None:
    site, weights = with_noise()
    fit = fit_4(SCENE_M, site, weights)
    x, y = SCENE_M[:, 0], SCENE_M[:, 1]
    zero, one = np.zeros(5), np.ones(5)
    rows = np.concatenate([np.stack([x, -y, one, zero], 1), np.stack([y, x, zero, one], 1)])
    centre = site[:, :2].mean(axis=0)
    told = np.concatenate([site[:, 0] - centre[0], site[:, 1] - centre[1]])
    root = np.sqrt(np.concatenate([weights, weights]))
    (a, b, east, north), misfit, _, _ = np.linalg.lstsq(rows * root[:, None], told * root, rcond=None)
    assert fit.matrix[:2, :2] == pytest.approx(np.array([[a, -b], [b, a]]), abs=1e-10)
    assert fit.matrix[:2, 3] == pytest.approx(centre + np.array([east, north]), abs=1e-8)
    assert fit.sigma_plan_m == pytest.approx(math.sqrt(misfit[0] / (10 - 4)), rel=1e-6)
    assert fit.matrix[2, 3] == pytest.approx(np.average(site[:, 2] - SCENE_M[:, 2], weights=weights), abs=1e-8)
    assert fit.residuals_m == pytest.approx(site - moved(fit.matrix, SCENE_M), abs=1e-8)


@pytest.mark.parametrize(("fit", "n_unknowns"), [(fit_4, 5), (fit_7, 7)])
def test_no_small_change_of_a_fit_lessens_the_weighted_residuals(fit: object, n_unknowns: int) -> None:
    site, weights = with_noise()
    fitted = fit(SCENE_M, site, weights)  # type: ignore[operator]

    def misfit(matrix: np.ndarray) -> float:
        off = site - moved(matrix, SCENE_M)
        return float((weights[:, None] * off**2).sum())

    centre = moved(fitted.matrix, SCENE_M).mean(axis=0)
    least = misfit(fitted.matrix)
    changes = [(0.0, 1e-5, 0, axis) for axis in range(3)] + [(1e-5, 0.0, 1, 2)]
    changes += [(1e-5, 0.0, 1, axis) for axis in (0, 1)] + [(1e-5, 0.0, 2, 0)] if n_unknowns == 7 else []
    for turn, shift, kind, axis in changes:
        for sign in (1, -1):
            other = fitted.matrix.copy()
            linear = np.eye(3)
            if kind == 1:
                linear = turn_of(tuple(np.eye(3)[axis]), sign * turn)
            if kind == 2:
                linear = np.eye(3) * (1 + sign * turn)
            other[:3, :3] = linear @ other[:3, :3]
            other[:3, 3] = linear @ (other[:3, 3] - centre) + centre
            other[axis, 3] += sign * shift
            assert misfit(other) > least


def test_a_fixed_scale_is_one_and_leaves_the_turn() -> None:
    site, weights = with_noise()
    for fit in (fit_4, fit_7):
        fixed = fit(SCENE_M, site, weights, fixed_scale=True)
        assert fixed.scale == pytest.approx(1.0, abs=1e-12)
        assert abs(np.linalg.det(fixed.matrix[:3, :3])) == pytest.approx(1.0, abs=1e-12)
        assert fixed.rotation_rad == pytest.approx(fit(SCENE_M, site, weights).rotation_rad, abs=1e-4)


def test_two_points_fit_exactly_and_have_no_sigma() -> None:
    site = moved(matrix_of((100, 200, 5), 1.0, 1.001), SCENE_M[:2])
    fit = fit_4(SCENE_M[:2], site, ones(site))
    assert fit.off_m.max() < 1e-9
    assert math.isnan(fit.sigma_plan_m)
    assert fit.in_line


def test_points_without_heights_count_in_plan_only() -> None:
    scene, site = SCENE_M.copy(), moved(matrix_of((100, 200, 5), 1.0, 1.0), SCENE_M)
    scene[1, 2] = math.nan
    site[3, 2] = math.nan
    fit = fit_4(scene, site, ones(site))
    assert fit.matrix[2, 3] == pytest.approx(5.0)
    assert np.isnan(fit.residuals_m[[1, 3], 2]).all()
    assert np.isfinite(fit.off_m).all()


@pytest.mark.parametrize("swap", [lambda p: p[:, [1, 0, 2]], lambda p: p * [-1, 1, 1]])
def test_mirrored_points_are_refused(swap: object) -> None:
    site, weights = with_noise()
    for fit in (fit_4, fit_7):
        with pytest.raises(CoordinatesError, match="fit mirrored only"):
            fit(SCENE_M, swap(site), weights)  # type: ignore[operator]


def test_a_wrong_point_is_no_mirror() -> None:
    site, weights = with_noise()
    site[2, 0] += 3.0
    fit = fit_4(SCENE_M, site, weights, fixed_scale=True)
    assert fit.off_m.max() > 1.0


@pytest.mark.parametrize("fit", [fit_4, fit_7])
def test_points_at_one_place_are_refused(fit: object) -> None:
    near = np.array([[5.0, 5, 1], [5.01, 5, 1], [5, 5.01, 1]])
    with pytest.raises(CoordinatesError, match="at one position"):
        fit(near, near + 1000.0, ones(near))  # type: ignore[operator]


def test_points_in_a_line_fix_four_parameters_and_not_seven() -> None:
    line = np.array([[0.0, 0, 0], [10, 5, 0], [20, 10, 0], [30, 15, 0]])
    site = moved(matrix_of((100, 200, 5), 1.0, 1.0), line)
    assert fit_4(line, site, ones(line)).in_line
    with pytest.raises(CoordinatesError, match="in one line"):
        fit_7(line, site, ones(line))
    assert not fit_4(SCENE_M, SCENE_M, ones(SCENE_M)).in_line


def test_level_points_fix_seven_parameters() -> None:
    level = SCENE_M * [1, 1, 0]
    matrix = np.eye(4)
    matrix[:3, :3] = turn_of((1, 0.5, 0), 0.02) @ turn_of((0, 0, 1), 2.0)
    matrix[:3, 3] = 400_000, 5_000_000, 70
    fit = fit_7(level, moved(matrix, level), ones(level))
    assert np.abs(fit.matrix - matrix).max() < 1e-7


def test_points_without_any_height_are_refused() -> None:
    scene = SCENE_M.copy()
    scene[:, 2] = math.nan
    for fit in (fit_4, fit_7):
        with pytest.raises(CoordinatesError, match=r"height|z and H"):
            fit(scene, SCENE_M, ones(scene))

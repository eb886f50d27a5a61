"""Least squares of control points: scene positions and site coordinates -> the matrix between them, and residuals.

4 parameters: a turn about z, one scale in plan and a shift in plan; heights get a shift of their own. 7 parameters: a
turn about any axis, one scale and a shift. Closed forms: 4, a complex quotient; 7, Umeyama, "Least-squares estimation
of transformation parameters between two point patterns" (1991). Both are taken about the weighted centres, so that
northings of millions lose no digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from planner_core.errors import CoordinatesError
from planner_core.model import BoolArray, FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

_MIN_SPREAD_M = 0.1
"""Points closer together than this are one place."""
_LINE_SHARE = 1e-3
"""Points in a line: across it they spread less than this share of their length."""
_MIRRORED_GAIN = 0.2
"""The mirrored fit is taken for the true one where its residuals are less than this share of the other's."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted transformation.

    matrix : (4, 4) scene -> site. residuals_m : (M, 3) site coordinates as given less those computed; NaN in what a
    point does not have. sigma_plan_m, sigma_height_m : standard deviation of unit weight, by the redundancy; NaN where
    there is none. in_line : all points lie in one line, in plan.
    """

    matrix: FloatArray
    residuals_m: FloatArray
    scale: float
    rotation_rad: float
    """About z, counter-clockwise."""
    tilt_rad: float
    sigma_plan_m: float
    sigma_height_m: float
    in_line: bool

    @property
    def off_m(self) -> FloatArray:
        """(M,) how far each point is off, in space, or in plan where it has no height."""
        return np.asarray(np.sqrt(np.nansum(self.residuals_m**2, axis=1)))


def fit_4(scene_m: FloatArray, site_m: FloatArray, weights: FloatArray, *, fixed_scale: bool = False) -> Fit:
    """Fit turn about z, scale and shift in plan, and the shift of heights.

    Parameters
    ----------
    scene_m, site_m
        (M, 3); a height is NaN where a point has none.
    weights
        (M,) above 0.
    fixed_scale
        The scale is 1.

    Raises
    ------
    CoordinatesError
        Fewer than two points, all at one place, no heights, or points that fit mirrored only.
    """
    share = weights / weights.sum()
    here, there = _complex(scene_m), _complex(site_m)
    centre_here, centre_there = complex((share * here).sum()), complex((share * there).sum())
    here, there = here - centre_here, there - centre_there
    spread_m = min(float(np.abs(here).max(initial=0.0)), float(np.abs(there).max(initial=0.0)))
    if len(here) < 2 or spread_m < _MIN_SPREAD_M:
        raise CoordinatesError(
            f"control points: {len(here)} at one position fix no direction, expected two or more that are metres "
            "apart; add some"
        )
    in_line = _in_line(here, share)
    factor = _factor(here, there, share, fixed_scale=fixed_scale)
    off = there - factor * here
    if not in_line:
        _refuse_mirrored(here, there, off, share, fixed_scale=fixed_scale)
    shift = centre_there - factor * centre_here
    rise_m, rises = _rise(scene_m, site_m, weights)
    matrix = np.eye(4)
    matrix[:2, :2] = [[factor.real, -factor.imag], [factor.imag, factor.real]]
    matrix[:3, 3] = shift.real, shift.imag, rise_m
    residuals = np.stack([off.real, off.imag, rises], axis=1)
    return Fit(
        matrix=matrix,
        residuals_m=residuals,
        scale=abs(factor),
        rotation_rad=math.atan2(factor.imag, factor.real),
        tilt_rad=0.0,
        sigma_plan_m=_sigma(residuals[:, :2], weights, 3 if fixed_scale else 4),
        sigma_height_m=_sigma(residuals[:, 2:][np.isfinite(rises)], weights[np.isfinite(rises)], 1),
        in_line=in_line,
    )


def fit_7(scene_m: FloatArray, site_m: FloatArray, weights: FloatArray, *, fixed_scale: bool = False) -> Fit:
    """Fit a turn about any axis, one scale and a shift; parameters as `fit_4`, all points with heights.

    Raises
    ------
    CoordinatesError
        Fewer than three points, points in a line, a missing height, or points that fit mirrored only.
    """
    if not (np.isfinite(scene_m).all() and np.isfinite(site_m).all()):
        raise CoordinatesError("control points: some have no height, expected one of each for 7 parameters; use 4")
    share = (weights / weights.sum())[:, None]
    centre_here, centre_there = (share * scene_m).sum(axis=0), (share * site_m).sum(axis=0)
    here, there = scene_m - centre_here, site_m - centre_there
    spread = np.linalg.svd(here, compute_uv=False)
    if len(here) < 3 or spread[0] < _MIN_SPREAD_M or spread[1] < _LINE_SHARE * spread[0]:
        raise CoordinatesError(
            f"control points: {len(here)} in one line or at one position don't fix 7 parameters, expected three or "
            "more that are not in a line; add some, or use 4 parameters"
        )
    u, sizes, vt = np.linalg.svd((share * there).T @ here)
    mirrored = float(np.linalg.det(u @ vt)) < 0
    if mirrored and spread[2] > _LINE_SHARE * spread[0]:
        _refuse_if_mirror_fits(here, there, u @ vt, share)
    signs = np.array([1.0, 1.0, -1.0 if mirrored else 1.0])
    turn = (u * signs) @ vt
    scale = 1.0 if fixed_scale else float((sizes * signs).sum() / (share * here**2).sum())
    matrix = np.eye(4)
    matrix[:3, :3] = scale * turn
    matrix[:3, 3] = centre_there - scale * turn @ centre_here
    residuals = there - scale * here @ turn.T
    sigma = _sigma(residuals, weights, 6 if fixed_scale else 7)
    return Fit(
        matrix=matrix,
        residuals_m=residuals,
        scale=scale,
        rotation_rad=math.atan2(turn[1, 0], turn[0, 0]),
        tilt_rad=math.acos(max(-1.0, min(1.0, float(turn[2, 2])))),
        sigma_plan_m=sigma,
        sigma_height_m=sigma,
        in_line=_in_line(_complex(scene_m) - complex(*centre_here[:2]), share[:, 0]),
    )


def _complex(points_m: FloatArray) -> ComplexArray:
    return np.asarray(points_m[:, 0] + 1j * points_m[:, 1])


def _factor(here: ComplexArray, there: ComplexArray, share: FloatArray, *, fixed_scale: bool) -> complex:
    """Turn and scale as one complex number."""
    product = complex((share * there * here.conj()).sum())
    if abs(product) == 0.0:
        raise CoordinatesError(
            "control points: no rotation fits them, expected the same points in both; check their order"
        )
    return product / (abs(product) if fixed_scale else float((share * np.abs(here) ** 2).sum()))


def _in_line(centred: ComplexArray, share: FloatArray) -> bool:
    """Whether points lie in a line: the smaller main axis of their spread is nothing beside the larger."""
    plane = np.stack([centred.real, centred.imag])
    small, large = np.linalg.eigvalsh((share * plane) @ plane.T)
    return bool(small <= _LINE_SHARE**2 * large)


def _refuse_mirrored(
    here: ComplexArray,
    there: ComplexArray,
    off: ComplexArray,
    share: FloatArray,
    *,
    fixed_scale: bool,
) -> None:
    flipped = here.conj()
    try:
        other = there - _factor(flipped, there, share, fixed_scale=fixed_scale) * flipped
    except CoordinatesError:
        return
    _compare(float((share * np.abs(off) ** 2).sum()), float((share * np.abs(other) ** 2).sum()))


def _refuse_if_mirror_fits(here: FloatArray, there: FloatArray, mirror: FloatArray, share: FloatArray) -> None:
    u, _, vt = np.linalg.svd(mirror)
    turn = (u * np.array([1.0, 1.0, -1.0])) @ vt

    def misfit(by: FloatArray) -> float:
        scale = float((share * there * (here @ by.T)).sum() / (share * here**2).sum())
        return float((share * (there - scale * here @ by.T) ** 2).sum())

    _compare(misfit(turn), misfit(mirror))


def _compare(misfit: float, mirrored_misfit: float) -> None:
    if misfit > _MIN_SPREAD_M**2 and mirrored_misfit < _MIRRORED_GAIN**2 * misfit:
        raise CoordinatesError(
            f"control points: they fit mirrored only (residuals of {math.sqrt(mirrored_misfit):.3f} m instead of "
            f"{math.sqrt(misfit):.3f} m), expected right-handed axes; E and N, or x and y, look swapped, or one has "
            "the wrong sign"
        )


def _rise(scene_m: FloatArray, site_m: FloatArray, weights: FloatArray) -> tuple[float, FloatArray]:
    """Shift of heights, and residuals (M,), NaN where a point has no height."""
    rises = site_m[:, 2] - scene_m[:, 2]
    has: BoolArray = np.isfinite(rises)
    if not has.any():
        raise CoordinatesError("control points: none has z and H, expected one or more; add a height to one")
    mean = float((weights[has] * rises[has]).sum() / weights[has].sum())
    return mean, np.asarray(rises - mean)


def _sigma(residuals: FloatArray, weights: FloatArray, n_parameters: int) -> float:
    redundancy = residuals.size - n_parameters
    if redundancy <= 0:
        return math.nan
    return math.sqrt(float((weights[:, None] * residuals.reshape(len(weights), -1) ** 2).sum()) / redundancy)

"""F3 by circles: the share of one scan's circle, in plan, that another scan's covers; surfaces and walls play no part.

Input plan positions and radii (metres), output m^2 or shares in [0, 1]. The figure on real surfaces is
`planner_core.network.overlap`; this one ranks positions that nobody has scanned from. docs/method/f3-overlap.md.

References
----------
López et al. 2023, Eq. 3. As printed it takes circles that cut each other for granted; the other cases are ours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planner_core.device import Device
from planner_core.device.precision import has_float64
from planner_core.errors import RequirementError
from planner_core.model import FloatArray, Int32Array


def shared_area_m2(distance_m: ArrayLike, radius_i_m: ArrayLike, radius_j_m: ArrayLike) -> FloatArray:
    """Area that two circles share, float64; arguments broadcast.

    Parameters
    ----------
    distance_m
        Between the middles, at least 0.
    radius_i_m, radius_j_m
        Positive.

    Notes
    -----
    Eq. 3 with d_i = (d^2 + r_i^2 - r_j^2) / 2 d and d_j = d - d_i, both signed: the chord may lie beyond a middle.
    Apart (d >= r_i + r_j): 0. One in the other (d <= |r_i - r_j|, d = 0 among them): the smaller circle; there the arc
    cosine of Eq. 3 has no value, and d_i none for d = 0. For r_i = r_j, d_i = d_j = d / 2: the printed short form.
    """
    d, r, s = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (distance_m, radius_i_m, radius_j_m)))
    cut = (d < r + s) & (d > np.abs(r - s))
    d_i = (d * d + r * r - s * s) / (2.0 * np.where(cut, d, 1.0))
    lens = _segment_m2(r, d_i) + _segment_m2(s, d - d_i)
    smaller = np.pi * np.minimum(r, s) ** 2
    area: FloatArray = np.where(cut, lens, np.where(d < r + s, smaller, 0.0))
    return area


def _segment_m2(radius_m: FloatArray, to_chord_m: FloatArray) -> FloatArray:
    """Area of a circle beyond a chord at a signed distance from its middle."""
    share = np.clip(to_chord_m / radius_m, -1.0, 1.0)
    area: FloatArray = radius_m**2 * (np.arccos(share) - share * np.sqrt(1.0 - share * share))
    return area


def shared_fraction(distance_m: ArrayLike, radius_i_m: ArrayLike, radius_j_m: ArrayLike) -> FloatArray:
    """F3 (Eq. 3): `shared_area_m2` over the area of circle i. Symmetric for equal radii only."""
    own = np.pi * np.asarray(radius_i_m, dtype=np.float64) ** 2
    share: FloatArray = shared_area_m2(distance_m, radius_i_m, radius_j_m) / own
    return share


def circle_overlaps(
    positions_m: FloatArray, radius_m: ArrayLike, *, floor: Int32Array | None = None, device: Device | None = None
) -> FloatArray:
    """(N, N) float64, F3 of all pairs: [i, j] is the share of circle i that circle j covers; 1 on the diagonal.

    Parameters
    ----------
    positions_m : (N, 2) or (N, 3), any height
        Heights are not looked at.
    radius_m : scalar or (N,), the scanner's range.
    floor : (N,) int32; positions of different floors share nothing. None: all are on one.
    device
        Where to compute; None: the host. A device without float64 computes in float32, to 1e-6.

    Raises
    ------
    RequirementError
        Shapes that do not fit, positions that are not finite, radii that are not positive.
    DeviceError
        The device fails.
    """
    plan, radius, floors = _checked(positions_m, radius_m, floor)
    if device is None:
        return _on_host(plan, radius, floors)
    doubles = has_float64(device)
    real = np.float64 if doubles else np.float32
    # About their own middle: float32 metres are coarse far from the origin.
    about = plan - plan.mean(axis=0) if len(plan) else plan
    given = device.upload(
        "F3: circles", {"position": about.astype(real), "radius": radius.astype(real), "floor": floors}
    )
    out = np.empty((len(plan), len(plan)), dtype=real)
    program = device.program("metrics_circles.cl", {"DOUBLES": int(doubles)})
    with device.outputs("F3: shares", {"share": out}) as written:
        program.run("share_circles", (len(plan),), *given.values(), np.int32(len(plan)), written["share"])
    return out.astype(np.float64)


def _on_host(plan_m: FloatArray, radius_m: FloatArray, floor: Int32Array) -> FloatArray:
    """Row by row, so that nothing but the result is as large as it."""
    out = np.empty((len(plan_m), len(plan_m)))
    for i, (at, radius) in enumerate(zip(plan_m, radius_m, strict=True)):
        distance = np.sqrt(((plan_m - at) ** 2).sum(axis=1))
        out[i] = np.where(floor == floor[i], shared_fraction(distance, radius, radius_m), 0.0)
    return out


def _checked(
    positions_m: FloatArray, radius_m: ArrayLike, floor: Int32Array | None
) -> tuple[FloatArray, FloatArray, Int32Array]:
    """Plan positions (N, 2), radii (N,) and floors (N,), or RequirementError."""
    positions = np.asarray(positions_m, dtype=np.float64)
    if positions.ndim != 2 or positions.shape[1] not in (2, 3) or not np.isfinite(positions).all():
        raise RequirementError(
            f"positions_m: got shape {positions.shape}, expected finite (N, 2) or (N, 3); pass one row a position"
        )
    n = len(positions)
    radius = np.asarray(radius_m, dtype=np.float64)
    if radius.shape not in ((), (n,)) or not (np.isfinite(radius) & (radius > 0)).all():
        raise RequirementError(
            f"radius_m: got shape {radius.shape}, expected a positive range in metres or {n} of them; "
            "clamp an endless range to what counts"
        )
    floors = np.zeros(n, dtype=np.int32) if floor is None else np.asarray(floor, dtype=np.int32)
    if floors.shape != (n,):
        raise RequirementError(f"floor: got shape {floors.shape}, expected ({n},); pass one floor a position")
    return np.ascontiguousarray(positions[:, :2]), np.broadcast_to(radius, (n,)).copy(), floors

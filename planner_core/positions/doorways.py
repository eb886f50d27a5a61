"""The middle of doorways, to the millimetre: places from free space are true to a cell, and a door leaves few.

Local frame, metres. From a place in a doorway, rays to all sides find the shortest chord from jamb to jamb; along the
passage the chord stays as short for the wall's thickness. The middle of both is the doorway's.
"""

from __future__ import annotations

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import FloatArray

#: Chords examined: directions of half a turn.
_N_CHORDS = 36
#: Where chords are searched for first: at the place, and round it, since it may lie before the door.
_STARTS_M = np.array(
    [
        (0, 0, 0),
        *((r * np.cos(a), r * np.sin(a), 0) for r in (0.08, 0.16, 0.24, 0.32) for a in np.arange(8) * np.pi / 4),
    ]
)
#: Rays from jamb to jamb are cast at these heights over the ground; the nearest of what they meet counts.
_HEIGHTS_M = (0.3, 1.0, 1.6)
#: Half a chord at most; wider is no doorway.
_REACH_M = 1.5
#: The passage is followed this far to either side, in steps.
_ALONG_M = np.arange(-12, 13) * 0.05
#: The chord may widen by this much inside one doorway: a reveal, a casing.
_SAME_WIDTH_M = 0.06
#: Off the axes, so that no ray lies in the plane of a wall.
_OFF_AXIS_RAD = 0.0071
_ANGLES = _OFF_AXIS_RAD + np.arange(_N_CHORDS) * (np.pi / _N_CHORDS)
_DIRECTIONS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
#: The height at which jambs are searched for first, and how near to them no search starts.
_LOOK_M, _WALL_M = 1.0, 0.05


def centre_in_doorways(engine: ScanEngine, ground_m: FloatArray) -> FloatArray:
    """Move places on the ground (K, 3) in plan to the middle of the doorways that they are in.

    A place between whose sides nothing is found stays. Heights are left as they are.
    """
    n_places = ground_m.shape[0]
    if not n_places:
        return ground_m
    start_m = _between_jambs(engine, ground_m)
    width, ahead, behind = _all_chords(engine, start_m, _HEIGHTS_M)
    best = np.arange(n_places), width.argmin(axis=1)
    bounded = np.isfinite(width[best])
    across = _DIRECTIONS[best[1]]
    middle = _in_middle(start_m, across, ahead[best], behind[best])
    passage = np.column_stack([-across[:, 1], across[:, 0]])
    along = np.repeat(middle, _ALONG_M.size, axis=0)
    along[:, :2] += np.repeat(passage, _ALONG_M.size, axis=0) * np.tile(_ALONG_M, n_places)[:, None]
    ahead, behind = _chords(engine, along, np.repeat(across, _ALONG_M.size, axis=0), _HEIGHTS_M)
    shift_m = _middle_of_run((ahead + behind).reshape(n_places, _ALONG_M.size))
    middle[:, :2] += passage * shift_m[:, None]
    ahead, behind = _chords(engine, middle, across, _HEIGHTS_M)
    middle = _in_middle(middle, across, ahead, behind)
    return np.where(bounded[:, None], middle, ground_m)


def _between_jambs(engine: ScanEngine, ground_m: FloatArray) -> FloatArray:
    """(K, 3) the place near each of places (K, 3), and seen from it, that has the shortest chord."""
    n_places, n_starts = ground_m.shape[0], _STARTS_M.shape[0]
    starts = (ground_m[:, None] + _STARTS_M).reshape(-1, 3)
    width, _, _ = _all_chords(engine, starts, (_LOOK_M,))
    length_m = np.linalg.norm(_STARTS_M[1:], axis=1)
    way = np.tile(_STARTS_M[1:] / length_m[:, None], (n_places, 1))
    origins = np.repeat(ground_m + np.array([0.0, 0.0, _LOOK_M]), n_starts - 1, axis=0)
    hits = engine.cast_rays(origins, way, range_max_m=float(length_m.max()))
    hidden = np.zeros((n_places, n_starts), dtype=bool)
    hidden[:, 1:] = hits.range_m.reshape(n_places, -1) <= length_m + _WALL_M
    # Centimetres: of chords about as short, the one from nearest the place counts, whatever its last bits.
    shortest = np.where(hidden, np.inf, np.round(width.min(axis=1), 2).reshape(n_places, n_starts))
    return np.asarray(starts.reshape(n_places, n_starts, 3)[np.arange(n_places), shortest.argmin(axis=1)])


def _all_chords(
    engine: ScanEngine, ground_m: FloatArray, heights_m: tuple[float, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(K, D) lengths of chords in all directions through places (K, 3), and what of them lies ahead and behind."""
    n_places = ground_m.shape[0]
    ahead, behind = _chords(
        engine, np.repeat(ground_m, _N_CHORDS, axis=0), np.tile(_DIRECTIONS, (n_places, 1)), heights_m
    )
    ahead, behind = ahead.reshape(n_places, _N_CHORDS), behind.reshape(n_places, _N_CHORDS)
    return ahead + behind, ahead, behind


def _chords(
    engine: ScanEngine, ground_m: FloatArray, across: FloatArray, heights_m: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """(K,) free lengths ahead and behind of places (K, 3) along unit vectors (K, 2); inf beyond reach."""
    n_places, n_heights = ground_m.shape[0], len(heights_m)
    origins = np.repeat(ground_m, n_heights, axis=0)
    origins[:, 2] += np.tile(np.array(heights_m), n_places)
    direction = np.repeat(np.column_stack([across, np.zeros(n_places)]), n_heights, axis=0)
    lengths = []
    for way in (direction, -direction):
        hits = engine.cast_rays(origins, way, range_max_m=_REACH_M)
        range_m = np.where(np.isfinite(hits.range_m), hits.range_m, np.inf).astype(np.float64)
        lengths.append(range_m.reshape(n_places, n_heights).min(axis=1))
    return lengths[0], lengths[1]


def _in_middle(ground_m: FloatArray, across: FloatArray, ahead_m: FloatArray, behind_m: FloatArray) -> FloatArray:
    """Places (K, 3) moved to the middle of their chords; those whose chord has no end stay."""
    out = ground_m.copy()
    ends = np.isfinite(ahead_m) & np.isfinite(behind_m)
    out[ends, :2] += across[ends] * (0.5 * (ahead_m[ends] - behind_m[ends]))[:, None]
    return out


def _middle_of_run(width_m: FloatArray) -> FloatArray:
    """(K,) shift along the passage to the middle of the run of chords (K, M) about as short as that at its centre."""
    here = _ALONG_M.size // 2
    shift_m = np.zeros(width_m.shape[0])
    for place, widths in enumerate(width_m):
        short = widths <= widths[here] + _SAME_WIDTH_M
        if not short[here]:
            continue
        low = here - int(np.argmin(np.append(short[here::-1], False))) + 1
        high = here + int(np.argmin(np.append(short[here:], False))) - 1
        shift_m[place] = 0.5 * (_ALONG_M[low] + _ALONG_M[high])
    return shift_m

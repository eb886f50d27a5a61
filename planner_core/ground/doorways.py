"""The middle of doorways, to the millimetre: places from free space are true to a cell, and a door leaves few.

Local frame, metres. From a place in a doorway, rays to all sides find the shortest chord from jamb to jamb; along the
passage the chord stays as short for the wall's thickness. The middle of both is the doorway's.
"""

from __future__ import annotations

import numpy as np

from planner_core.model import FloatArray
from planner_core.scan.engine import ScanEngine

#: Chords looked at: directions of half a turn.
_N_CHORDS = 36
#: Rays from jamb to jamb are cast at these heights over the ground; the nearest of what they meet counts.
_HEIGHTS_M = (0.3, 1.0, 1.6)
#: Half a chord at most; wider is no doorway.
_REACH_M = 1.5
#: The passage is looked along this far to either side, in steps.
_ALONG_M = np.arange(-12, 13) * 0.05
#: The chord may widen by this much inside one doorway: a reveal, a casing.
_SAME_WIDTH_M = 0.06
#: Off the axes, so that no ray lies in the plane of a wall.
_OFF_AXIS_RAD = 0.0071


def centre_in_doorways(engine: ScanEngine, ground_m: FloatArray) -> FloatArray:
    """Move places on the ground (K, 3) in plan to the middle of the doorways that they are in.

    A place between whose sides nothing is found stays. Heights are left as they are.
    """
    if not ground_m.shape[0]:
        return ground_m
    angle = _OFF_AXIS_RAD + np.arange(_N_CHORDS) * (np.pi / _N_CHORDS)
    across = np.column_stack([np.cos(angle), np.sin(angle)])
    n_places = ground_m.shape[0]
    ahead, behind = _chords(engine, np.repeat(ground_m, _N_CHORDS, axis=0), np.tile(across, (n_places, 1)))
    width = (ahead + behind).reshape(n_places, _N_CHORDS)
    best = width.argmin(axis=1)
    bounded = np.isfinite(width[np.arange(n_places), best])
    own = np.arange(n_places) * _N_CHORDS + best
    middle = _in_middle(ground_m, across[best], ahead[own], behind[own])
    passage = np.column_stack([-across[best, 1], across[best, 0]])
    along = np.repeat(middle, _ALONG_M.size, axis=0)
    along[:, :2] += np.repeat(passage, _ALONG_M.size, axis=0) * np.tile(_ALONG_M, n_places)[:, None]
    ahead, behind = _chords(engine, along, np.repeat(across[best], _ALONG_M.size, axis=0))
    shift_m = _middle_of_run((ahead + behind).reshape(n_places, _ALONG_M.size))
    middle[:, :2] += passage * shift_m[:, None]
    ahead, behind = _chords(engine, middle, across[best])
    middle = _in_middle(middle, across[best], ahead, behind)
    return np.where(bounded[:, None], middle, ground_m)


def _chords(engine: ScanEngine, ground_m: FloatArray, across: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(K,) free lengths ahead and behind of places (K, 3) along unit vectors (K, 2); inf beyond reach."""
    n_places, n_heights = ground_m.shape[0], len(_HEIGHTS_M)
    origins = np.repeat(ground_m, n_heights, axis=0)
    origins[:, 2] += np.tile(np.array(_HEIGHTS_M), n_places)
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

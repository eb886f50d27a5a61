"""Why a plan is as it is: what each station adds, the curve of coverage, and the unseen by element, room and reason.

Input the plan's stations, what they and all candidates see (rows of `Visibility`, patch numbers of the survey) and what
is required; output a `Why`. docs/method/unseen.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner_core.coverage.coverage import times_seen
from planner_core.coverage.patch_reasons import Seen, Surfaces, reasons_of_patches, surfaces_of
from planner_core.coverage.pieces import connected_pieces
from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BestPosition,
    BoolArray,
    CurveStep,
    FloatArray,
    Int32Array,
    Int64Array,
    Link,
    OwnPart,
    PointLimits,
    Requirements,
    StationReason,
    Survey,
    UnreachableArea,
    UnseenPiece,
    UnseenSurface,
    Visibility,
    Why,
)
from planner_core.model.unseen import NOT_WORTH, REASONS
from planner_core.progress import Progress, ProgressEvent, silent

#: Parts named for a station, and pieces for a surface.
N_OWN_PARTS, N_PIECES = 3, 5
_STAGE = "reasons"


def explain(
    survey: Survey,
    requirements: Requirements,
    engine: ScanEngine,
    *,
    candidates_m: FloatArray,
    seen_by_candidates: Visibility,
    station_ids: Sequence[str],
    seen_by_stations: Visibility,
    scope: BoolArray,
    achievable: BoolArray | None = None,
    scannable: BoolArray | None = None,
    links: Sequence[Link] = (),
    unreachable: tuple[UnreachableArea, ...] = (),
    required: PointLimits | None = None,
    seen_from: int | None = None,
    progress: Progress = silent,
) -> Why:
    """Find what each station adds, and the reason of everything that is not covered.

    Parameters
    ----------
    candidates_m
        (N, 3), local frame: the rows of `seen_by_candidates`.
    seen_by_candidates, seen_by_stations
        Patches that each sees as well as required, a row each; those of the survey, whatever targets are stacked.
    scope
        (P,) bool, the patches that are required.
    achievable
        (P,) bool; None: at least `seen_from` of candidates and stations see the patch.
    scannable
        (P,) bool, the patches that coverage is a share of, and the curve with it; None: the achievable ones.
    links
        Of the stations, all that are known; those that the requirements count are named.
    unreachable
        Rooms that nobody can walk into.
    required, seen_from
        None: as required of all.

    Notes
    -----
    Covered is what at least `seen_from` stations see. All areas are sums of `survey.patches.area_m2`, and those of
    `unseen` add up to what is in scope and not covered.
    """
    at_least = requirements.seen_from if seen_from is None else seen_from
    n_stations, n_candidates = times_seen(seen_by_stations), times_seen(seen_by_candidates)
    if achievable is None:
        achievable = (n_candidates >= at_least) | (n_stations >= at_least)
    if scannable is None:
        scannable = achievable
    covered = achievable & (n_stations >= at_least)
    needed = covered & scannable & scope
    area_m2 = survey.patches.area_m2
    progress(ProgressEvent(_STAGE, 0, 3, "unseen"))
    unseen = surfaces_of(survey, np.flatnonzero(scope & ~covered).astype(np.int32))
    seen = Seen(n_candidates, achievable, covered, scope)
    limits = requirements.limits if required is None else required
    reason = reasons_of_patches(survey, engine, seen, candidates_m, unseen, required=limits, unreachable=unreachable)
    progress(ProgressEvent(_STAGE, 1, 3, "pieces"))
    why_unseen = reason[unseen.patch].astype(np.int64)
    surfaces, piece_of_patch = _unseen_surfaces(survey, unseen, why_unseen, candidates_m, seen_by_candidates)
    progress(ProgressEvent(_STAGE, 2, 3, "stations"))
    stations = _station_reasons(survey, station_ids, seen_by_stations, n_stations, needed, at_least)
    linked: dict[str, list[str]] = {station: [] for station in station_ids}
    for link in links:
        if link.counts(requirements.link_limits):
            linked[link.a].append(link.b)
            linked[link.b].append(link.a)
    why = Why(
        stations=tuple(replace(one, linked=tuple(sorted(linked[one.station]))) for one in stations),
        curve=steepest_curve(seen_by_stations, station_ids, area_m2, scannable & scope, at_least),
        unseen=surfaces,
        reason_of_patch=reason,
        area_by_reason_m2=tuple(float(area_m2[reason == number].sum()) for number in range(len(REASONS))),
        piece_of_patch=piece_of_patch,
    )
    progress(ProgressEvent(_STAGE, 3, 3))
    return why


# ---------------------------------------------------------------------------------------------- stations
def _station_reasons(
    survey: Survey,
    station_ids: Sequence[str],
    rows: Visibility,
    n_seen: Int32Array,
    covered: BoolArray,
    seen_from: int,
) -> list[StationReason]:
    """What would no longer be covered without each station, by element and room."""
    needed = covered & (n_seen == seen_from)
    own = surfaces_of(survey, np.flatnonzero(needed).astype(np.int32))
    row_of = np.full(needed.size, -1, dtype=np.int64)
    row_of[own.patch] = np.arange(own.patch.size)
    out = []
    for index, station in enumerate(station_ids):
        mine = own.take(row_of[rows.row(index)[needed[rows.row(index)]]])
        key = np.column_stack([mine.element, mine.room])
        parts, which = np.unique(key, axis=0, return_inverse=True)
        area_m2 = np.bincount(which.ravel(), weights=mine.area_m2, minlength=parts.shape[0])
        largest = np.argsort(-area_m2, kind="stable")[:N_OWN_PARTS]
        named = tuple(OwnPart(int(parts[k, 0]), int(parts[k, 1]), float(area_m2[k])) for k in largest)
        out.append(StationReason(station, float(mine.area_m2.sum()), named, ()))
    return out


def steepest_curve(
    rows: Visibility, station_ids: Sequence[str], area_m2: FloatArray, counted: BoolArray, seen_from: int = 1
) -> tuple[CurveStep, ...]:
    """Coverage after 1, 2, ... of the stations, always taking the one that adds most; of equals the first.

    counted : (P,) bool, the achievable patches in question. Where several stations must see a patch, each look that it
    still needs counts as if it were the last.
    """
    total_m2 = float(area_m2[counted].sum())
    n_seen = np.zeros(area_m2.size, dtype=np.int64)
    weight_m2 = area_m2 * counted

    def gain_m2(index: int) -> float:
        row = rows.row(index)
        return float(weight_m2[row[n_seen[row] < seen_from]].sum())

    seers = rows.turned()
    gains = np.array([gain_m2(index) for index in range(len(station_ids))])
    order = np.zeros(gains.size, dtype=np.int64)
    covered_by = np.zeros(area_m2.size, dtype=np.int64)  # the number of the station that covers a patch
    for number in range(1, gains.size + 1):
        best = int(np.argmax(gains))
        order[number - 1], gains[best] = best, -np.inf
        row = rows.row(best)
        n_seen[row] += 1
        now = row[n_seen[row] == seen_from]
        covered_by[now] = number
        # Only who sees what is covered now adds less than before.
        for index in np.unique(np.concatenate([seers.row(patch) for patch in now])).tolist() if now.size else ():
            if np.isfinite(gains[index]):
                gains[index] = gain_m2(index)
    covered_m2 = np.cumsum(np.bincount(covered_by, weights=weight_m2, minlength=gains.size + 1)[1:])
    return tuple(
        CurveStep(station_ids[index], float(m2), float(m2) / total_m2 if total_m2 > 0 else 1.0)
        for index, m2 in zip(order.tolist(), covered_m2.tolist(), strict=True)
    )


# ------------------------------------------------------------------------------------------------ unseen
def _unseen_surfaces(
    survey: Survey, unseen: Surfaces, reason: Int64Array, candidates_m: FloatArray, rows: Visibility
) -> tuple[tuple[UnseenSurface, ...], Int32Array]:
    """The surfaces, largest first, and of each patch (P,) the patch that names its piece, -1 none."""
    key = np.column_stack([unseen.element, unseen.room, unseen.floor, reason])
    groups, group = np.unique(key, axis=0, return_inverse=True)
    group = group.ravel().astype(np.int64)
    area_m2 = np.bincount(group, weights=unseen.area_m2, minlength=len(groups))
    pieces = connected_pieces(survey.scene, survey.patches, unseen.patch, group)
    largest, n_pieces, named = _largest_pieces(unseen, group, pieces, len(groups))
    piece_of_patch = np.full(survey.patches.n_patches, -1, dtype=np.int32)
    piece_of_patch[unseen.patch] = named
    spots = _best_positions(unseen, group, reason, candidates_m, rows)
    surfaces = tuple(
        UnseenSurface(
            element=int(groups[k, 0]),
            room=int(groups[k, 1]),
            floor=survey.floors[groups[k, 2]].id if groups[k, 2] >= 0 else "",
            reason=REASONS[groups[k, 3]],
            area_m2=float(area_m2[k]),
            n_pieces=int(n_pieces[k]),
            pieces=largest[k],
            best_position=spots.get(int(k)),
        )
        for k in np.argsort(-area_m2, kind="stable")
    )
    return surfaces, piece_of_patch


def _largest_pieces(
    unseen: Surfaces, group: Int64Array, piece: Int64Array, n_groups: int
) -> tuple[list[tuple[UnseenPiece, ...]], Int64Array, Int32Array]:
    """The `N_PIECES` largest pieces of each group, how many each has, and of each row (N,) its piece's patch, or -1."""
    n_all = int(piece.max(initial=-1)) + 1
    area_m2 = np.bincount(piece, weights=unseen.area_m2, minlength=n_all)
    group_of = np.zeros(n_all, dtype=np.int64)
    group_of[piece] = group
    order = np.lexsort((-area_m2, group_of))
    n_pieces = np.bincount(group_of, minlength=n_groups).astype(np.int64)
    first = np.cumsum(n_pieces) - n_pieces
    by_piece = np.argsort(piece, kind="stable")
    ends = np.cumsum(np.bincount(piece, minlength=n_all))
    named = np.full(piece.size, -1, dtype=np.int32)
    out = []
    for k in range(n_groups):
        pieces = []
        for p in order[first[k] : first[k] + min(N_PIECES, n_pieces[k])].tolist():
            rows = by_piece[ends[p - 1] if p else 0 : ends[p]]
            pieces.append(_piece(unseen, rows))
            named[rows] = pieces[-1].patch
        out.append(tuple(pieces))
    return out, n_pieces, named


def _piece(unseen: Surfaces, rows: Int64Array) -> UnseenPiece:
    area_m2, at_m, corners_m = unseen.area_m2[rows], unseen.centroid_m[rows], unseen.corners_m[rows].reshape(-1, 3)
    weight = area_m2 if area_m2.any() else np.ones_like(area_m2)  # slivers have no area
    centroid_m = (weight[:, None] * at_m).sum(axis=0) / weight.sum()
    nearest = int(((at_m - centroid_m) ** 2).sum(axis=1).argmin())
    return UnseenPiece(
        area_m2=float(area_m2.sum()),
        n_patches=int(rows.size),
        centroid_m=centroid_m,
        box_m=np.stack([corners_m.min(axis=0), corners_m.max(axis=0)]),
        patch=int(unseen.patch[rows[nearest]]),
    )


def _best_positions(
    unseen: Surfaces,
    group: Int64Array,
    reason: Int64Array,
    candidates_m: FloatArray,
    rows: Visibility,
) -> dict[int, BestPosition]:
    """The candidate that sees most of each group that is not worth a station; of equals the one that adds most."""
    group_of = np.full(rows.n_patches, -1, dtype=np.int64)
    weight_m2 = np.zeros(rows.n_patches)
    left = reason == NOT_WORTH
    group_of[unseen.patch[left]] = group[left]
    weight_m2[unseen.patch[left]] = unseen.area_m2[left]
    entries, patches = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int32)]
    for first, piece in rows.pieces():
        which = np.flatnonzero(group_of[piece] >= 0)
        entries.append(first + which)
        patches.append(piece[which])
    entry, patch = np.concatenate(entries), np.concatenate(patches)
    candidate = np.searchsorted(rows.starts, entry, side="right") - 1
    adds_m2 = np.bincount(candidate, weights=weight_m2[patch], minlength=rows.n_positions)
    pair, which = np.unique(group_of[patch] * rows.n_positions + candidate, return_inverse=True)
    sees_m2 = np.bincount(which, weights=weight_m2[patch], minlength=pair.size)
    of_group, of_candidate = pair // rows.n_positions, pair % rows.n_positions
    order = np.lexsort((of_candidate, -adds_m2[of_candidate], -sees_m2, of_group))
    found, best = np.unique(of_group[order], return_index=True)
    return {
        int(k): BestPosition(
            candidate=int(of_candidate[at]),
            position_m=candidates_m[of_candidate[at]].copy(),
            sees_m2=float(sees_m2[at]),
            adds_m2=float(adds_m2[of_candidate[at]]),
        )
        for k, at in zip(found, order[best], strict=True)
    }

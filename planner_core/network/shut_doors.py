"""Links that exist only while a door is open, or only while it is shut.

Input links of a plan, what its stations see with doors as in the scene, and the scene's open doors (local frame,
metres); output the links with the doors that decide.

No ray is cast. With a door shut a station sees what it sees now, but for patches whose line of sight crosses the
door's opening, which is known of every open door:

    station . ------ | -- x patch       crosses: hidden
                     |
                     | door's panel, in the middle of its box
             . ----- | -- x             a station in the doorway keeps the door open: nothing is hidden from it

The shut leaf itself, some 2 m^2 of each scan, is not counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from planner_core.coverage.coverage import kept_rows, stacked_rows, take_rows, times_seen
from planner_core.model import (
    BoolArray,
    FloatArray,
    Link,
    PlacedDoor,
    Requirements,
    Scene,
    Survey,
    Visibility,
)
from planner_core.network.links import least_listed_overlap, overlap_links, surface_of_patches

#: A tripod this near to a door's panel stands in its way: legs are 0.5 m apart.
_IN_WAY_M = 0.4
#: Doors are set into walls up to this thick.
_THICKEST_M = 0.6


def with_doors(
    links: Sequence[Link],
    survey: Survey,
    requirements: Requirements,
    visibility: Visibility,
    station_ids: Sequence[str],
    position_m: FloatArray,
) -> tuple[Link, ...]:
    """Add to each link the open doors by which it counts, or does not.

    visibility : patches that overlap is counted on, of each station. position_m : (S, 3), local.

    Doors whose leaf is modelled ajar, without a frame, are left out: where they shut is not known. Each door is shut by
    itself, during the first scan, the second, or both, for `only_open`; during both for `only_shut`.
    """
    scene, limits = survey.scene, requirements.link_limits
    if not scene.open_doors or not links:
        return tuple(links)
    surface = surface_of_patches(scene, survey.patches, times_seen(visibility) > 0)
    only_open: dict[frozenset[str], list[str]] = {}
    only_shut: dict[frozenset[str], list[str]] = {}
    place = {station: row for row, station in enumerate(station_ids)}
    for door in _known_doors(scene):
        hidden = hidden_by(door, visibility, surface.centroid_m, position_m)
        n_hidden = np.add.reduceat(np.append(hidden, False), visibility.starts[:-1], dtype=np.int64)
        n_hidden[np.diff(visibility.starts) == 0] = 0
        changes = n_hidden > 0
        concerned = [link for link in links if changes[place[link.a]] or changes[place[link.b]]]
        if not concerned:
            continue
        rows = np.array(sorted({place[end] for link in concerned for end in (link.a, link.b)}), dtype=np.int64)
        names = [station_ids[row] for row in rows.tolist()]
        states = stacked_rows(take_rows(visibility, rows), take_rows(kept_rows(visibility, ~hidden), rows))
        found = overlap_links(
            states,
            survey.patches.area_m2,
            (*names, *(f"{name}{_SHUT}" for name in names)),
            surface,
            np.tile(position_m[rows], (2, 1)),
            min_overlap=least_listed_overlap(limits.overlap),
            measure=requirements.overlap_measure,
            pre_alignment=requirements.start_of(survey.scanner),
        )
        counts = {frozenset((each.a, each.b)) for each in found if each.reaches(limits)}
        name = scene.elements[door.element].source_id
        for link in concerned:
            ends = frozenset((link.a, link.b))
            states_of = [(link.a + one, link.b + other) for one, other in product(("", _SHUT), repeat=2)]
            good = [frozenset(each) in counts for each in states_of]
            if link.counts(limits) and not all(good[1:]):
                only_open.setdefault(ends, []).append(name)
            elif not link.counts(limits) and good[-1]:
                only_shut.setdefault(ends, []).append(name)
    return tuple(
        replace(
            link,
            only_open=tuple(only_open.get(frozenset((link.a, link.b)), ())),
            only_shut=tuple(only_shut.get(frozenset((link.a, link.b)), ())),
        )
        for link in links
    )


def with_all_doors_shut(survey: Survey, visibility: Visibility, position_m: FloatArray) -> Visibility:
    """What positions (N, 3) see of what they see with doors open, (N rows) `visibility`, once all are shut."""
    centroid_m = surface_of_patches(survey.scene, survey.patches, times_seen(visibility) > 0).centroid_m
    hidden = np.zeros(int(visibility.starts[-1]), dtype=np.bool_)
    for door in _known_doors(survey.scene):
        hidden |= hidden_by(door, visibility, centroid_m, position_m)
    return kept_rows(visibility, ~hidden)


def doors_in_sight(scene: Scene, sensor_m: FloatArray, places_m: FloatArray) -> set[str]:
    """Ids of open doors through which a sensor (3,) sees some of places (N, 3), all local."""
    n = places_m.shape[0]
    seen = Visibility(np.array([0, n], dtype=np.int64), np.arange(n, dtype=np.int32), n)
    return {
        scene.elements[door.element].source_id
        for door in _known_doors(scene)
        if hidden_by(door, seen, places_m, sensor_m[None]).any()
    }


def unknown_doors(scene: Scene) -> tuple[str, ...]:
    """A line on open doors of which it is not known where they shut; none where all are known."""
    n_unknown = len(scene.open_doors) - len(_known_doors(scene))
    if not n_unknown:
        return ()
    return (
        f"doors change: {n_unknown} of the {len(scene.open_doors)} open doors are modelled ajar and have no frame, so "
        "where they shut is not known and they are taken as open; keep these open, or model them shut",
    )


def _known_doors(scene: Scene) -> list[PlacedDoor]:
    return [door for door in scene.open_doors if door.thickness_m <= _THICKEST_M]


#: Behind the id of a station that is scanned with the door shut; ids of stations have no such character.
_SHUT = "\x00"


def hidden_by(door: PlacedDoor, visibility: Visibility, centroid_m: FloatArray, position_m: FloatArray) -> BoolArray:
    """(E,) bool: which entries of `visibility` a door hides when it is shut.

    centroid_m : (P, 3) of patches. position_m : (N, 3) of the rows' stations.
    """
    across, (low_m, high_m) = door.across, door.box_m[:, 2]
    one_m, other_m = door.line_m
    middle_m, half_m = 0.5 * (one_m + other_m), 0.5 * float(np.linalg.norm(other_m - one_m))
    along = np.array([-across[1], across[0]])
    hidden = np.zeros(visibility.starts[-1], dtype=np.bool_)
    away_m = (position_m[:, :2] - middle_m) @ across
    beside_m = np.abs((position_m[:, :2] - middle_m) @ along)
    in_way = (np.abs(away_m) < _IN_WAY_M) & (beside_m < half_m)
    in_way &= (position_m[:, 2] > low_m) & (position_m[:, 2] < high_m)
    for row in np.flatnonzero(~in_way).tolist():
        entries = slice(int(visibility.starts[row]), int(visibility.starts[row + 1]))
        at_m = centroid_m[visibility.row(row)]
        beyond_m = (at_m[:, :2] - middle_m) @ across
        # Sight lines go from `away_m` to `beyond_m`; where both lie on one side of the panel's plane, none meets it.
        other_side = np.flatnonzero(beyond_m * away_m[row] < 0.0)
        share = away_m[row] / (away_m[row] - beyond_m[other_side])
        met_m = position_m[row] + share[:, None] * (at_m[other_side] - position_m[row])
        through = np.abs((met_m[:, :2] - middle_m) @ along) <= half_m
        through &= (met_m[:, 2] >= low_m) & (met_m[:, 2] <= high_m)
        hidden[entries][other_side[through]] = True
    return hidden

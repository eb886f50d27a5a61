"""A preview: what a draft would be worth with one station put elsewhere, or one more. Answered while it is dragged.

Input a draft's standing, the standing of its other stations, and where the station would be; output only what differs:
patches whose figures change, the station's own figures and links, totals. Nothing here looks at every patch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BoolArray, Coverage, Link, Registration, UInt8Array
from planner_core.plan_folder.viewer_layers import Layer, UInt16Array
from planner_core.planning.live.draft import Draft, DraftStation
from planner_core.planning.live.figures import times_seen_bytes
from planner_core.planning.live.station_observations import StationObservations
from planner_core.planning.live.tally import Change, CoverageAreas, Tally, coverage, figure_of
from planner_core.planning.live.tripod_positions import TripodPosition

UInt32Array = NDArray[np.uint32]


@dataclass(frozen=True)
class Standing:
    """A draft, what its stations see, and what that adds up to. covered_m2 : for each of `CoverageAreas.all`."""

    draft: Draft
    tally: Tally
    covered_m2: tuple[float, ...]
    links: tuple[Link, ...]

    def observations_of(self, name: str) -> StationObservations:
        """What a station of the draft sees."""
        return self.tally.looks[self.draft.ids.index(name)]


@dataclass(frozen=True)
class Preview:
    """Of a station at `spot`. draft : with it there. patch : (K,), sorted, patches that differ from the draft before.

    times_seen, values : (K,), what they are there, see `planning.live.layers`; values : of the requested layer.
    goals : coverage of each requirement, in the plan's order. links : of the station, to the others in their order.
    """

    spot: TripodPosition
    station: DraftStation
    draft: Draft
    patch: UInt32Array
    times_seen: UInt8Array
    values: UInt16Array
    overall: Coverage
    floors: tuple[Coverage, ...]
    goals: tuple[Coverage, ...]
    covered_m2: float
    own_m2: float
    links: tuple[Link, ...]
    registration: Registration


def differing(
    base: Tally, change: Change, achievable: BoolArray, layer: Layer | None
) -> tuple[UInt32Array, UInt8Array, UInt16Array]:
    """Patches that a change makes different, (K,) sorted, with their new times seen and values of a layer.

    layer : None for `times_seen`, whose values are the times seen.
    """
    patch = change.patch
    counted = achievable[patch]
    was = times_seen_bytes(base.times_met[0, patch], counted)
    now = times_seen_bytes(change.n_met[0], counted)
    differs = was != now
    if layer is None:
        values: UInt16Array = now.astype(np.uint16)
    else:
        values = layer.quantised(figure_of(layer.id, change.best(layer.id)))
        differs |= values != layer.quantised(figure_of(layer.id, base.best(layer.id)[patch]))
    return patch[differs].astype(np.uint32), now[differs], values[differs]


def coverages(
    parts: CoverageAreas, covered_m2: Sequence[float]
) -> tuple[Coverage, tuple[Coverage, ...], tuple[Coverage, ...]]:
    """Coverage of all, of the floors and of the goals, from areas in the order of `CoverageAreas.all`."""
    found = [coverage(part, area_m2) for part, area_m2 in zip(parts.all, covered_m2, strict=True)]
    n_floors = len(parts.floors)
    return found[0], tuple(found[1 : 1 + n_floors]), tuple(found[1 + n_floors :])

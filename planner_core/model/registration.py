"""How a plan's stations register with each other: networks, what they hang on, and what is missing between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class WeakMotion:
    """The small motion of one scan against another that the surface they share holds least.

    direction : unit vector in axes of the scene, along the shift or about the turn; either of its two senses.
    """

    kind: Literal["shift", "turn"]
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class Link:
    """Overlap of two stations. `overlap`: as the requirements measure it, see `OverlapMeasure` and `OverlapOf`.

    `strength`: smallest eigenvalue of the shared surface's point-to-plane normal matrix, scaled to [0, 1]; NaN where
    it was not computed. `weak_motion`: None where it was not computed. `as_set_up`: it counts below the overlap that is
    required, since both stations are scanned and need no margin for setting up.
    """

    a: str
    b: str
    overlap: float
    strength: float
    weak_motion: WeakMotion | None = None
    as_set_up: bool = False

    def counts(self, min_overlap: float, min_strength: float) -> bool:
        """Whether it is good enough to register the scans; one without a strength is judged by its overlap."""
        return self.as_set_up or (self.overlap >= min_overlap and not self.strength < min_strength)


@dataclass(frozen=True)
class RegistrationNetwork:
    """Stations that links join.

    stations, floors : ids, in the order of the plan. bridges : links without which the network falls apart.
    articulations : stations without which the others fall apart.
    """

    stations: tuple[str, ...]
    floors: tuple[str, ...]
    n_links: int
    bridges: tuple[Link, ...]
    articulations: tuple[str, ...]
    bottleneck: Link | None
    """The link that all hangs on: the smallest overlap that some two stations need on their best way to each other.
    None: a single station."""

    @property
    def survives_a_link(self) -> bool:
        """Whether it stays joined when any one link fails; required of three or more stations only."""
        return len(self.stations) < 3 or not self.bridges

    @property
    def two_connected(self) -> bool:
        """Whether the others stay joined when any one station, or any one link, fails."""
        return self.survives_a_link and not self.articulations


@dataclass(frozen=True)
class NetworkGap:
    """Between two networks, as places in `Registration.networks`: the link that overlaps most and yet doesn't count.

    targets_m : places, local, for three targets that both stations of `best` see; empty: none that would hold, or not
    searched for.
    """

    networks: tuple[int, int]
    best: Link
    targets_m: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True)
class FloorNetworks:
    """One floor's stations as links between them, and no way over other floors, join them."""

    floor: str
    networks: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Registration:
    """How the stations hang together by links of at least `threshold` overlap and `min_strength`.

    networks : largest first. floors : in the order of the plan. floor_joins : links that count, between stations of
    different floors. gaps : where a link that doesn't count is listed between two networks; sorted.
    """

    threshold: float
    min_strength: float
    loops: bool
    """Required: every network survives the failure of a link."""
    networks: tuple[RegistrationNetwork, ...]
    floors: tuple[FloorNetworks, ...]
    floor_joins: tuple[Link, ...]
    gaps: tuple[NetworkGap, ...]

    @property
    def connected(self) -> bool:
        """Whether all stations are one network."""
        return len(self.networks) <= 1

    @property
    def met(self) -> bool:
        """Whether the stations are one network and, where that is required, it survives the failure of a link."""
        return self.connected and (not self.loops or all(network.survives_a_link for network in self.networks))

    @property
    def bridges(self) -> tuple[Link, ...]:
        """Those of all networks."""
        return tuple(link for network in self.networks for link in network.bridges)

    @property
    def articulations(self) -> tuple[str, ...]:
        """Those of all networks."""
        return tuple(station for network in self.networks for station in network.articulations)

    def counts(self, link: Link) -> bool:
        """Whether a link is good enough, by what is required here; see `Link.counts`."""
        return link.counts(self.threshold, self.min_strength)

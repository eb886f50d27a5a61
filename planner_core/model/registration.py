"""How a plan's stations register with each other: networks, what they hang on, and what is missing between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, PlainSerializer, computed_field

from planner_core.documents import Number, YesNo, document
from planner_core.model.values import Count, ProbabilityIfKnown, Share, StrengthIfKnown

#: A link holds as set up with this share of the overlap and so many times the risk that limits allow on the marks:
#: docs/method/registration.md has the figures.
SET_UP_SHARE, SET_UP_RISK = 5.0 / 6.0, 3.0


Place = tuple[Number, Number, Number]


def _to_micro(direction: tuple[float, float, float]) -> tuple[float, ...]:
    return tuple(round(part, 6) + 0.0 for part in direction)


@document
@dataclass(frozen=True)
class WeakMotion:
    """The small motion of one scan against another that the surface they share holds least."""

    kind: Literal["shift", "turn"]
    direction: Annotated[tuple[Number, Number, Number], PlainSerializer(_to_micro)]
    """Unit vector in axes of the scene, along the shift or about the turn; either of its two senses."""

    @property
    def by_axes(self) -> str:
        """In words by axes of the scene, as plan.json keeps it: `tilts about 134 degrees from x to y`."""
        x, y, z = self.direction
        if z == 1.0:
            return "slides along the vertical" if self.kind == "shift" else "turns about the vertical"
        named = f"({x:.2f}, {y:.2f}, {z:.2f})"
        if z == 0.0:
            angle_deg = round(math.degrees(math.atan2(y, x))) % 180
            named = {0: "x", 90: "y"}.get(angle_deg, f"{angle_deg} degrees from x to y")
        return f"{'slides along' if self.kind == 'shift' else 'tilts about'} {named}"


@dataclass(frozen=True)
class LinkLimits:
    """What a link needs in order to count; 0: not required. All limits are included."""

    overlap: float = 0.0
    strength: float = 0.0
    probability: float = 0.0
    """That the two scans register."""
    doors_change: bool = False
    """It counts with open doors shut, too."""

    def as_set_up(self) -> LinkLimits:
        """What is left of them where stations stand beside their marks: 5/6 of the overlap, three times the risk."""
        return LinkLimits(
            SET_UP_SHARE * self.overlap,
            self.strength,
            max(0.0, 1.0 - SET_UP_RISK * (1.0 - self.probability)) if self.probability > 0.0 else 0.0,
            self.doors_change,
        )

    def margin(self, overlap: float, strength: float, probability: float) -> float:
        """How far figures of a link are above the limits: the least of their multiples of what is required.

        Of a probability those of the risk: 1 - p is as many times less. NaN: not known, decides nothing. Infinity:
        nothing is required.
        """
        ratios = [math.inf]
        if self.overlap > 0.0:
            ratios.append(overlap / self.overlap)
        if self.strength > 0.0 and not math.isnan(strength):
            ratios.append(strength / self.strength)
        if self.probability > 0.0 and not math.isnan(probability):
            ratios.append((1.0 - self.probability) / (1.0 - probability) if probability < 1.0 else math.inf)
        return min(ratios)


@document
@dataclass(frozen=True)
class Link:
    """Overlap of two stations."""

    a: str
    b: str
    overlap: Share
    """What both see, as a share, measured as `requirements.overlap_measure` and `overlap_of` say."""
    strength: StrengthIfKnown
    """Smallest eigenvalue of the shared surface's point-to-plane normal matrix, scaled to [0, 1]: how well the surface
    holds the two together in its weakest direction. NaN, in documents null, where not computed."""
    weak_motion: WeakMotion | None = None
    """The motion that the shared surface holds least; None where not computed, and in plans of older versions."""
    as_set_up: Annotated[YesNo, Field(exclude_if=lambda value: not value)] = False
    """It counts below what is required: both stations are scanned and need no margin for setting up."""
    probability: ProbabilityIfKnown = math.nan
    """That the two scans register, from `registration.pre_alignment`; NaN, in documents null, where not computed."""
    only_open: Annotated[tuple[str, ...], Field(exclude_if=lambda value: not value)] = ()
    """Ids (GlobalId) of open doors that it needs open during both scans: where one is shut it does not count."""
    only_shut: Annotated[tuple[str, ...], Field(exclude_if=lambda value: not value)] = ()
    """Of a pair that does not count: ids of open doors; it counts where these are shut during both scans."""
    targets_m: Annotated[tuple[Place, ...], Field(alias="targets", exclude_if=lambda value: not value)] = ()
    """Places for three targets that both stations see and that register them: it counts, whatever they have in common.
    Local frame; in documents the scene's."""

    @computed_field(json_schema_extra={"default": ""})  # type: ignore[prop-decorator]
    @property
    def weak_axis(self) -> str:
        """The weak motion in words by axes of the scene; empty where not computed."""
        return "" if self.weak_motion is None else self.weak_motion.by_axes

    def counts(self, limits: LinkLimits) -> bool:
        """Whether it is good enough to register the scans; figures that were not computed decide nothing."""
        return self.as_set_up or bool(self.targets_m) or self.reaches(limits)

    def reaches(self, limits: LinkLimits) -> bool:
        """Whether all that was computed of it reaches the limits."""
        return (
            self.overlap >= limits.overlap
            and not self.strength < limits.strength
            and not self.probability < limits.probability
            and not (limits.doors_change and self.only_open)
        )

    def margin(self, limits: LinkLimits) -> float:
        """See `LinkLimits.margin`; infinity of two that targets register."""
        return math.inf if self.targets_m else limits.margin(self.overlap, self.strength, self.probability)


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
    """The link that all hangs on: the one of least margin that some two stations need on their best way to each other.
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
    """Between two networks, as places in `Registration.networks`: the link that comes nearest to counting.

    targets_m : places, local, for three targets that both stations of `best` see; empty: none that would hold, or not
    searched for.
    """

    networks: tuple[int, int]
    best: Link
    targets_m: tuple[Place, ...] = ()


@document
@dataclass(frozen=True)
class NetworkJoin:
    """Stations that coverage does not need, linked with each other, and what they join."""

    stations: tuple[str, ...]
    n_groups: Count
    """Groups of the other stations that they link; 1: they make their network hold as it is set up."""
    floors: tuple[str, ...]
    """Ids of these groups' floors, in the order of the plan."""


@dataclass(frozen=True)
class FloorNetworks:
    """One floor's stations as links between them, and no way over other floors, join them."""

    floor: str
    networks: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Registration:
    """How the stations are connected by links that reach `limits`.

    networks : largest first. floors : in the order of the plan. floor_joins : links that count, between stations of
    different floors. gaps : where a link that doesn't count is listed between two networks; sorted.
    """

    limits: LinkLimits
    loops: bool
    """Required: every network survives the failure of a link."""
    networks: tuple[RegistrationNetwork, ...]
    floors: tuple[FloorNetworks, ...]
    floor_joins: tuple[Link, ...]
    gaps: tuple[NetworkGap, ...]
    doors_needed: tuple[str, ...] = ()
    """Ids of open doors without which there are more networks, sorted."""
    joins: tuple[NetworkJoin, ...] = ()
    """Stations that are there for the network alone; empty: none, or not worked out."""

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
        return link.counts(self.limits)

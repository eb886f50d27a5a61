"""The client's requirements, and their results."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated

from pydantic import Field

from planner_core.documents import Number, YesNo, document
from planner_core.errors import RequirementError
from planner_core.model.choices import Doors, NetworkKind, OverlapMeasure, OverlapOf, PreAlignment, Scope, one_of
from planner_core.model.registration import LinkLimits
from planner_core.model.scans import Scanner
from planner_core.model.values import (
    Corner,
    NetworkWord,
    OverlapMeasureWord,
    OverlapOfWord,
    PreAlignmentWord,
    Required,
    ScopeWord,
    SeenFrom,
    Text,
)


@document
@dataclass(frozen=True)
class PointLimits:
    """Limits on how surfaces are seen; None: none. All limits are included."""

    spacing_m: Number | None = None
    """Greatest distance between neighbouring points, LOD."""
    range_m: Number | None = None
    incidence_rad: Number | None = None
    """Greatest angle between beam and surface normal."""
    noise_m: Number | None = None
    """Greatest one sigma of range noise, LOA."""

    def __post_init__(self) -> None:
        for name, limit in ((each.name, getattr(self, each.name)) for each in fields(self)):
            if limit is not None and not limit >= 0:
                raise RequirementError(f"{name}: got {limit}, expected 0 or more; leave it out for none")


@document
@dataclass(frozen=True)
class PartRequirement:
    """Requirement of one part of the building. The part is what `floors`, `classes`, `zone` and `heights_m` all name.

    A part that is one whole floor takes the place of the general one for that floor; any other part is required
    besides. A patch lies where its centroid lies.

    """

    name: str
    coverage: Required = 0.95
    """Fraction of the part's area that is achievable by `limits` and `seen_from`; 0: of the part nothing is required,
    also where other requirements are about it: it is an obstacle only."""
    limits: Annotated[PointLimits, Field(alias="asked")] = PointLimits()
    seen_from: SeenFrom = 1
    floors: tuple[str, ...] = ()
    """Ids or names; empty: all planned."""
    classes: tuple[str, ...] = ()
    """Patterns (`*`, `?`) of element classes or names, such as `IfcWall*`; empty: all."""
    zone: tuple[Corner, ...] = ()
    """Corners (x, y) of a polygon in plan, scene coordinates; empty: everywhere."""
    heights_m: Annotated[Corner | None, Field(alias="heights")] = None
    """Lowest and highest z, scene coordinates; None: all."""

    def __post_init__(self) -> None:
        what = f"requirement {self.name!r}: "
        if not self.name.strip():
            raise RequirementError("requirement: got one without a name, expected one; name it")
        if not 0.0 <= self.coverage <= 1.0:
            raise RequirementError(f"{what}coverage: got {self.coverage}, expected 0 to 1; e.g. 0.95, or 0 for nothing")
        _check_seen_from(self.seen_from, what)
        if self.zone and not (len(self.zone) >= 3 and all(math.isfinite(x) and math.isfinite(y) for x, y in self.zone)):
            raise RequirementError(
                f"{what}zone: got {len(self.zone)} corners, expected three or more, all finite; give (x, y) in metres"
            )
        if self.heights_m is not None and not -math.inf < self.heights_m[0] <= self.heights_m[1] < math.inf:
            raise RequirementError(
                f"{what}heights: got {self.heights_m[0]} to {self.heights_m[1]} m, expected the lower one first"
            )


def _check_seen_from(seen_from: int, what: str = "") -> None:
    if seen_from < 1:
        raise RequirementError(f"{what}seen from: got {seen_from} stations, expected 1 or more; leave it out for 1")


@document
@dataclass(frozen=True)
class Requirements:
    """The client's requirements. What counts as covered meets `limits` from at least `seen_from` stations; achievable
    is what candidates can.
    """

    coverage: Required = 0.95
    """Share of the achievable area, overall and on each floor."""
    overlap: Required = 0.0
    """Least overlap of a link that counts, as a contract may name it; 0: none."""
    overlap_measure: OverlapMeasureWord = OverlapMeasure.SMALLER_SHARE
    """What both see, as a share of what the one sees that sees more, or (jaccard) of what either sees."""
    overlap_of: OverlapOfWord = OverlapOf.ALL_SEEN
    """Which surface overlap is counted on: all that a station sees, or where it meets the limits required of all."""
    floors: tuple[str, ...] = ()
    """Ids or names of the floors to plan; empty: all."""
    limits: Annotated[PointLimits, Field(alias="asked")] = PointLimits()
    seen_from: SeenFrom = 1
    reflectivity: Number = 0.8
    """Of the surfaces, for range noise."""
    network: NetworkWord = NetworkKind.CONNECTED
    """How links that count must connect the stations, as far as candidates can be linked at all."""
    min_strength: Number = 0.01
    """Least strength of a link that counts: all six motions are held, the worst of them ten times as badly as if all
    were held alike. See docs/method/registration.md."""
    min_probability: Number = 0.99
    """Least probability with which the scans of a link that counts register; 0: none."""
    pre_alignment: PreAlignmentWord | None = None
    """Where registration starts; None: as the scanner has it."""
    doors_change: YesNo = False
    """Whether links have to hold with open doors shut, too, during the scan of either station or of both."""
    targets: YesNo | None = None
    """Whether three targets that both stations see join what no common surface does; None: where `--join outside` has
    stations outdoors, along whose facades scans slide."""
    scope: ScopeWord = Scope.ALL
    """What of the building counts, and where stations stand."""
    deliverable: Text | None = None
    """Where limits and overlap were taken from that the client did not give, by name; they count, not it."""
    parts: tuple[PartRequirement, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.coverage) and 0.0 < self.coverage <= 1.0):
            raise RequirementError(
                f"coverage: got {self.coverage:g}, expected a fraction above 0 and at most 1; give e.g. 0.95 (95 %)"
            )
        if not (math.isfinite(self.overlap) and 0.0 <= self.overlap <= 1.0):
            raise RequirementError(
                f"overlap: got {self.overlap:g}, expected a fraction from 0 to 1; give e.g. 0.3 (30 %)"
            )
        if not (math.isfinite(self.min_probability) and 0.0 <= self.min_probability < 1.0):
            raise RequirementError(
                f"probability of links: got {self.min_probability:g}, expected a fraction from 0 to below 1; give e.g. "
                "0.99 (99 %)"
            )
        _check_seen_from(self.seen_from)
        if self.pre_alignment is not None:
            object.__setattr__(self, "pre_alignment", one_of(PreAlignment, self.pre_alignment, "pre_alignment"))
        object.__setattr__(self, "network", one_of(NetworkKind, self.network, "network"))
        object.__setattr__(self, "scope", one_of(Scope, self.scope, "scope"))
        measure = one_of(OverlapMeasure, self.overlap_measure, "overlap_measure")
        object.__setattr__(self, "overlap_measure", measure)
        object.__setattr__(self, "overlap_of", one_of(OverlapOf, self.overlap_of, "overlap_of"))
        if not 0.0 < self.reflectivity <= 1.0:
            raise RequirementError(
                f"reflectivity: got {self.reflectivity}, expected above 0 and at most 1; a white wall has 0.8"
            )
        names = [part.name for part in self.parts]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise RequirementError(f"requirement {twice[0]!r}: got it twice, expected each name once; rename one")

    @property
    def link_limits(self) -> LinkLimits:
        """What a link needs in order to count."""
        return LinkLimits(self.overlap, self.min_strength, self.min_probability, self.doors_change)

    def joins_by_targets(self, doors: str) -> bool:
        """Whether targets join groups; doors : as the scene is loaded."""
        return doors == Doors.OUTSIDE if self.targets is None else self.targets

    def start_of(self, scanner: Scanner) -> PreAlignment:
        """Where registration of a scanner's scans starts."""
        return self.pre_alignment or scanner.pre_alignment

    @property
    def asks_links(self) -> bool:
        """Whether stations have to be linked, and links need anything that a pair may lack."""
        return self.network != NetworkKind.NONE and (self.overlap > 0.0 or self.min_probability > 0.0)

    @property
    def limits_noise(self) -> bool:
        """Whether a requirement of all or of a part limits noise."""
        return any(limits.noise_m is not None for limits in (self.limits, *(part.limits for part in self.parts)))


@dataclass(frozen=True)
class PartResult:
    """What became of one requirement: an overall one, a floor's, or a part's."""

    name: str
    required: float
    """Fraction of achievable area."""
    achievable_area_m2: float
    covered_area_m2: float
    total_area_m2: float
    seen_from: int = 1
    limits: PointLimits = PointLimits()
    as_set_up: float | None = None
    """Fraction of achievable area that 99 of 100 set-ups within the tolerance cover at least; None: not computed."""

    @property
    def fraction_of_achievable(self) -> float:
        """Covered / achievable; 1 where nothing is achievable."""
        return self.covered_area_m2 / self.achievable_area_m2 if self.achievable_area_m2 > 0 else 1.0

    @property
    def met(self) -> bool:
        """Whether the fraction reaches what is required, but for rounding in the last places."""
        return self.fraction_of_achievable >= self.required - 1e-9

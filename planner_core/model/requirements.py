"""What the client asked, and what became of it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from planner_core.errors import RequirementError

#: What `Requirements.network` may be.
NETWORKS = ("joined", "loops", "none")


@dataclass(frozen=True)
class Asked:
    """What a client asks of the points on a surface; None: nothing. All limits are included."""

    spacing_m: float | None = None
    """Greatest distance between neighbouring points, LOD."""
    range_m: float | None = None
    incidence_rad: float | None = None
    """Greatest angle between beam and surface normal."""
    noise_m: float | None = None
    """Greatest one sigma of range noise, LOA."""

    def __post_init__(self) -> None:
        for name, limit in ((each.name, getattr(self, each.name)) for each in fields(self)):
            if limit is not None and not limit >= 0:
                raise RequirementError(f"{name}: got {limit}, expected 0 or more; leave it out where none is asked")


@dataclass(frozen=True)
class PartRequirement:
    """What is asked of one part of the building. The part is what `floors`, `classes` and `zone` all name.

    floors : ids or names; empty: all planned. classes : patterns (`*`, `?`) of element classes or names, such as
    `IfcWall*`; empty: all. zone : corners (x, y) of a polygon in plan, SCENE frame, metres; empty: everywhere.
    heights_m : (lowest, highest) z in the scene frame; None: all.
    """

    name: str
    coverage: float = 0.95
    """Fraction of the part's area that is achievable by `asked` and `seen_from`."""
    asked: Asked = field(default_factory=Asked)
    seen_from: int = 1
    """Stations that each meet `asked` on a surface for it to count."""
    floors: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()
    zone: tuple[tuple[float, float], ...] = ()
    heights_m: tuple[float, float] | None = None


@dataclass(frozen=True)
class Requirements:
    """What the client asked. `coverage` is a fraction of the achievable area, overall and on each floor.

    What counts as covered meets `asked` from at least `seen_from` stations; achievable is what candidates can.
    """

    coverage: float = 0.95
    overlap: float = 0.30
    floors: tuple[str, ...] = ()
    """Ids or names of the floors to plan; empty: all."""
    asked: Asked = field(default_factory=Asked)
    seen_from: int = 1
    reflectivity: float = 0.8
    """Of the surfaces, for range noise."""
    parts: tuple[PartRequirement, ...] = ()
    """Besides what is asked of all."""
    network: str = "joined"
    """How stations hang together by links of at least `overlap` and `min_strength`, as far as candidates can: `joined`;
    `loops`: also when any one link fails; `none`: not asked."""
    min_strength: float = 0.01
    """Least strength of a link that counts: all six motions are held, the worst of them ten times as badly as if all
    were held alike. See docs/method/registration.md."""


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
    asked: Asked = field(default_factory=Asked)

    @property
    def fraction_of_achievable(self) -> float:
        """Covered / achievable; 1 where nothing is achievable."""
        return self.covered_area_m2 / self.achievable_area_m2 if self.achievable_area_m2 > 0 else 1.0

    @property
    def met(self) -> bool:
        """Whether the fraction reaches what is required, but for rounding in the last places."""
        return self.fraction_of_achievable >= self.required - 1e-9

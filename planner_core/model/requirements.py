"""What the client asked."""

from __future__ import annotations

from dataclasses import dataclass, fields

from planner_core.errors import RequirementError


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
        for name, limit in ((field.name, getattr(self, field.name)) for field in fields(self)):
            if limit is not None and not limit >= 0:
                raise RequirementError(f"{name}: got {limit}, expected 0 or more; leave it out where none is asked")


@dataclass(frozen=True)
class Requirements:
    """What the client asked. `coverage` is a fraction of the achievable area, overall and on each floor."""

    coverage: float = 0.95
    overlap: float = 0.30
    floors: tuple[str, ...] = ()
    """Ids or names of the floors to plan; empty: all."""

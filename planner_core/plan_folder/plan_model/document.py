"""plan.json, whole.

Keys keep their meaning and are never removed under this schema. Keys that came after the first version have a default,
which is what older plans say by leaving them out.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from planner_core.documents import Document, Number, Whole, to_document
from planner_core.errors import PlanFolderError
from planner_core.model import IndependentCheck, Scanner, Site
from planner_core.model.values import Share
from planner_core.plan_folder.plan_model.given import (
    PlannedParameters,
    PlannedRequirements,
    SceneSection,
    SourceSection,
)
from planner_core.plan_folder.plan_model.results import (
    CoverageSection,
    FieldTimeSection,
    FloorSection,
    OptimalitySection,
    RegistrationSection,
    RouteSection,
    ScopeSection,
    StationSection,
    UnreachableSection,
    UnseenSection,
    WhySection,
)

SCHEMA = "tlsplan/plan/1"
"""Grows by new keys only; a change of meaning gets a new number."""


def _own_ids(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    ids = [row.id for row in rows]
    for place, name in enumerate(ids):
        if name in ids[:place]:
            raise PlanFolderError(
                f"got the id {name!r} of [{place}] a second time, expected one of its own; plan again"
            )
    return rows


class PlanDocument(Document):
    """plan.json of tlsplan, schema tlsplan/plan/1. Lengths are metres, areas square metres, shares lie in [0, 1].
    Positions and elevations are in the scene frame: metres, z up, the source's own origin. A number that is unknown is
    null. Keys are never removed or given another meaning under this schema; new ones may come, so readers ignore keys
    they do not know. Keys with a default may be missing, as in plans of older versions.
    """

    schema_: Annotated[Literal["tlsplan/plan/1"], Field(alias="schema")]
    """Name and number of this contract."""
    scene: SceneSection
    source: SourceSection | None = None
    """null for scenes from memory."""
    scanner: Scanner
    requirements: PlannedRequirements
    method: str
    method_options: dict[str, str] = Field({})
    """Options of the method that the user set, by name."""
    seed: Whole
    settings: PlannedParameters
    site: Annotated[Site, Field(json_schema_extra={"default": to_document(Site())})] = Site()
    floors: Annotated[tuple[FloorSection, ...], AfterValidator(_own_ids)]
    """Lowest first."""
    stations: Annotated[tuple[StationSection, ...], AfterValidator(_own_ids)]
    """In the order to visit."""
    scope: ScopeSection | None = None
    """null in plans of older versions, which are about all of the building."""
    coverage: CoverageSection
    coverage_curve: tuple[Share | None, ...]
    """Covered share of the scannable area after 1, 2, ... stations in the order of choice."""
    optimality: OptimalitySection
    registration: RegistrationSection
    route: RouteSection | None = None
    """null where none was computed."""
    field_time: FieldTimeSection | None = None
    """null where no route was computed."""
    unreachable: Annotated[tuple[UnreachableSection, ...], Field(alias="sealed")] = ()
    unseen: tuple[UnseenSection, ...]
    """By element and floor."""
    why: WhySection | None = None
    judge: IndependentCheck | None = None
    """null where not required, and in plans of older versions."""
    warnings: tuple[str, ...]
    """One line each, for the user."""
    device: str
    """Engine and device that scanned. May differ between equal plans."""
    versions: dict[str, str]
    """Packages at work. May differ between equal plans."""
    timings_s: dict[str, Number]
    """Seconds per stage. May differ between equal plans."""

"""The walk of a plan as polylines: plan.json's legs, from stop to stop, on the ground. Scene frame, metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner_core.model import FloatArray
from planner_core.plan_folder.plan_source import PlanSource


@dataclass(frozen=True, eq=False)
class RouteLeg:
    """A leg of the walk. from_id, to_id : stations; empty for where the walk begins and ends.

    points_m : (M, 3) float64, its corners; M is 0 where no way inside the model leads there. length_m : NaN there.
    floors : ids of those it passes, in their order.
    """

    from_id: str
    to_id: str
    points_m: FloatArray
    length_m: float
    floors: tuple[str, ...]

    @property
    def walkable(self) -> bool:
        """Whether there is a way."""
        return bool(self.points_m.shape[0] >= 2)

    @property
    def title(self) -> str:
        """`S001 to S002`."""
        return f"{self.from_id or 'start'} to {self.to_id or 'end'}"


def ways_of(plan: PlanSource) -> tuple[RouteLeg, ...]:
    """Return the legs of the route in their order; none where no route was planned."""
    route = plan.document["route"]
    if route is None:
        return ()
    return tuple(
        RouteLeg(
            from_id=leg["from"] or "",
            to_id=leg["to"] or "",
            points_m=np.array(leg["points"], dtype=np.float64).reshape(-1, 3),
            length_m=math.nan if leg["length_m"] is None else leg["length_m"],
            floors=tuple(leg["floors"]),
        )
        for leg in route["legs"]
    )


def route_remarks(ways: tuple[RouteLeg, ...]) -> tuple[str, ...]:
    """Say what of the walk is missing, a line each."""
    if not ways:
        return ("the plan has no route, so none is written",)
    broken = [way.title for way in ways if not way.walkable]
    return (f"no path inside the model leads from {', '.join(broken)}",) if broken else ()

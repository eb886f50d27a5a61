"""Where a review stands in `review.usda`: prims and attributes, see docs/formats/review.md.

A station's edit is an opinion on its own prim, so that every USD viewer shows it moved, gone or new. All else is below
/Plan/Review. What others wrote into the layer stays as it is, wherever it does not say the same thing.
"""

from __future__ import annotations

from typing import Any

from planner_core.errors import PlanFolderError
from planner_core.export.sdf_authoring import Layer, Tf, new_layer

SCHEMA = "tlsplan/review/1"

STATIONS = "/Plan/Stations"
REVIEW = "/Plan/Review"
COMMENTS, ZONES, FORBIDDEN, PICKS, VERDICTS, SIGN_OFF = (
    f"{REVIEW}/{name}" for name in ("Comments", "Zones", "Forbidden", "GroundPicks", "Verdicts", "SignOff")
)

PREFIX = "tlsplan:review:"
ADDED = f"{PREFIX}added"
LOCKED = f"{PREFIX}locked"
STALE = f"{PREFIX}stale"
"""Marks what the review hides because it shows the plan before the change: clouds, links, routes."""

TRANSFORM, ORDER = "xformOp:transform", "xformOpOrder"
HEIGHT, FLOOR = "tlsplan:instrumentHeight", "tlsplan:floorId"
FIGURES = ("tlsplan:coveredArea", "tlsplan:ownArea")


def layer_of(text: str, told: str) -> Layer:
    """Parse the text of a layer.

    Raises
    ------
    PlanFolderError
        It is no USD; `told` names the file.
    """
    layer = new_layer()
    try:
        read = layer.ImportFromString(text)
    except Tf.ErrorException as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        raise _no_layer(told, lines[-1] if lines else "") from error
    if not read:
        raise _no_layer(told, "")
    return layer


def _no_layer(told: str, problem: str) -> PlanFolderError:
    return PlanFolderError(
        f"{told}: can't be read as USD ({problem[:300]}), expected the review layer of a plan, and nothing is written "
        "over it; repair it, or move it away to begin a new review"
    )


def value_of(prim: Any, name: str) -> Any:
    """Value of an attribute spec; None where the prim has none, or one without a value."""
    attribute = prim.attributes.get(name)
    return None if attribute is None else attribute.default

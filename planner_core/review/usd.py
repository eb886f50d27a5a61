"""Where a review stands in `review.usda`: prims and attributes, see docs/formats/review.md.

A station's edit is an opinion on its own prim, so that every USD viewer shows it moved, gone or new. All else is below
/Plan/Review. What others wrote into the layer stays as it is, wherever it does not say the same thing.
"""

from __future__ import annotations

import re
from typing import Any

from planner_core.errors import PlanFolderError
from planner_core.plan_folder.sdf_authoring import Layer, Tf, new_layer

SCHEMA = "tlsplan/review/1"

STATIONS = "/Plan/Stations"
REVIEW = "/Plan/Review"
COMMENTS, ZONES, FORBIDDEN, PICKS, ENTRANCES, DOORS, VERDICTS, PROGRESS, SIGN_OFF = (
    f"{REVIEW}/{name}"
    for name in (
        "Comments",
        "Zones",
        "Forbidden",
        "GroundPicks",
        "Entrances",
        "Doors",
        "Verdicts",
        "Progress",
        "SignOff",
    )
)

PREFIX = "tlsplan:review:"
ADDED = f"{PREFIX}added"
LOCKED = f"{PREFIX}locked"
STALE = f"{PREFIX}stale"
"""Marks what the review hides because it shows the plan before the change: clouds, links, routes."""

# A message of the parser: its place in the text, then the words, then a prim, as far as there is one.
_AT = re.compile(r":(\d+):\d+: (.*?)(?: in <[^>]*>)?$", re.DOTALL)

_MOST_DEEP = 200
#: Brackets that open and close; and all in which they count for nothing: texts, assets, comments.
_BRACKETS = re.compile(
    r"""([\[({])|([\])}])
    |\"\"\"(?:\\.|[^\\])*?(?:\"\"\"|\Z)|'''(?:\\.|[^\\])*?(?:'''|\Z)|"(?:\\.|[^"\\\n])*"?|'(?:\\.|[^'\\\n])*'?
    |@@@.*?(?:@@@|\Z)|@[^@\n]*@?|\#[^\n]*|//[^\n]*|/\*.*?(?:\*/|\Z)""",
    re.DOTALL | re.VERBOSE,
)

TRANSFORM, ORDER = "xformOp:transform", "xformOpOrder"
HEIGHT, FLOOR = "tlsplan:instrumentHeight", "tlsplan:floorId"
FIGURES = ("tlsplan:coveredArea", "tlsplan:ownArea")


def layer_of(text: str, name: str) -> Layer:
    """Parse the text of a layer.

    Raises
    ------
    PlanFolderError
        It is no USD; `name` is the file's.
    """
    if _depth(text) > _MOST_DEEP:
        raise _no_layer(name, f"it has more than {_MOST_DEEP} brackets inside each other")
    layer = new_layer()
    try:
        read = layer.ImportFromString(text)
    except Tf.ErrorException as error:
        raise _no_layer(name, _problem(text, error)) from error
    if not read:
        raise _no_layer(name, "")
    return layer


def _depth(text: str) -> int:
    """How many brackets are open at once: the parser's stack overflows, and with it goes the process."""
    depth = deepest = 0
    for found in _BRACKETS.finditer(text):
        if found[1]:
            depth += 1
            deepest = max(deepest, depth)
        elif found[2]:
            depth -= 1
    return deepest


def _problem(text: str, error: Tf.ErrorException) -> str:
    """Return what the parser complains of, for people: in which line, and without the names of its own insides."""
    if not text.startswith("#usda"):
        return "it does not begin with #usda"
    matches = [_AT.match(each.commentary.strip()) for each in error.args]
    places = [found for found in matches if found is not None]
    if not places:
        return ""
    line, words = places[-1][1], " ".join(places[-1][2].split())
    expected, _, rest = words.rpartition(" at '")
    if rest == "'":
        return f"line {line}: it breaks off"
    if expected.startswith("parse error matching"):  # what follows are names of the parser's own
        return f"line {line}: '{rest[:80]} is not understood"
    return f"line {line}: {words[:200]}"


def _no_layer(name: str, problem: str) -> PlanFolderError:
    return damaged(name, problem or "it can't be read as USD")


def damaged(name: str, problem: str) -> PlanFolderError:
    """Return the error of a review that can't be read: which file, what is wrong with it, and the way out."""
    return PlanFolderError(
        f"{name}: the review is damaged ({problem}), expected a layer as tlsplan writes it; repair it, or rename it to "
        "begin a new review: nothing is deleted, and nothing written over it"
    )


def value_of(prim: Any, name: str) -> Any:
    """Value of an attribute spec; None where the prim has none, or one without a value."""
    attribute = prim.attributes.get(name)
    return None if attribute is None else attribute.default

"""Links between stations on a floor's map: by width and colour, how well two scans hold together. Plan -> marks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner_core.model import FloatArray, Link, Plan
from planner_core.plan_folder import palette
from planner_core.plan_folder.sheet import LegendLine

#: A link this many times as strong as asked for is drawn as strong.
STRONG_TIMES = 4.0
#: Links of less than this share of the overlap asked for are not drawn: they would hide the others.
_LEAST_SHARE = 0.5

#: (name, colour, line width, dashes) of a link's class, weakest first; told apart in grey print by width and dashes.
LINK_CLASSES: tuple[LegendLine, ...] = (
    ("too little to count", (0.55, 0.57, 0.59), 1.1, (0, (3, 3))),
    ("link", palette.LINK, 1.8, "-"),
    ("strong link", palette.LINK, 3.6, "-"),
)


def link_class(link: Link, plan: Plan) -> int | None:
    """Index into `LINK_CLASSES`; None: not worth drawing. A strength not computed is neither weak nor strong."""
    asked = plan.settings.requirements
    if link.overlap < _LEAST_SHARE * asked.overlap:
        return None
    if link.overlap < asked.overlap or link.strength < asked.min_strength:
        return 0
    strong = not math.isnan(link.strength) and link.strength >= STRONG_TIMES * asked.min_strength
    return 2 if strong else 1


def link_legend(plan: Plan) -> tuple[LegendLine, ...]:
    """What the lines of a map of links are."""
    asked = plan.settings.requirements
    few, enough, strong = LINK_CLASSES
    share = f"{100 * asked.overlap:g} %"
    return (
        (f"overlap of {share} or more, all motions held", *enough[1:]),
        (f"held {STRONG_TIMES:g} times the required strength", *strong[1:]),
        ("too little to count", *few[1:]),
    )


def draw_links(axes: Any, plan: Plan, floor_id: str) -> None:
    """Draw the links among a floor's stations, the best on top, and name stations of other floors linked to them."""
    here = {station.id: station for station in plan.stations if station.floor == floor_id}
    classes = [link_class(link, plan) for link in plan.links]
    for kind, (_, colour, width, dashes) in enumerate(LINK_CLASSES):
        for link, found in zip(plan.links, classes, strict=True):
            if found == kind and link.a in here and link.b in here:
                ends = np.stack([here[link.a].position_m[:2], here[link.b].position_m[:2]])
                axes.plot(*ends.T, color="white", linewidth=width + 2.2, alpha=0.8, zorder=3 + 0.1 * kind)
                axes.plot(*ends.T, color=colour, linewidth=width, linestyle=dashes, zorder=3.05 + 0.1 * kind)
    number = {station.id: station.order for station in plan.stations}
    counting = [link for link, kind in zip(plan.links, classes, strict=True) if kind is not None and kind > 0]
    for name, station in here.items():
        linked = [(link.b if link.a == name else link.a) for link in counting if name in (link.a, link.b)]
        others = sorted(number[other] for other in linked if other not in here)
        if others:
            _name_others(axes, station.position_m[:2], others)


def _name_others(axes: Any, at: FloatArray, numbers: list[int]) -> None:
    """Say which stations of other floors one is linked to."""
    more = f" +{len(numbers) - 3}" if len(numbers) > 3 else ""
    text = "↕ " + ", ".join(str(number) for number in numbers[:3]) + more
    box = {"facecolor": "white", "edgecolor": palette.LINK, "linewidth": 0.8, "alpha": 0.9, "pad": 2.0}
    axes.annotate(text, at, fontsize=10, color=palette.INK, bbox=box, zorder=4.6, va="center",
                  textcoords="offset points", xytext=(13, 10))  # fmt: skip

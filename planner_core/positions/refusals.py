"""Causes for which no tripod stands at a position, and what helps where none stands anywhere.

Input how many positions were refused, by cause (`RefusalTally`), output a phrase for the user. A position counts for
the first cause that it meets: tests of the place come before what the site rules out, so that a tripod could stand at
the latter.
"""

from __future__ import annotations

from planner_core.model import Floor, InstrumentHeights

NO_GROUND = "no ground of this floor below"
TOO_LOW = "too little headroom"
BLOCKED = "something between sensor and ground"
UNEVEN = "uneven or no ground around"
TOO_CLOSE = "too close to something"
OUTSIDE = "outside the building"
IN_KEEP_OUT = "in a keep-out"
FORBIDDEN = "at a forbidden position"
OUT_OF_SCOPE = "out of scope"
UNREACHABLE = "not reachable on foot"

#: What the site rules out of the positions at which a tripod could stand.
_OF_SITE = {
    IN_KEEP_OUT: "leave some of the floor out of the keep-outs",
    FORBIDDEN: "give forbidden positions a smaller radius (--forbid)",
    OUT_OF_SCOPE: "plan the whole model (--scope all)",
    UNREACHABLE: "give an entrance on the ground there (--entrance)",
}
#: What a place lacks. Walls around a plane are counted by horizontal beams, a roof over slabs by vertical ones.
_OF_PLACE = {
    NO_GROUND: "the ground lies between the points of the grid: use a finer grid (--grid)",
    TOO_LOW: "give a lower instrument height (--height)",
    BLOCKED: "elements fill the space above the ground: check that they do not lie in each other, or leave a class of "
    "them out (--leave-out)",
    UNEVEN: "the ground is narrower than a tripod, or in steps: load the file that has the slabs, or mark a larger "
    "surface as ground (docs/howto/pick-ground.md)",
    TOO_CLOSE: "give less clearance (--clearance), or a finer grid (--grid)",
}
_NOT_ENCLOSED = "walls enclose nothing there: load the file that has all walls of the floor"
_IN_THE_OPEN = "it lies under open sky beside ground under a roof: plan the outside (--scope exterior)"


def refusals_in_words(rejected: dict[str, int], floors: list[Floor], heights: InstrumentHeights | None = None) -> str:
    """Each cause with its number of positions, most first, and what helps against the one that decides.

    It is the largest cause of the site's, where a tripod could stand, else the largest of the place's. Points of a grid
    beside the floor have no ground below: that decides only where it is the only cause. Above what tripods reach, a
    height that was given is the first thing to change.
    """
    largest_first = sorted(rejected, key=lambda cause: (cause == NO_GROUND, -rejected[cause]))
    has_plane = any(floor.origin != "slab" and floor.plane_m.size for floor in floors)
    remedies = {**_OF_SITE, **_OF_PLACE, OUTSIDE: _NOT_ENCLOSED if has_plane else _IN_THE_OPEN}
    of_site = [cause for cause in largest_first if cause in _OF_SITE]
    deciding = (of_site or largest_first or [NO_GROUND])[0]
    n_free = sum(rejected[cause] for cause in of_site)
    where = f"of {n_free} where a tripod could stand, {rejected[deciding]} are {deciding}" if of_site else deciding
    counts = ", ".join(f"{cause}: {rejected[cause]}" for cause in largest_first)
    remedy = remedies[deciding]
    if heights is not None and not of_site and heights.is_ordered and heights.fixed_m[0] > heights.high_m:
        remedy = (
            f"give a lower instrument height (--height): {heights.fixed_m[0]:g} m may be above the ceiling, and "
            f"tripods of this scanner stand at {heights.low_m:g} to {heights.high_m:g} m"
        )
    return f"({counts}); {where}: {remedy}"

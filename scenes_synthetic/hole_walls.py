"""The paper's scene for variable height (its Fig. 17): a court whose four walls have a hole each, at another height.

Four outer walls, 8 m apart, stand round four inner ones, 2 m apart and 0.6 m thick. The holes are so low for their
depth that only a station about as high as a hole sees the outer wall through it: from the middle of the court, one that
is 0.325 m higher or lower sees nothing of it. The paper has "four outer walls and four inner walls with one hole per
wall"; we put the holes into the inner ones, so that no beam leaves the scene.
"""

from __future__ import annotations

from dataclasses import replace

from scenes_synthetic.building import Opening, slab, wall
from scenes_synthetic.model import KnownView, Level, Part, Room, SyntheticScene, assemble

_HEIGHT_M = 2.7
_OUTER_M, _COURT_M = 4.0, 1.0
"""Half the distance of opposite walls."""
_THICK_M = 0.6
_WALL_M = _SLAB_M = 0.2
_HOLE_WIDTH_M, _HOLE_HEIGHT_M = 0.6, 0.15
#: Height of the middle of each hole above the floor, by side.
HOLES_M = {"south": 0.6, "east": 1.1, "north": 1.6, "west": 2.1}
#: Heights of the stations in the middle of the court whose views are known: at a hole, beside one, between two.
HEIGHTS_M = (0.6, 0.7, 1.1, 1.35, 1.6, 1.85, 2.1, 2.3)


def build(*, seed: int = 0) -> SyntheticScene:
    """Generate the scene. Nothing is left to chance, so the seed is unused."""
    del seed
    far, top = _OUTER_M + _WALL_M, _HEIGHT_M
    parts = [
        slab("Floor", 0, (-far, -far, -_SLAB_M), (far, far, 0.0), lowest=True),
        slab("Ceiling", 0, (-far, -far, top), (far, far, top + _SLAB_M), lowest=False),
        *_walls("Outer", _OUTER_M, _WALL_M),
        *_walls("Inner", _COURT_M, _THICK_M, holes=True),
    ]
    found = assemble(
        "hole-walls",
        levels=[Level("Ground floor", 0.0)],
        rooms=[
            Room("Court", 0, _square(_COURT_M), 0.0, top),
            Room("Ring", 0, _square(_OUTER_M), 0.0, top, islands_m=(_square(_COURT_M + _THICK_M)[::-1],)),
        ],
        parts=parts,
        extents_m=[(-far, -far, -_SLAB_M), (far, far, top + _SLAB_M)],
    )
    views = tuple(KnownView((0.0, 0.0, z), _seen_from_the_middle(z)) for z in HEIGHTS_M)
    return replace(found, truth=replace(found.truth, views=views))


def _square(half_m: float) -> tuple[tuple[float, float], ...]:
    return ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))


def _walls(ring: str, inside_m: float, thick_m: float, *, holes: bool = False) -> list[Part]:
    """Four walls round a square; those in the south and north reach over the corners."""
    low, high, top = inside_m, inside_m + thick_m, _HEIGHT_M
    boxes = {
        "south": ((-high, -high, 0.0), (high, -low, top)),
        "east": ((low, -low, 0.0), (high, low, top)),
        "north": ((-high, low, 0.0), (high, high, top)),
        "west": ((-high, -low, 0.0), (-low, low, top)),
    }
    parts = []
    for side, (low_m, high_m) in boxes.items():
        sill = HOLES_M[side] - _HOLE_HEIGHT_M / 2
        hole = Opening(f"Hole {side}", -_HOLE_WIDTH_M / 2, _HOLE_WIDTH_M, _HOLE_HEIGHT_M, sill)
        parts.append(wall(f"{ring} wall {side}", 0, low_m, high_m, [hole] if holes else []))
    return parts


def _seen_from_the_middle(z_m: float) -> dict[str, float]:
    """Areas by part that a station in the middle of the court sees: similar triangles through each hole."""
    court = 2 * _COURT_M
    seen = {"Floor": court**2, "Ceiling": court**2}
    for side, middle in HOLES_M.items():
        # By symmetry, let the hole lie below the station: `up` is how far its upper edge does, `down` its lower one.
        up = abs(z_m - middle) - _HOLE_HEIGHT_M / 2
        down = up + _HOLE_HEIGHT_M
        face = court * _HEIGHT_M - _HOLE_WIDTH_M * _HOLE_HEIGHT_M
        seen[f"Inner wall {side}"] = face + _reveals_m2(up, down)
        beyond = _beyond_m2(up, down)
        if beyond > 0:
            seen[f"Outer wall {side}"] = beyond
    return seen


def _beyond_m2(up: float, down: float) -> float:
    """Area of the outer wall: a rectangle bounded by the hole's nearer upper and farther lower and side edges."""
    near, far = _COURT_M, _COURT_M + _THICK_M
    upper = up / near if up > 0 else up / far  # slopes downwards; above the station's height, the far edge bounds
    lower = down / far
    return max(0.0, lower - upper) * _OUTER_M * _HOLE_WIDTH_M * _OUTER_M / far


def _reveals_m2(up: float, down: float) -> float:
    """Area seen inside the hole: its bottom and both sides, and its top where the station is not above it."""
    near, far = _COURT_M, _COURT_M + _THICK_M
    if up <= 0:
        return 2 * _THICK_M * (_HOLE_WIDTH_M + _HOLE_HEIGHT_M)
    # The near upper edge hides what is beyond `reach`, where the line over it meets the bottom.
    reach = min(far, near * down / up)
    sides = down * (reach - near) - up / near * (reach**2 - near**2) / 2
    return _HOLE_WIDTH_M * (reach - near) + 2 * sides

"""Buildings that are generated rather than modelled: for the demo, and for tests that need to know the truth.

`names()` lists them, `build(name)` generates one, `write(scene, path)` saves it as IFC, OBJ, PLY, STL, GLB or USD.
Same name and seed, same bytes.
"""

from __future__ import annotations

from collections.abc import Callable

from scenes_synthetic import basement, copies, hard, hole_walls, house, office, puzzles, rooms, school
from scenes_synthetic.copies import on_map
from scenes_synthetic.model import SyntheticScene, Truth
from scenes_synthetic.write import write

__all__ = ["PAPER", "SyntheticScene", "Truth", "build", "names", "on_map", "write"]

_BUILDERS: dict[str, Callable[..., SyntheticScene]] = {
    "house": house.build,
    "box": rooms.box,
    "l-room": rooms.l_room,
    "two-rooms": rooms.two_rooms,
    "closed-rooms": rooms.closed_rooms,
    "corridor-comb": rooms.corridor_comb,
    "basement": basement.build,
    "school": school.build,
    "office": office.build,
    "hole-walls": hole_walls.build,
    "convex-room": puzzles.convex_room,
    "l-by-range": puzzles.l_by_range,
    "t-corridor": puzzles.t_corridor,
    "plus-corridor": puzzles.plus_corridor,
    "comb-gallery": puzzles.comb_gallery,
    "spiral": puzzles.spiral,
    "column-hall": puzzles.column_hall,
    "glass-and-mirror": hard.glass_and_mirror,
    "thin-walls": hard.thin_walls,
    "doors-open": hard.doors_open,
    "doors-shut": hard.doors_shut,
    "stairwell": hard.stairwell,
    "double-height-hall": hard.double_height_hall,
    "atrium": hard.atrium,
    "tunnel": hard.tunnel,
    "facade": hard.facade,
    "georeferenced": copies.georeferenced,
    "millimetres-y-up": copies.millimetres_y_up,
    "broken-faces": copies.broken_faces,
    "without-slabs": copies.without_slabs,
}

PAPER = ("basement", "school", "office")
"""The three buildings of Lopez et al. 2023, of 130 thousand to 2.7 million triangles."""


def names() -> tuple[str, ...]:
    """Names of all scenes, the demo first."""
    return tuple(_BUILDERS)


def build(name: str, *, seed: int = 0) -> SyntheticScene:
    """Generate a scene by its name. Raises ValueError for a name that does not exist."""
    if name not in _BUILDERS:
        raise ValueError(f"there is no synthetic scene {name!r}; there are: {', '.join(names())}")
    return _BUILDERS[name](seed=seed)

"""Buildings that are generated rather than modelled: for the demo, and for tests that need to know the truth.

`names()` lists them, `build(name)` generates one, `write(scene, path)` saves it as IFC, OBJ, PLY, STL, GLB or USD.
Same name and seed, same bytes.
"""

from __future__ import annotations

from collections.abc import Callable

from scenes_synthetic import hole_walls, house, puzzles, rooms
from scenes_synthetic.model import SyntheticScene, Truth
from scenes_synthetic.write import write

__all__ = ["SyntheticScene", "Truth", "build", "names", "write"]

_BUILDERS: dict[str, Callable[..., SyntheticScene]] = {
    "house": house.build,
    "box": rooms.box,
    "l-room": rooms.l_room,
    "two-rooms": rooms.two_rooms,
    "closed-rooms": rooms.closed_rooms,
    "corridor-comb": rooms.corridor_comb,
    "hole-walls": hole_walls.build,
    "convex-room": puzzles.convex_room,
    "l-by-range": puzzles.l_by_range,
    "t-corridor": puzzles.t_corridor,
    "plus-corridor": puzzles.plus_corridor,
    "comb-gallery": puzzles.comb_gallery,
    "spiral": puzzles.spiral,
    "column-hall": puzzles.column_hall,
}


def names() -> tuple[str, ...]:
    """Names of all scenes, the demo first."""
    return tuple(_BUILDERS)


def build(name: str, *, seed: int = 0) -> SyntheticScene:
    """Generate a scene by its name. Raises ValueError for a name that does not exist."""
    if name not in _BUILDERS:
        raise ValueError(f"there is no synthetic scene {name!r}; there are: {', '.join(names())}")
    return _BUILDERS[name](seed=seed)

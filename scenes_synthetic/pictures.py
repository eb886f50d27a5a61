"""Pictures of the synthetic scenes for the documentation: `python -m scenes_synthetic.pictures FOLDER [PICTURE ...]`.

Without the name of a picture, all of them are drawn.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import scenes_synthetic
from scenes_synthetic.campus import campus_parts
from scenes_synthetic.drawing import View, draw
from scenes_synthetic.model import Part
from scenes_synthetic.solids import Point

_CAMPUS_TRIANGLES = 8_000_000
_OUTSIDE = ("IfcWall", "IfcSlab", "IfcRoof", "IfcDoor", "IfcWindow", "IfcGeographicElement")
"""What is drawn of the campus: nobody sees the chairs from there."""


def _small(
    scene: str,
    cut_m: float = View.cut_m,
    seen_from: Point = (-0.4, -1.0, 1.6),
    *,
    front_m: float = -99.0,
    storeys: tuple[int, ...] = (0,),
) -> View:
    """View of a puzzle or a hard scene, in a picture of its name."""
    return View(f"{scene}.png", scene, storeys, cut_m, seen_from, front_m, size=(640, 440))


def _inside(scene: str, storeys: tuple[int, ...], eye_m: Point, looks_at_m: Point) -> View:
    return View(f"{scene}-inside.png", scene, storeys, edges=False, inside=(eye_m, looks_at_m), size=(1000, 620))


_ALL = (0, 1, 2, 3, 4)
VIEWS = (
    View("house-outside.png", "house", (0, 1), seen_from=(-1.0, -1.7, 0.8)),
    View("house-ground-floor.png", "house", (0,), 2.15, (-0.55, -1.2, 1.9)),
    View("house-upper-floor.png", "house", (0, 1), 4.95, (-0.55, -1.2, 1.9)),
    View("basement.png", "basement", (0,), 3.3, (-0.45, -0.85, 2.1), edges=False),
    _inside("basement", (0,), (0.9, 1.2, 1.9), (8.5, 11.0, 1.35)),
    View("school-section.png", "school", _ALL, seen_from=(-0.45, -1.5, 0.6), front_m=15.0, edges=False),
    View("school-floor.png", "school", (0, 1), 7.6, (-0.35, -1.0, 1.5), edges=False),
    _inside("school", _ALL, (12.5, 14.6, 10.7), (32.0, 16.6, 8.9)),
    View("office.png", "office", (0,), 2.55, (-1.1, -0.75, 1.15), edges=False),
    _inside("office", (0, 1), (1.3, 0.8, 1.9), (8.6, 11.0, 1.05)),
    View("campus.png", "campus", _ALL, seen_from=(-0.5, -1.0, 0.6), edges=False, shadows=False),
    _small("hole-walls", 2.4, (-0.5, -0.9, 1.3)),
    _small("convex-room", 2.0),
    _small("l-by-range", 2.0),
    _small("t-corridor", 2.0),
    _small("plus-corridor", 2.0),
    _small("comb-gallery", 2.0),
    _small("spiral", 2.0),
    _small("column-hall", 2.0),
    _small("glass-and-mirror", 2.3, (-0.5, -0.9, 1.4)),
    _small("thin-walls", 2.0),
    _small("doors-open", 2.0),
    _small("doors-shut", 2.0),
    _small("stairwell", seen_from=(-0.5, -1.4, 0.45), front_m=2.6, storeys=(0, 1, 2)),
    _small("double-height-hall", 5.3, (-0.4, -0.9, 1.3), storeys=(0, 1)),
    _small("atrium", seen_from=(-0.3, -1.4, 0.3), front_m=7.0, storeys=(0, 1, 2)),
    View("tunnel.png", "tunnel", (0,), inside=((1.5, -0.9, 1.7), (40.0, 0.0, 2.2)), size=(640, 440)),
    _small("facade", seen_from=(-0.6, -1.4, 0.6)),
)


def main(arguments: Sequence[str]) -> None:
    """Draw the pictures named, or all, into the folder named first. Raises ValueError for a name that is no picture."""
    folder, *chosen = arguments
    unknown = set(chosen) - {view.file_name for view in VIEWS}
    if unknown:
        raise ValueError(f"there is no picture {', '.join(sorted(unknown))}")
    Path(folder).mkdir(parents=True, exist_ok=True)
    views = [view for view in VIEWS if not chosen or view.file_name in chosen]
    for scene in dict.fromkeys(view.scene for view in views):
        parts = _parts(scene)
        for view in views:
            if view.scene == scene:
                draw(parts, view, Path(folder) / view.file_name)


def _parts(scene: str) -> Sequence[Part]:
    if scene != "campus":
        return scenes_synthetic.build(scene).parts
    return [part for part in campus_parts(_CAMPUS_TRIANGLES) if part.kind in _OUTSIDE]


if __name__ == "__main__":
    main(sys.argv[1:])

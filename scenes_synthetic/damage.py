"""Damage that only files can have: corners that are no place, faces that name a vertex which does not exist.

No `Scene` in memory may have either, so they are put into the broken part of a scene while it is written, as far as the
format can carry them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenes_synthetic.model import Part, SyntheticScene
from scenes_synthetic.solids import Solid

#: Beyond the last vertex of any file of these scenes.
_MISSING_VERTEX = 1_000_000
#: A number, and no place on Earth.
_NOWHERE_M = 1e30


@dataclass(frozen=True)
class Carried:
    """Which damage a format carries."""

    non_finite: bool = False
    """STL has numbers; glTF forbids such ones, and IFC has no sign for them."""
    bad_index: bool = False
    """STL has no indices; an IFC product that has a bad one is no shape at all."""


CARRIED: dict[str, Carried] = {
    ".obj": Carried(non_finite=True, bad_index=True),
    ".ply": Carried(non_finite=True, bad_index=True),
    ".stl": Carried(non_finite=True),
    ".glb": Carried(bad_index=True),
    ".usd": Carried(bad_index=True),
    ".usda": Carried(bad_index=True),
    ".usdc": Carried(bad_index=True),
}
"""By extension; formats that are not named carry none."""


def as_in_files(synthetic: SyntheticScene, suffix: str) -> SyntheticScene:
    """Return the scene with the damage of its truth that a format carries, for writing only; as it is where none is.

    The damaged faces come last, in the last part.
    """
    carried = CARRIED.get(suffix, Carried())
    n_non_finite = synthetic.truth.n_non_finite * carried.non_finite
    n_bad_index = synthetic.truth.n_bad_index * carried.bad_index
    if n_non_finite + n_bad_index == 0:
        return synthetic
    last = synthetic.parts[-1]
    damaged = replace(last, solid=_damaged(last, n_non_finite, n_bad_index))
    vertices, triangles = damaged.solid.vertices_m, damaged.solid.triangles
    n_whole = len(synthetic.scene.vertices_m) - len(last.solid.vertices_m)
    n_faces = synthetic.scene.n_triangles - len(last.solid.triangles)
    element = np.full(len(triangles), len(synthetic.parts) - 1, dtype=np.int32)
    scene = replace(
        synthetic.scene,
        vertices_m=np.concatenate([synthetic.scene.vertices_m[:n_whole], vertices]),
        triangles=np.concatenate([synthetic.scene.triangles[:n_faces], triangles + np.int32(n_whole)]),
        element_of_triangle=np.concatenate([synthetic.scene.element_of_triangle[:n_faces], element]),
    )
    return replace(synthetic, scene=scene, parts=(*synthetic.parts[:-1], damaged))


def _damaged(part: Part, n_non_finite: int, n_bad_index: int) -> Solid:
    """Add faces to a part: those with a corner at NaN and at 1e30 m in turn, then those of missing vertices."""
    vertices, triangles = part.solid.vertices_m, part.solid.triangles
    spare = np.tile(vertices[triangles[0]], (n_non_finite, 1, 1))
    spare[0::2, 0, 0] = np.nan
    spare[1::2, 1, 2] = _NOWHERE_M
    nowhere = np.arange(3 * n_non_finite, dtype=np.int32).reshape(-1, 3) + np.int32(len(vertices))
    missing = np.tile(triangles[0], (n_bad_index, 1))
    missing[:, 1] = _MISSING_VERTEX + np.arange(n_bad_index, dtype=np.int32)
    return Solid(
        np.concatenate([vertices, spare.reshape(-1, 3)]), np.concatenate([triangles, nowhere, missing]).astype(np.int32)
    )

"""Rooms along a corridor, copied so that they are hard to load: far away, in other units, broken, without slabs.

The seed is unused but for the broken copy.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from planner_core.model import Int32Array
from scenes_synthetic import rooms
from scenes_synthetic.model import FileFrame, Level, MapPlacement, Part, SyntheticScene, assemble
from scenes_synthetic.solids import Point, Solid, join

#: Easting, northing and height of the georeferenced copy's origin.
FAR_M: Point = (500_000.0, 5_400_000.0, 0.0)
#: A place in the plain of the Rhine. Latitude, longitude and convergence are what PROJ makes of easting and northing.
SURVEYED = MapPlacement(
    east_m=458_870.0,
    north_m=5_438_260.0,
    height_m=110.25,
    rotation_rad=math.radians(24.5),
    crs="EPSG:25832",
    crs_description="ETRS89 / UTM zone 32N",
    geodetic_datum="ETRS89",
    vertical_datum="DHHN2016",
    projection="UTM",
    zone="32N",
    latitude=(49, 5, 44, 933602),
    longitude=(8, 26, 11, 725547),
    convergence_rad=math.radians(-0.4258344),
)
#: Share of broken faces of all.
BROKEN_SHARE = 0.05


def georeferenced(*, seed: int = 0) -> SyntheticScene:
    """A copy at E 500 000, N 5 400 000; `scene` is local, as it is after loading, and its offset leads there."""
    original = rooms.corridor_comb(seed=seed)
    scene = replace(original.scene, offset_m=np.asarray(FAR_M))
    return replace(original, name="georeferenced", scene=scene, frame=FileFrame(offset_m=FAR_M))


def on_map(original: SyntheticScene, placement: MapPlacement = SURVEYED) -> SyntheticScene:
    """Any scene, whose IFC file states besides where on earth it is; its coordinates stay the same."""
    return replace(original, frame=replace(original.frame, on_map=placement))


def millimetres_y_up(*, seed: int = 0) -> SyntheticScene:
    """A copy whose files are in millimetres and y up, where the format leaves the choice: OBJ, PLY, STL and USD.

    OBJ, PLY and STL can't say so; whoever loads them has to. glTF is always in metres, IFC always z up.
    """
    original = rooms.corridor_comb(seed=seed)
    return replace(original, name="millimetres-y-up", frame=FileFrame(metres_per_unit=0.001, up_axis="Y"))


def without_slabs(*, seed: int = 0) -> SyntheticScene:
    """A copy of walls alone, as architects' models often are: only the storey shows where the floor would be."""
    original = rooms.corridor_comb(seed=seed)
    (x0, y0, _), (x1, y1, _) = original.truth.extents_m.tolist()
    found = assemble(
        "without-slabs",
        levels=[Level(*storey) for storey in original.truth.storeys],
        rooms=original.rooms,
        parts=[part for part in original.parts if part.kind != "IfcSlab"],
        extents_m=[(x0, y0, 0.0), (x1, y1, original.rooms[0].height_m)],
        n_stations=original.truth.n_stations,
    )
    return replace(found, truth=replace(found.truth, floor_area_m2=original.truth.floor_area_m2))


def broken_faces(*, seed: int = 0) -> SyntheticScene:
    """A copy with a further part of faces that no modeller wants: of all faces, 5 % are broken.

    Some repeat a face of the building, some of those inside out; some have two corners in one place; some have all
    three on one line. They are the only part of any scene that is not closed, and the seed chooses them. As many again
    have a corner that is no place, or name a vertex which does not exist: those are in files only, see `damage`, and
    whoever loads them has to say that bad faces may be skipped.
    """
    original = rooms.corridor_comb(seed=seed)
    whole = join([part.solid for part in original.parts])
    n_broken = round(len(whole.triangles) * BROKEN_SHARE / (1 - BROKEN_SHARE))
    n_bad_index, n_non_finite, n_duplicate, n_degenerate = ((n_broken + i) // 4 for i in range(4))
    chosen = np.random.default_rng(seed).choice(len(whole.triangles), size=n_duplicate + n_degenerate, replace=False)
    faces = whole.triangles[np.sort(chosen)]
    broken = Solid(*_break(whole, faces, n_duplicate))
    found = assemble(
        "broken-faces",
        levels=[Level(*storey) for storey in original.truth.storeys],
        rooms=original.rooms,
        parts=[*original.parts, Part("Broken faces", "IfcBuildingElementProxy", 0, broken)],
        extents_m=original.truth.extents_m.tolist(),
        n_stations=original.truth.n_stations,
    )
    truth = replace(
        found.truth,
        n_duplicate=n_duplicate,
        n_degenerate=n_degenerate,
        n_non_finite=n_non_finite,
        n_bad_index=n_bad_index,
    )
    return replace(found, truth=truth)


def _break(whole: Solid, faces: Int32Array, n_duplicate: int) -> tuple[np.ndarray, Int32Array]:
    """Vertices and triangles of the broken faces: the first `n_duplicate` are repeated, the rest lose their area."""
    corners = whole.vertices_m[faces].copy()
    corners[1:n_duplicate:2] = corners[1:n_duplicate:2, ::-1]
    flat = corners[n_duplicate:]
    # In every face of a box the second edge runs along an axis: half-way on it is on it exactly.
    flat[:, 0] = flat[:, 1]
    flat[::2, 0] = np.round((flat[::2, 1] + flat[::2, 2]) / 2, 6)
    return corners.reshape(-1, 3), np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3)

"""What a synthetic scene is made of: named parts, rooms, storeys, and the truth that tests compare with.

Scene frame: metres, z up, near the origin (so local = scene frame, offset zero).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner_core.model import Element, FloatArray, LoadReport, Optics, Scene, SceneSource, Storey, UInt8Array
from planner_core.scene.materials import optics_of_name
from scenes_synthetic.solids import Point, Solid, pierced_box


@dataclass(frozen=True)
class Hole:
    """An opening in a wall or slab: the box (low_m, high_m) of missing material."""

    name: str
    low_m: Point
    high_m: Point


@dataclass(frozen=True)
class PiercedBox:
    """A wall or slab as a designer draws it: a box and the openings through it. IFC is written from this."""

    low_m: Point
    high_m: Point
    holes: tuple[Hole, ...] = ()

    def solid(self) -> Solid:
        """Return the material that is left."""
        return pierced_box(self.low_m, self.high_m, [(hole.low_m, hole.high_m) for hole in self.holes])


@dataclass(frozen=True)
class Part:
    """One named element. `room` is the room it stands in, empty for the fabric; `fills` the name of its opening."""

    name: str
    kind: str
    """IFC class: `IfcWall`, `IfcFurniture` ..."""
    storey: int
    solid: Solid
    pierced_box: PiercedBox | None = None
    """The recipe of `solid`, where it is one."""
    room: str = ""
    fills: str = ""
    predefined_type: str = ""
    """IFC4 PredefinedType where the class alone is too wide (`FLOOR`, `ROOF`, `TABLE`)."""
    material: str = ""
    """`glass` or `mirror`, which return nothing to a scanner; empty: any opaque one."""


@dataclass(frozen=True)
class Room:
    """A room between its walls: outline (x, y) counter-clockwise, floor and clear height.

    Edges with openings are axis-parallel. islands_m : outlines of what stands in it from floor to ceiling, clockwise.
    """

    name: str
    storey: int
    outline_m: tuple[tuple[float, float], ...]
    floor_m: float
    height_m: float
    islands_m: tuple[tuple[tuple[float, float], ...], ...] = ()


@dataclass(frozen=True)
class Level:
    """A storey: name and elevation of its finished floor."""

    name: str
    elevation_m: float


@dataclass(frozen=True)
class KnownView:
    """What one station sees, computed from the plan and not from the mesh.

    station_m : the sensor's origin. visible_area_m2 : by part, of those that it sees; range_m : how far it reaches.
    """

    station_m: Point
    visible_area_m2: dict[str, float]
    range_m: float = math.inf


@dataclass(frozen=True)
class Truth:
    """What is known of a scene without meshing it.

    floor_area_m2 : by room, between the walls, stair openings taken off, furniture not.
    wall_area_m2 : by room, the walls' faces towards it less doors, doorways and windows, furniture not taken off.
    extents_m : (2, 3) lowest and highest corner of everything.
    storeys : (name, elevation in metres), lowest first.
    n_stations : fewest stations that see all surfaces inside, for a scanner that looks everywhere and far enough;
        None where nobody knows.
    """

    floor_area_m2: dict[str, float]
    wall_area_m2: dict[str, float]
    extents_m: FloatArray
    storeys: tuple[tuple[str, float], ...]
    n_stations: int | None = None
    stations_m: tuple[Point, ...] = ()
    """`n_stations` sensor positions that see it all together; empty where none are known."""
    witnesses_m: tuple[Point, ...] = ()
    """Spots on the floor, no two of which can be seen from one place: as many stations are needed."""
    n_stations_at_range: tuple[tuple[float, int], ...] = ()
    """(range in metres, fewest stations of that range)."""
    views: tuple[KnownView, ...] = ()
    returns_nothing: tuple[str, ...] = ()
    """Parts that no scanner gets a return of: glass lets the beam through, a mirror turns it aside."""
    slides_along: Point | None = None
    """Direction along which scans can be shifted against each other and still fit; None: no such one by design."""
    n_degenerate: int = 0
    """Faces without area, put there on purpose."""
    n_duplicate: int = 0
    """Faces that repeat another, put there on purpose."""
    n_non_finite: int = 0
    """Faces with a corner that is no place, in files only, see `scenes_synthetic.damage`."""
    n_bad_index: int = 0
    """Faces that name a vertex which does not exist, in files only, see `scenes_synthetic.damage`."""


@dataclass(frozen=True)
class MapPlacement:
    """Where on earth a scene is stated to be: a map conversion, and other entries of an IFC file's site.

    rotation_rad : of the scene on the grid, counter-clockwise. convergence_rad : of grid north there, clockwise from
    true north. latitude, longitude : of the scene's origin, whole degrees, minutes, seconds and their millionths.
    """

    east_m: float
    north_m: float
    height_m: float
    rotation_rad: float
    crs: str
    crs_description: str
    geodetic_datum: str
    vertical_datum: str
    projection: str
    zone: str
    latitude: tuple[int, int, int, int]
    longitude: tuple[int, int, int, int]
    convergence_rad: float


@dataclass(frozen=True)
class FileFrame:
    """How files hold a scene: unit, upward axis, and how far from the origin, where the format leaves the choice."""

    metres_per_unit: float = 1.0
    up_axis: str = "Z"
    """`Y` or `Z`."""
    offset_m: Point = (0.0, 0.0, 0.0)
    """Added to the scene's coordinates, which are local."""
    on_map: MapPlacement | None = None
    """IFC files say it; no other format can."""

    @property
    def title(self) -> str:
        """What it is in words, for headers."""
        unit = {1.0: "metres", 0.001: "millimetres"}[self.metres_per_unit]
        return f"{unit}, {self.up_axis.lower()} up"

    def coordinates(self, local_m: FloatArray) -> FloatArray:
        """(N, 3) local metres as the file's numbers, with six decimals."""
        x, y, z = (local_m + np.asarray(self.offset_m)).T
        turned = np.stack([x, z, -y] if self.up_axis == "Y" else [x, y, z], axis=1)
        return np.round(turned / self.metres_per_unit, 6)


@dataclass(frozen=True)
class SyntheticScene:
    """A generated building: its parts, its rooms, the mesh of all of it, and the truth about it."""

    name: str
    scene: Scene
    parts: tuple[Part, ...]
    """In the order of `scene.elements`."""
    rooms: tuple[Room, ...]
    truth: Truth
    frame: FileFrame = FileFrame()


def assemble(
    name: str,
    *,
    levels: Sequence[Level],
    rooms: Sequence[Room],
    parts: Sequence[Part],
    extents_m: Sequence[Sequence[float]],
    n_stations: int | None = None,
) -> SyntheticScene:
    """Put parts and rooms together; names of parts must be unique.

    extents_m is the designer's, not the mesh's: it is the truth that the mesh is tested against.
    """
    names = [part.name for part in parts]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ValueError(f"scene {name}: part names occur twice: {', '.join(twice)}")
    truth = Truth(
        floor_area_m2={room.name: floor_area_m2(room, parts) for room in rooms},
        wall_area_m2={room.name: wall_area_m2(room, parts) for room in rooms},
        extents_m=np.asarray(extents_m, dtype=np.float64),
        storeys=tuple((level.name, level.elevation_m) for level in levels),
        n_stations=n_stations,
    )
    return SyntheticScene(name, _scene(name, levels, parts), tuple(parts), tuple(rooms), truth)


def _scene(name: str, levels: Sequence[Level], parts: Sequence[Part]) -> Scene:
    starts = np.cumsum([0, *(len(part.solid.vertices_m) for part in parts)])
    vertices = np.concatenate([part.solid.vertices_m for part in parts])
    triangles = np.concatenate([p.solid.triangles + np.int32(s) for p, s in zip(parts, starts[:-1], strict=True)])
    element = np.repeat(np.arange(len(parts), dtype=np.int32), [len(p.solid.triangles) for p in parts])
    digest = hashlib.sha256(vertices.tobytes() + triangles.tobytes()).hexdigest()
    return Scene(
        source=SceneSource(Path(name), digest, "memory", "metre", 1.0, "Z"),
        vertices_m=vertices,
        triangles=triangles,
        element_of_triangle=element,
        elements=tuple(Element(p.name, p.kind, p.name, p.storey) for p in parts),
        storeys=tuple(Storey(level.name, level.name, level.elevation_m) for level in levels),
        offset_m=np.zeros(3),
        report=LoadReport(n_faces_read=len(triangles)),
        optics_of_triangle=_optics(parts),
    )


def _optics(parts: Sequence[Part]) -> UInt8Array | None:
    """(T,) what the parts' materials do to beams, as a reader of the scene's file has it; None where all return."""
    optics = np.array([optics_of_name(part.material) or Optics.RETURNS for part in parts], dtype=np.uint8)
    return np.repeat(optics, [len(part.solid.triangles) for part in parts]) if optics.any() else None


def floor_area_m2(room: Room, parts: Sequence[Part]) -> float:
    """Area inside the room's outline, less its islands and the holes of slabs whose top is the room's floor."""
    area = sum(_signed_area_m2(ring) for ring in (room.outline_m, *room.islands_m))
    x, y = np.asarray(room.outline_m).T
    low_x, low_y, high_x, high_y = x.min(), y.min(), x.max(), y.max()
    for hole in _holes(parts):
        inside = (
            low_x <= hole.low_m[0] and hole.high_m[0] <= high_x and low_y <= hole.low_m[1] and hole.high_m[1] <= high_y
        )
        if inside and hole.high_m[2] == room.floor_m and hole.low_m[2] < room.floor_m:
            area -= (hole.high_m[0] - hole.low_m[0]) * (hole.high_m[1] - hole.low_m[1])
    return area


def _signed_area_m2(ring_m: Sequence[tuple[float, float]]) -> float:
    """Area inside a polygon; negative where it runs clockwise."""
    x, y = np.asarray(ring_m).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def wall_area_m2(room: Room, parts: Sequence[Part]) -> float:
    """Perimeter, that of islands too, times clear height, less the openings that begin at it."""
    rings = [np.asarray(ring) for ring in (room.outline_m, *room.islands_m)]
    edges = [edge for ring in rings for edge in zip(ring, np.roll(ring, -1, axis=0), strict=True)]
    area = 0.0
    for start, end in edges:
        area += math.hypot(*(end - start)) * room.height_m
        along = int(np.argmax(np.abs(end - start)))
        across = 1 - along
        low, high = sorted((start[along], end[along]))
        for hole in _holes(parts):
            same_storey = room.floor_m <= hole.low_m[2] and hole.high_m[2] <= room.floor_m + room.height_m
            on_edge = start[across] in (hole.low_m[across], hole.high_m[across])
            if same_storey and on_edge and low <= hole.low_m[along] and hole.high_m[along] <= high:
                area -= (hole.high_m[along] - hole.low_m[along]) * (hole.high_m[2] - hole.low_m[2])
    return area


def _holes(parts: Sequence[Part]) -> list[Hole]:
    return [hole for part in parts if part.pierced_box is not None for hole in part.pierced_box.holes]

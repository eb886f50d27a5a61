"""The building: a mesh with names, its floors, and the patches that coverage is counted in."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

import numpy as np

from planner_core.model.arrays import FloatArray, Int32Array, UInt8Array
from planner_core.model.site_frame import Georeference


@dataclass(frozen=True)
class SceneSource:
    """Where a scene came from and how it was brought to the scene frame."""

    path: Path
    sha256: str
    format: str
    """`ifc`, `obj`, `ply`, `stl`, `gltf`, `usd` or `memory`."""
    unit_name: str
    """`metre`, `millimetre`, `inch` ...; by the file or by the user."""
    metres_per_unit: float
    up_axis: str
    """`Y` or `Z`."""
    schema: str = ""
    """As stated in the file: `IFC2X3`, `IFC4`, `glTF 2.0` ...; empty where it states nothing."""
    glass: str = "pass"
    """What glass does, by the user: `pass`, `stop` or `return`, see `Optics`."""
    doors: str = "shut"
    """State of doors, by the user: `shut`, as modelled; without their leaves those indoors, `open`, or `all`; or
    `outside`, all of them, and stations may stand outdoors."""
    doors_open: tuple[str, ...] = ()
    """GlobalIds of doors that are open by the user, whatever `doors` is; so with the next."""
    doors_shut: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    """Classes, or patterns of names, whose elements the user left out of the scene."""
    given_metres_per_unit: float | None = None
    """The unit given by the user; None: none. So with the next two: what loads the file the same way again."""
    given_up_axis: str | None = None
    skip_bad_faces: bool = False


def scene_title(first: str, n_more: int) -> str:
    """What to call a scene of a file, or of several, by the name of the first."""
    return f"{first} and {n_more} more {'file' if n_more == 1 else 'files'}" if n_more else first


class Optics(IntEnum):
    """What a surface does to a beam."""

    RETURNS = 0
    """Sends it back: nearly all surfaces."""
    PASSES = 1
    """Lets it through, without a return: clear glass."""
    STOPS = 2
    """Ends it without a return from there: a mirror. What it shows at wrong places is not simulated."""


@dataclass(frozen=True)
class Element:
    """One named thing of the source: an IFC product, an OBJ group, a glTF node, a USD prim."""

    name: str
    kind: str
    """IFC class (`IfcWall`), prim type or `Mesh`."""
    source_id: str
    """IFC GlobalId, prim path, node index ...: what finds it again in the source."""
    storey: int = -1
    """Index into `Scene.storeys`; -1 where the source names none."""
    is_external: bool | None = None
    """Of a door: whether it leads outdoors, by the source; None: not stated."""
    predefined_type: str = ""
    """Predefined type within the class: `CEILING` of an IfcCovering, `LANDING` of an IfcSlab; empty: nothing."""
    file: int = 0
    """Index into `Scene.sources`."""
    parents: tuple[str, ...] = ()
    """Classes that IFC has above `kind`, the nearest first: IfcFurnishingElement and so on of an IfcFurniture."""


@dataclass(frozen=True)
class Storey:
    """A storey as the source names it (IfcBuildingStorey), lowest first in `Scene.storeys`."""

    name: str
    source_id: str
    elevation_m: float
    """Local frame."""


@dataclass(frozen=True)
class Room:
    """A room as the source outlines it (IfcSpace): a closed shape that no beam meets.

    vertices_m : (V, 3) float64, local frame. triangles : (K, 3) int32 into them, of any winding.
    """

    name: str
    """Mostly a number: `A102`."""
    long_name: str
    """Mostly what it is for: `Living Room`."""
    source_id: str
    storey: int
    """Index into `Scene.storeys`; -1 where the source names none."""
    vertices_m: FloatArray
    triangles: Int32Array

    @property
    def title(self) -> str:
        """What to call it: both names, or the id where it has none."""
        return " ".join(text for text in (self.name, self.long_name) if text) or self.source_id

    @property
    def box_m(self) -> FloatArray:
        """(2, 3) lowest and highest corner, local frame; inverted where there is no vertex."""
        return np.stack([self.vertices_m.min(axis=0, initial=np.inf), self.vertices_m.max(axis=0, initial=-np.inf)])


@dataclass(frozen=True)
class PlacedDoor:
    """A door. box_m : (2, 3) lowest and highest corner, local frame. across : (2,) unit direction through it."""

    element: int
    """Index into `Scene.elements`."""
    box_m: FloatArray
    across: FloatArray

    @property
    def height_m(self) -> float:
        """From foot to head."""
        return float(self.box_m[1, 2] - self.box_m[0, 2])

    @property
    def thickness_m(self) -> float:
        """Through it; of a leaf modelled ajar, without a frame, as much as its box is deep."""
        return float(np.abs(self.across) @ (self.box_m[1, :2] - self.box_m[0, :2]))

    @property
    def line_m(self) -> FloatArray:
        """(2, 2) ends of its opening in plan."""
        along = np.array([-self.across[1], self.across[0]])
        middle_m, half_m = self.box_m[:, :2].mean(axis=0), 0.5 * (self.box_m[1, :2] - self.box_m[0, :2])
        line_m: FloatArray = middle_m + float(np.abs(along) @ half_m) * np.array([-along, along])
        return line_m


@dataclass(frozen=True)
class LoadReport:
    """What loading found and repaired. Counts are of faces unless named otherwise."""

    n_faces_read: int
    n_non_finite: int = 0
    n_degenerate: int = 0
    n_duplicate: int = 0
    n_bad_index: int = 0
    """Dropped because they name a vertex that does not exist (only with `skip_bad_faces`)."""
    n_stray: int = 0
    """Dropped because they lie kilometres away from everything else; a warning names their elements."""
    glass_area_m2: float = 0.0
    """Of faces of clear glass by the file, whatever they are taken to do to beams; both faces of a pane."""
    mirror_area_m2: float = 0.0
    n_doors_open: int = 0
    """Doors (`IfcDoor`) whose leaves were left out, with `doors="open"`."""
    left_out_m2: tuple[float, ...] = ()
    """Area of the faces left out by each of `SceneSource.leave_out`, not counted twice."""
    dropped: tuple[str, ...] = ()
    """Up to 100 lines, one a dropped face or group of faces: element, face number, reason."""
    warnings: tuple[str, ...] = ()
    """One line each, for the user: guessed units, far origin, elements without geometry, swapped axes ..."""


@dataclass(frozen=True)
class Scene:
    """A triangle mesh with the names of what it is made of.

    vertices_m : (V, 3) float64, local frame. Triangles that share an edge share its vertices bit by bit.
    triangles : (T, 3) int32, into vertices_m.
    element_of_triangle : (T,) int32, into elements.
    optics_of_triangle : (T,) uint8 of `Optics`; None: all return.
    offset_m : (3,) float64; scene = local + offset_m. Zero when the source lies near its origin.
    """

    source: SceneSource
    vertices_m: FloatArray
    triangles: Int32Array
    element_of_triangle: Int32Array
    elements: tuple[Element, ...]
    storeys: tuple[Storey, ...]
    offset_m: FloatArray
    report: LoadReport
    optics_of_triangle: UInt8Array | None = None
    rooms: tuple[Room, ...] = ()
    """Empty where the source names none."""
    georeference: Georeference | None = None
    """None: the source does not state where it is on earth."""
    further_sources: tuple[SceneSource, ...] = ()
    """The other files of a scene of several, in the order given; `source` is the first."""
    open_doors: tuple[PlacedDoor, ...] = ()
    """Doors whose leaves were left out, as they are when shut."""

    @property
    def sources(self) -> tuple[SceneSource, ...]:
        """All files of the scene, in the order given."""
        return (self.source, *self.further_sources)

    @property
    def title(self) -> str:
        """What to call the scene: the name of its file, or of the first and how many more."""
        return scene_title(self.source.path.name, len(self.further_sources))

    def label(self, element: int) -> str:
        """What to call an element to people: its name, and its file where the scene is several."""
        name, file = self.elements[element].name, self.file_of(element)
        return f"{name} ({file})" if file else name

    def file_of(self, element: int) -> str:
        """Name of the file that an element is in; empty where the scene is one file."""
        return self.sources[self.elements[element].file].path.name if self.further_sources else ""

    @property
    def n_triangles(self) -> int:
        """Number of triangles."""
        return int(self.triangles.shape[0])


@dataclass(frozen=True)
class Floor:
    """Ground that a tripod can stand on, as one level of the plan. Lowest first; `id` is `F0`, `F1` ... as found.

    Floors that people marked have the numbers behind these, whatever their height.

    ground_triangles : (G,) int32, sorted triangle ids. Where the storey, or a part of it, has no slab, the plane
    z = elevation_m in the rectangles `plane_m` is ground, too, which a `Survey` adds to its scene as triangles; where
    most of the ground is such a plane, `origin` is `storey-elevation` or `wall-foot`.
    bounds_m : (2, 2) float64, local [[x_min, y_min], [x_max, y_max]] of the ground.
    """

    id: str
    name: str
    elevation_m: float
    """Local frame, the ground's height (area-weighted median of its triangles)."""
    ground_area_m2: float
    ground_triangles: Int32Array
    bounds_m: FloatArray
    origin: str
    """`slab`, `surface`, `storey-elevation` or `wall-foot`: how the ground was found; `marked`: see `GroundPick`."""
    plane_m: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(R, 2, 2) local [[x_min, y_min], [x_max, y_max]] of the ground's pieces that are a plane."""


@dataclass(frozen=True)
class Patches:
    """The unit of coverage: every triangle bisected at its longest edge until no part exceeds `max_area_m2`.

    Patches are addresses, not geometry: patch = first_patch[triangle] + code, where code is the `depth`-bit path down
    the bisection tree. See `planner_core.scene.patches`.

    depth : (T,) uint8. first_patch : (T + 1,) int32, last entry = n_patches. triangle_area_m2 : (T,) float64.
    countable_share : (P,) uint8, how much of each patch counts, in 255ths; None: all. docs/method/coverage.md.
    """

    max_area_m2: float
    depth: UInt8Array
    first_patch: Int32Array
    triangle_area_m2: FloatArray
    countable_share: UInt8Array | None = None

    @property
    def n_patches(self) -> int:
        """Number of patches of the whole scene."""
        return int(self.first_patch[-1])

    @property
    def area_m2(self) -> FloatArray:
        """(P,) float64, area of every patch, as far as it counts."""
        count = np.diff(self.first_patch)
        whole_m2 = np.repeat(self.triangle_area_m2 / np.maximum(count, 1), count)
        return whole_m2 if self.countable_share is None else whole_m2 * (self.countable_share / 255.0)

    @property
    def triangle_of_patch(self) -> Int32Array:
        """(P,) int32, the triangle every patch is a part of."""
        count = np.diff(self.first_patch)
        return np.repeat(np.arange(count.size, dtype=np.int32), count)

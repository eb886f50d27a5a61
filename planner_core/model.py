"""The frozen dataclasses that the stages hand on, and nothing else.

Frames
------
*source*  what the file says: any unit, y or z up, any origin.
*scene*   metres, z up, right-handed; otherwise the source's own origin. plan.json, CSV and every export use it.
*local*   scene minus `Scene.offset_m`. ALL geometry in memory is local, float64 on the host and float32 in kernels.

Conventions: arrays are C-contiguous and not written to after construction. A miss is range NaN, triangle -1, patch -1.
Angles are radians; azimuth runs counter-clockwise from +x seen from above, elevation up from the horizontal.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]
Int64Array = NDArray[np.int64]
UInt8Array = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]


# --------------------------------------------------------------------------------------------- scene
@dataclass(frozen=True)
class SceneSource:
    """Where a scene came from and how it was brought to the scene frame."""

    path: Path
    sha256: str
    format: str
    """`ifc`, `obj`, `ply`, `stl`, `gltf`, `usd` or `memory`."""
    unit_name: str
    """`metre`, `millimetre`, `inch` ...; as told by the file or by the user."""
    metres_per_unit: float
    up_axis: str
    """`Y` or `Z`."""
    schema: str = ""
    """What the file says of itself: `IFC2X3`, `IFC4`, `glTF 2.0` ...; empty where it says nothing."""
    glass: str = "pass"
    """What the user said that glass does: `pass`, `stop` or `return`, see `Optics`."""


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


@dataclass(frozen=True)
class Storey:
    """A storey as the source names it (IfcBuildingStorey), lowest first in `Scene.storeys`."""

    name: str
    source_id: str
    elevation_m: float
    """Local frame."""


@dataclass(frozen=True)
class LoadReport:
    """What loading found and repaired. Counts are of faces unless said otherwise."""

    n_faces_read: int
    n_non_finite: int = 0
    n_degenerate: int = 0
    n_duplicate: int = 0
    n_bad_index: int = 0
    """Dropped because they name a vertex that does not exist (only with `skip_bad_faces`)."""
    n_stray: int = 0
    """Dropped because they lie kilometres away from everything else; a warning names their elements."""
    glass_area_m2: float = 0.0
    """Of faces that the file says are of clear glass, whatever they are taken to do to beams; both faces of a pane."""
    mirror_area_m2: float = 0.0
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

    @property
    def n_triangles(self) -> int:
        """Number of triangles."""
        return int(self.triangles.shape[0])


@dataclass(frozen=True)
class Floor:
    """Ground that a tripod can stand on, as one level of the plan. Lowest first; `id` is `F0`, `F1` ...

    ground_triangles : (G,) int32, sorted triangle ids. Empty where the storey has no slab: then the ground is the
    plane z = elevation_m inside `bounds_m`, and `origin` is `storey-elevation`.
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
    """`slab`, `surface` or `storey-elevation`: how the ground was found."""


@dataclass(frozen=True)
class Patches:
    """The unit of coverage: every triangle bisected at its longest edge until no part exceeds `max_area_m2`.

    Patches are addresses, not geometry: patch = first_patch[triangle] + code, where code is the `depth`-bit path down
    the bisection tree. See `planner_core.scene.patches`.

    depth : (T,) uint8. first_patch : (T + 1,) int32, last entry = n_patches. triangle_area_m2 : (T,) float64.
    """

    max_area_m2: float
    depth: UInt8Array
    first_patch: Int32Array
    triangle_area_m2: FloatArray

    @property
    def n_patches(self) -> int:
        """Number of patches of the whole scene."""
        return int(self.first_patch[-1])

    @property
    def area_m2(self) -> FloatArray:
        """(P,) float64, area of every patch."""
        count = np.diff(self.first_patch)
        return np.repeat(self.triangle_area_m2 / np.maximum(count, 1), count)

    @property
    def triangle_of_patch(self) -> Int32Array:
        """(P,) int32, the triangle every patch is a part of."""
        count = np.diff(self.first_patch)
        return np.repeat(np.arange(count.size, dtype=np.int32), count)


# ------------------------------------------------------------------------------------------- scanner
@dataclass(frozen=True)
class Scanner:
    """A scanner's specification, in the instrument's own frame. Channels are the rows of a scan, azimuths its columns.

    elevation_rad : one angle a channel, highest first.
    """

    name: str
    title: str
    source: str
    """Where the figures are from."""
    range_min_m: float
    range_max_m: float
    n_azimuths: int
    elevation_rad: tuple[float, ...]
    instrument_height_min_m: float
    instrument_height_max_m: float
    azimuth_range_rad: tuple[float, float] | None = None
    """First and last of `n_azimuths` even azimuths, both included; None: a full turn from 0."""
    azimuth_offset_rad: tuple[float, ...] = ()
    """One angle a channel, added to its azimuths; empty: none."""
    inverted: bool = False
    """Hangs upside down: turned by 180 degrees about its x axis."""
    mode: str = ""
    """Which of its resolutions this is: a mode's id, or a point spacing at 10 m such as `6mm`; empty: it has one."""
    seconds_per_scan: float | None = None
    """Of a whole scan in this mode; None: not known, as with all that follows."""
    range_noise: tuple[tuple[float, float, float], ...] = ()
    """Rows (range in metres, reflectivity in 0..1, one sigma in metres), by reflectivity, then range."""
    ranging_accuracy: tuple[float, float] | None = None
    """(a, b): a range r is accurate to a + b r metres, as the maker states it."""
    angular_accuracy_rad: float | None = None
    """Of either angle, as the maker states it."""
    beam_divergence_rad: float | None = None
    """Full angle, by the definition of a beam's width that `beam_width_at` names."""
    beam_diameter_m: float | None = None
    """At the exit, by the same definition."""
    beam_width_at: str = ""
    """`1/e`, `1/e2`, `FWHM`, or empty: not told."""
    wavelength_m: float | None = None
    dual_axis_compensator: bool | None = None

    @property
    def n_channels(self) -> int:
        """Number of rows of a scan."""
        return len(self.elevation_rad)

    @property
    def n_beams(self) -> int:
        """Number of beams of a scan."""
        return self.n_channels * self.n_azimuths


@dataclass(frozen=True)
class BeamTemplate:
    """All beams of one scan from the sensor's origin, as the scene sees them: also those of an inverted instrument.

    Beam (row, column): e = elevation_rad[row], a = azimuth_rad[column] + azimuth_offset_rad[row],
    direction = (cos e cos a, cos e sin a, sin e). Float64; engines round to float32 from the SAME float64 values.

    azimuth_rad : (C,) even steps, rising. elevation_rad : (R,), never rising. azimuth_offset_rad : (R,) or None: zero.
    """

    azimuth_rad: FloatArray
    elevation_rad: FloatArray
    range_min_m: float
    range_max_m: float
    azimuth_offset_rad: FloatArray | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of a scan."""
        return (int(self.elevation_rad.size), int(self.azimuth_rad.size))


@dataclass(frozen=True)
class RayHits:
    """First hits of N free rays. range_m : (N,) float32, NaN on a miss. triangle : (N,) int32, -1 on a miss."""

    range_m: Float32Array
    triangle: Int32Array


@dataclass(frozen=True)
class ScanBatch:
    """First returns of S scans, rows x columns each.

    range_m : (S, R, C) float32, NaN on a miss. triangle, patch : (S, R, C) int32, -1 on a miss. A beam that hits
    nothing but the rounding margin beside a triangle's edge, about 1 in 100 000, has range and triangle but no patch.
    cos_incidence : (S, R, C) float32 in [0, 1], |normal . beam|, NaN on a miss.
    """

    range_m: Float32Array
    triangle: Int32Array
    patch: Int32Array
    cos_incidence: Float32Array


@dataclass(frozen=True)
class Visibility:
    """Which patches each of N positions sees, as compressed sparse rows.

    starts : (N + 1,) int64. patch : (starts[-1],) int32, sorted and unique inside each row.
    """

    starts: Int64Array
    patch: Int32Array
    n_patches: int

    @property
    def n_positions(self) -> int:
        """Number of rows."""
        return int(self.starts.size - 1)

    def row(self, position: int) -> Int32Array:
        """Sorted patch ids that `position` sees."""
        return self.patch[self.starts[position] : self.starts[position + 1]]


@dataclass(frozen=True)
class ReturnMoments:
    """Sums over the returns on each of M patches: what F2 and point spacing are computed from, docs/method/returns.md.

    A return i lies at p_i metres from the first vertex of its patch (`patch_triangles(...)[patch, 0]`, of vertices
    rounded to float32), in the local frame's directions; its weight is w_i = 2 - cos_incidence_i.

    point_sum_m : (M, 3), sum of p_i. square_sum_m2 : (M,), sum of |p_i|^2. weight_sum : (M,), sum of w_i.
    weighted_point_sum_m : (M, 3), sum of w_i p_i. weighted_square_sum_m2 : (M,), sum of w_i |p_i|^2.
    range_sum_m : (M,). All float64. least_range_m, greatest_cos_incidence : (M,) float32.
    """

    point_sum_m: FloatArray
    square_sum_m2: FloatArray
    weight_sum: FloatArray
    weighted_point_sum_m: FloatArray
    weighted_square_sum_m2: FloatArray
    range_sum_m: FloatArray
    least_range_m: Float32Array
    greatest_cos_incidence: Float32Array


@dataclass(frozen=True)
class PatchReturns:
    """How many returns of each of N positions lie on which patches: the rows of `Visibility`, with numbers.

    starts, patch : as in `Visibility`. n_returns : (starts[-1],) int32, at least 1. moments : of the same length, or
    None where they were not asked for.
    """

    starts: Int64Array
    patch: Int32Array
    n_returns: Int32Array
    moments: ReturnMoments | None
    n_patches: int

    @property
    def visibility(self) -> Visibility:
        """The patches alone; shares the arrays."""
        return Visibility(starts=self.starts, patch=self.patch, n_patches=self.n_patches)

    @property
    def mean_range_m(self) -> FloatArray:
        """(starts[-1],) float64, mean range of the returns on each patch; needs moments."""
        if self.moments is None:
            raise ValueError("mean range: got returns without moments, expected them; ask for `moments=True`")
        return self.moments.range_sum_m / self.n_returns

    def row(self, position: int) -> slice:
        """Where the entries of `position` lie in all the arrays."""
        return slice(int(self.starts[position]), int(self.starts[position + 1]))


# ------------------------------------------------------------------------------------------ planning
@dataclass(frozen=True)
class Candidates:
    """Admissible sensor positions that nobody has chosen yet.

    position_m : (N, 3) float64, local, the sensor's origin. floor : (N,) int32 into the floors.
    instrument_height_m : (N,) float64 above the ground below. n_tried : grid points looked at;
    rejected : how many were refused, by reason.
    """

    position_m: FloatArray
    floor: Int32Array
    instrument_height_m: FloatArray
    n_tried: int
    rejected: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Requirements:
    """What the client asked. `coverage` is a fraction of the achievable area, overall and on each floor."""

    coverage: float = 0.95
    overlap: float = 0.30
    floors: tuple[str, ...] = ()
    """Ids or names of the floors to plan; empty: all."""


@dataclass(frozen=True)
class PlanSettings:
    """Everything that decides a plan besides the scene: same scene, same settings, same plan, byte for byte."""

    scanner: Scanner
    requirements: Requirements = Requirements()
    method: str = "greedy"
    """`greedy`; `proven`, see `planner_core.select.proven`; `paper`: the method paper's, see `planner_core.paper`."""
    method_options: tuple[tuple[str, str], ...] = ()
    """(name, value) of options of the method, as text: fields of `SelectionSettings` or `PaperSettings`."""
    seed: int = 0
    grid_step_m: float = 0.5
    instrument_heights_m: tuple[float, ...] = ()
    """Heights to try; empty: the scanner's range in steps of `height_step_m`."""
    height_step_m: float = 0.4
    clearance_m: float = 0.4
    ground_ring_radius_m: float = 0.2
    n_ground_ring_rays: int = 16
    max_patch_area_m2: float = 0.04
    scan_mode: str = "auto"
    """What candidates are judged by: `beams`, `patches` (samples of patches, see `planner_core.scan.patch_mode`), or
    `auto`: patches for scanners of very many beams."""


@dataclass(frozen=True)
class Station:
    """A position of the plan. position_m : (3,) float64, local, the sensor's origin."""

    id: str
    floor: str
    order: int
    position_m: FloatArray
    instrument_height_m: float
    fixed: bool = False
    covered_area_m2: float = 0.0
    """Area this station sees by itself."""
    own_area_m2: float = 0.0
    """Area that no other station of the plan sees."""


@dataclass(frozen=True)
class Coverage:
    """How much of a surface the plan's stations see together."""

    achievable_area_m2: float
    """Seen by at least one admissible candidate (or by a given station)."""
    total_area_m2: float
    covered_area_m2: float

    @property
    def fraction_of_achievable(self) -> float:
        """Covered / achievable; 1 where nothing is achievable."""
        return self.covered_area_m2 / self.achievable_area_m2 if self.achievable_area_m2 > 0 else 1.0

    def meets(self, required: float) -> bool:
        """Whether the fraction of achievable reaches `required`, but for rounding in the last places."""
        return self.fraction_of_achievable >= required - 1e-9

    @property
    def fraction_of_total(self) -> float:
        """Covered / total; 1 where there is no surface."""
        return self.covered_area_m2 / self.total_area_m2 if self.total_area_m2 > 0 else 1.0


@dataclass(frozen=True)
class Link:
    """Overlap of two stations. `overlap`: the smaller of both shares of seen area that the other sees too.

    `strength`: smallest eigenvalue of the shared surface's point-to-plane normal matrix, scaled to [0, 1]; NaN where
    it was not computed.
    """

    a: str
    b: str
    overlap: float
    strength: float


@dataclass(frozen=True)
class UnseenElement:
    """Achievable surface of one element that the plan leaves unseen."""

    element: int
    floor: str
    """Floor id, or empty where the element belongs to none."""
    unseen_area_m2: float
    achievable_area_m2: float


@dataclass(frozen=True)
class Survey:
    """The problem: a scene made ready for planning."""

    scene: Scene
    floors: tuple[Floor, ...]
    patches: Patches
    floor_of_triangle: Int32Array
    """(T,) int32 into floors: the level whose coverage figure a triangle counts for; -1 none."""
    template: BeamTemplate
    warnings: tuple[str, ...] = ()
    """One line each, for the user: warnings of finding the floors."""


@dataclass(frozen=True)
class Plan:
    """The result: stations and what they are worth. Everything an export needs, apart from the scans themselves.

    times_seen : (P,) int32, number of the plan's stations that see each patch.
    achievable : (P,) bool, seen by at least one candidate or station.
    coverage_curve : covered fraction of achievable area after 1, 2, ... stations, in the order of choice.
    """

    survey: Survey
    settings: PlanSettings
    stations: tuple[Station, ...]
    times_seen: Int32Array
    achievable: BoolArray
    coverage: Coverage
    coverage_by_floor: tuple[Coverage, ...]
    coverage_curve: tuple[float, ...]
    links: tuple[Link, ...]
    connected: bool
    unseen: tuple[UnseenElement, ...]
    lower_bound: int
    n_candidates: int
    engine: str
    """Name of the engine and device that scanned, for the record."""
    why_stopped: str = ""
    """Why the search for fewer stations ended: `proven`, `work limit` ...; empty where the method does not search."""
    warnings: tuple[str, ...] = ()
    timings_s: dict[str, float] = field(default_factory=dict)

"""The problem: settings, the scene made ready, and where stations may stand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from planner_core.model.arrays import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.model.requirements import Requirements
from planner_core.model.scans import BeamTemplate, Scanner
from planner_core.model.scene import Floor, Patches, Scene
from planner_core.model.site import Site


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

    def take(self, which: BoolArray | Int64Array) -> Candidates:
        """Some of them, by a mask (N,) or by rows in the order given; how many were tried and refused stays."""
        return replace(
            self,
            position_m=self.position_m[which],
            floor=self.floor[which],
            instrument_height_m=self.instrument_height_m[which],
        )


@dataclass(frozen=True)
class PlanSettings:
    """Everything that decides a plan besides the scene: same scene, same settings, same plan, byte for byte."""

    scanner: Scanner
    requirements: Requirements = field(default_factory=Requirements)
    objective: str = "fewest"
    """`fewest` stations; `coverage`: most of it with `max_stations`; `time`: least time in the field."""
    max_stations: int | None = None
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
    special_places: bool = True
    """Doorways, middles of rooms and landings besides the grid, see `planner_core.positions.places`."""
    max_patch_area_m2: float = 0.04
    scan_mode: str = "auto"
    """What candidates are judged by: `beams`, `patches` (samples of patches, see `planner_core.engine.patch_mode`), or
    `auto`: patches for scanners of very many beams."""
    site: Site = field(default_factory=Site)
    refine: bool = True
    """Look for better places off the grid once stations are chosen (method `proven`)."""
    seconds_per_scan: float | None = None
    """None: as the scanner's mode says."""
    set_up_s: float = 60.0
    walking_m_per_s: float = 1.0


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

"""The problem: settings, the scene made ready, and where stations may stand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from planner_core.documents import Number, Whole, YesNo, document
from planner_core.errors import RequirementError
from planner_core.model.arrays import BoolArray, FloatArray, Int32Array, Int64Array
from planner_core.model.choices import (
    Objective,
    OverlapMeasure,
    OverlapOf,
    PreAlignment,
    Role,
    Scope,
    VisibilityMode,
    one_of,
)
from planner_core.model.methods import METHODS, Greedy, Method, Paper, Proven
from planner_core.model.requirements import Requirements
from planner_core.model.scans import BeamTemplate, Scanner
from planner_core.model.scene import Floor, Patches, Scene
from planner_core.model.site import Site
from planner_core.model.values import Count, ObjectiveWord

# --------------------------------------------------------------------------------------------------------------- scope
# What of the building a survey is about: its inside, its outside, or all.

#: Positions farther than this from all walkable ground are neither indoors nor outdoors.
_NEAR_M = 1.0
#: Heights count twice: the ground of the storey above is not the nearest.
_HEIGHT_WEIGHT = 2.0


@dataclass(frozen=True)
class SurveyScope:
    """Which patches may count, and where stations may stand.

    kind : what was found, never `auto`. in_scope : (P,) bool, patches of that kind, but for those of which nothing is
    required. observed : (P,) bool, those that anybody looks at: in scope, and outdoors where stations of the interior
    may stand there to join it, which is `outdoors_m` from rooms at most; 0: they may not. ground_m : (K, 3) float64,
    local, walkable places; indoors : (K,) bool, whether each is indoors; both empty where all is in scope.
    """

    kind: Scope
    in_scope: BoolArray
    observed: BoolArray
    ground_m: FloatArray
    indoors: BoolArray
    outdoors_m: float = 0.0

    def surveys(self, ground_m: FloatArray) -> BoolArray:
        """(N,) bool: whether ground (N, 3), local frame, is on the side that is surveyed."""
        if self.kind == Scope.ALL:
            return np.ones(ground_m.shape[0], dtype=np.bool_)
        is_there, nearest = self._near(ground_m, self.ground_m, _NEAR_M)
        is_there[is_there] = self.indoors[nearest[is_there]] == (self.kind == Scope.INTERIOR)
        return is_there

    def admits(self, ground_m: FloatArray) -> BoolArray:
        """(N,) bool: whether stations may stand over ground (N, 3), local frame."""
        admitted = self.surveys(ground_m)
        if self.outdoors_m:
            is_ground, _ = self._near(ground_m, self.ground_m, _NEAR_M)
            is_beside, _ = self._near(ground_m, self.ground_m[self.indoors], self.outdoors_m)
            admitted |= is_ground & is_beside
        return admitted

    @staticmethod
    def _near(ground_m: FloatArray, places_m: FloatArray, within_m: float) -> tuple[BoolArray, Int64Array]:
        """(N,) whether one of places (K, 3) is near, and the nearest."""
        from scipy.spatial import cKDTree

        weight = np.array([1.0, 1.0, _HEIGHT_WEIGHT])
        _, nearest = cKDTree(places_m * weight).query(ground_m * weight, distance_upper_bound=within_m)
        return nearest < places_m.shape[0], nearest


# ------------------------------------------------------------------------------------------------------------ planning
#: No mast is longer; a larger figure is a slip in its unit.
MAX_INSTRUMENT_HEIGHT_M = 100.0


@dataclass(frozen=True)
class Candidates:
    """Admissible sensor positions that nobody has chosen yet.

    position_m : (N, 3) float64, local, the sensor's origin. floor : (N,) int32 into the floors.
    instrument_height_m : (N,) float64 above the ground below. n_tried : grid points tried;
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


LOWERING_STEP_M = 0.1
"""In steps of this a tripod is lowered: a crew reads its legs no finer."""


@dataclass(frozen=True)
class InstrumentHeights:
    """How high above the ground the scanner may be, metres.

    fixed_m : the only heights there are, lowest first: those given, or the one that crews set up; empty: any from
    `low_m` to `high_m`, the scanner's range. is_ordered : the user gave them, so that no room is too low for another.
    """

    fixed_m: tuple[float, ...]
    low_m: float
    high_m: float
    step_m: float
    is_ordered: bool = False

    @property
    def lowered_m(self) -> tuple[float, ...]:
        """Heights for rooms that are too low for the one that crews set up, highest first."""
        if self.is_ordered or not self.fixed_m:
            return ()
        n_steps = math.floor((self.fixed_m[0] - self.low_m) / LOWERING_STEP_M + 1e-9)
        return tuple(self.fixed_m[0] - LOWERING_STEP_M * step for step in range(1, n_steps + 1))

    @property
    def to_try_m(self) -> tuple[float, ...]:
        """Heights of candidates, lowest first: the fixed ones, or the range in steps."""
        if self.fixed_m:
            return self.fixed_m
        n_steps = math.floor((self.high_m - self.low_m) / self.step_m + 1e-9)
        return tuple(self.low_m + self.step_m * step for step in range(n_steps + 1))


@dataclass(frozen=True)
class Crew:
    """How fast a crew is. scan_s : None where nobody knows; set_up_s : a station, besides; walking_m_per_s."""

    scan_s: float | None
    set_up_s: float
    walking_m_per_s: float


@document
@dataclass(frozen=True, kw_only=True)
class PlanParameters:
    """What decides a plan besides scene, scanner, requirements, method and site."""

    objective: ObjectiveWord = Objective.FEWEST
    """What the plan is best in."""
    grid_step_m: Number = 0.5
    instrument_heights_m: tuple[Number, ...] = ()
    """Heights to try; empty: what crews set the scanner's tripod to, else its range in steps of `height_step_m`."""
    height_step_m: Number = 0.4
    clearance_m: Number = 0.4
    ground_ring_radius_m: Number = 0.2
    n_ground_ring_rays: Count = 16
    max_patch_area_m2: Number = 0.04
    scan_mode: VisibilityMode = VisibilityMode.AUTO
    special_places: YesNo = True
    """Doorways, middles of rooms and landings are candidates besides the grid."""
    refine: YesNo = True
    """Look for better places off the grid once stations are chosen (method `proven`)."""
    max_stations: Whole | None = None
    """Of objective `coverage`, at most."""
    seconds_per_scan: Number | None = None
    """None: that of the scanner's mode."""
    set_up_s: Number = 60.0
    """Levelling a tripod, checking the battery, starting the scan."""
    set_up_tolerance_m: Number = 0.1
    """Crews set up within this of a mark in plan, and half of it in height: links hold wherever they do. 0: exactly."""
    walking_m_per_s: Number = 1.0
    """At a stroll, with a tripod over the shoulder."""


def fields_of(kind: type[Any], value: object) -> dict[str, Any]:
    """Return the values that `value` has of the fields of a dataclass, by name."""
    return {field.name: getattr(value, field.name) for field in fields(kind)}


@dataclass(frozen=True)
class PlanSettings(PlanParameters):
    """Everything that decides a plan besides the scene: same scene, same settings, same plan, byte for byte.

    Settings that make no sense raise a `RequirementError` of one line when they are made.
    """

    scanner: Scanner
    requirements: Requirements = field(default_factory=Requirements)
    method: Method = field(default_factory=Proven)
    """`Greedy`, `Proven` or `Paper`, with its own settings."""
    seed: int = 0
    site: Site = field(default_factory=Site)

    def __post_init__(self) -> None:
        if type(self.method) not in METHODS.values():
            known = ", ".join(f"{kind.__name__}()" for kind in METHODS.values())
            raise RequirementError(f"method: got {self.method!r}, expected one of {known}; its settings are its own")
        object.__setattr__(self, "scan_mode", one_of(VisibilityMode, self.scan_mode, "scan_mode"))
        object.__setattr__(self, "objective", one_of(Objective, self.objective, "objective"))
        self._check_figures()
        self._check_method()
        self._check_scanner()

    @property
    def seeded_method(self) -> Method:
        """The method with the plan's seed, heights and range where it has none of its own."""
        if isinstance(self.method, Proven):
            return replace(self.method, seed=self.seed) if self.method.seed is None else self.method
        if isinstance(self.method, Greedy):
            return self.method
        spatial, genetic = self.method.spatial, self.method.genetic
        one_height = len(self.heights.fixed_m) == 1
        return replace(
            self.method,
            overlap_radius_m=self.method.overlap_radius_m or self.scanner.range_max_m,
            spatial=replace(
                spatial,
                seed=self.seed if spatial.seed is None else spatial.seed,
                fixed_height=one_height if spatial.fixed_height is None else spatial.fixed_height,
            ),
            genetic=replace(genetic, seed=self.seed if genetic.seed is None else genetic.seed),
        )

    @property
    def pre_alignment(self) -> PreAlignment:
        """Where registration starts: as required, else as the scanner has it."""
        return self.requirements.start_of(self.scanner)

    @property
    def crew(self) -> Crew:
        """How fast the crew is; a scan takes as long as given, else as in the scanner's mode."""
        scan_s = self.scanner.seconds_per_scan if self.seconds_per_scan is None else self.seconds_per_scan
        return Crew(scan_s, self.set_up_s, self.walking_m_per_s)

    @property
    def heights(self) -> InstrumentHeights:
        """Heights of the instrument."""
        scanner = self.scanner
        usual_m = scanner.instrument_height_usual_m
        usual = () if usual_m is None or isinstance(self.method, Paper) else (usual_m,)
        return InstrumentHeights(
            fixed_m=tuple(sorted(set(self.instrument_heights_m))) or usual,
            low_m=scanner.instrument_height_min_m,
            high_m=scanner.instrument_height_max_m,
            step_m=self.height_step_m,
            is_ordered=bool(self.instrument_heights_m),
        )

    def _check_figures(self) -> None:
        for name in ("grid_step_m", "height_step_m", "max_patch_area_m2"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise RequirementError(f"{name}: got {value:g}, expected more than 0; leave it out for the default")
        for name in ("clearance_m", "ground_ring_radius_m", "set_up_tolerance_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise RequirementError(f"{name}: got {value:g}, expected 0 or more; leave it out for the default")
        if self.n_ground_ring_rays < 1:
            raise RequirementError(f"n_ground_ring_rays: got {self.n_ground_ring_rays}, expected at least 1; e.g. 16")
        for height in self.instrument_heights_m:
            if not 0 < height <= MAX_INSTRUMENT_HEIGHT_M:
                raise RequirementError(
                    f"instrument height: got {height:g} m, expected more than 0 and at most "
                    f"{MAX_INSTRUMENT_HEIGHT_M:g} m above the ground; give e.g. 1.6"
                )
        for what, seconds in (("seconds per scan", self.crew.scan_s), ("set-up seconds", self.set_up_s)):
            if seconds is not None and not (math.isfinite(seconds) and seconds >= 0):
                raise RequirementError(f"{what}: got {seconds:g}, expected 0 or more; e.g. 60")
        if not (math.isfinite(self.walking_m_per_s) and self.walking_m_per_s > 0):
            raise RequirementError(
                f"walking speed: got {self.walking_m_per_s:g} m/s, expected more than 0; give e.g. 1"
            )

    def _check_method(self) -> None:
        """Refuse what the method does not do."""
        name, objective, prior = self.method.name, self.objective, self.site.prior
        if isinstance(self.method, Paper):
            if any(station.role != Role.FORBIDDEN for station in prior):
                raise RequirementError(
                    "scanned, locked or kept stations: got them with method paper, which takes none; use method proven"
                )
            if max([self.requirements.seen_from, *(part.seen_from for part in self.requirements.parts)]) > 1:
                raise RequirementError(
                    "seen_from: got more than 1 with method paper, which has no such requirement; use proven"
                )
            measured = self.requirements.overlap_measure, self.requirements.overlap_of
            if measured != (OverlapMeasure.SMALLER_SHARE, OverlapOf.ALL_SEEN):
                raise RequirementError(
                    f"overlap: got the measure {measured[0]} of {measured[1]} with method paper, which measures by "
                    "circles, expected neither; leave both out, or use method proven"
                )
        is_proven = isinstance(self.method, Proven)
        if objective != Objective.FEWEST and not is_proven:
            raise RequirementError(
                f"objective {objective}: got it with method {name}, which only looks for fewest stations; use method "
                "proven"
            )
        n_most = self.max_stations
        if (objective == Objective.COVERAGE) != (n_most is not None):
            raise RequirementError(
                f"objective {objective}: got {'no' if n_most is None else n_most} stations as its limit, expected one "
                "with objective coverage and none otherwise; give both, such as coverage and 10 stations, or neither"
            )
        if n_most is not None and n_most < 1:
            raise RequirementError(f"max_stations: got {n_most}, expected 1 or more; e.g. 10")
        if any(station.role == Role.KEPT for station in prior) and not (is_proven and objective == Objective.FEWEST):
            raise RequirementError(
                f"kept stations: got them with method {name} and objective {objective}, which would not keep them; use "
                "method proven and objective fewest"
            )

    def _check_scanner(self) -> None:
        """Refuse what the scanner's figures do not tell."""
        if self.requirements.limits_noise and not self.scanner.range_noise:
            required_by = self.requirements.deliverable
            raise RequirementError(
                f"noise: got a limit{f' of deliverable {required_by}' if required_by else ''} with scanner "
                f"{self.scanner.name}, expected one with a table of range noise; give a scanner file of your own with "
                "range_noise, or noise 'any' (--max-noise any), range and incidence limited instead"
            )
        if self.objective == Objective.TIME and self.crew.scan_s is None:
            raise RequirementError(
                f"seconds per scan: got none, and scanner {self.scanner.name!r} does not give them, expected them for "
                "a plan of least time; give e.g. 120"
            )


@dataclass(frozen=True)
class Survey:
    """The problem: a scene made ready for planning."""

    scene: Scene
    floors: tuple[Floor, ...]
    patches: Patches
    floor_of_triangle: Int32Array
    """(T,) int32 into floors: the level whose coverage figure a triangle counts for; -1 none."""
    template: BeamTemplate
    """The beams of one scan of `scanner`."""
    scanner: Scanner
    scan_mode: VisibilityMode
    """How positions look around: by `BEAMS` or by `PATCHES`."""
    planned: tuple[int, ...]
    """Floors that are planned, as indices into `floors`."""
    reflectivity: float = 0.8
    """Of the surfaces, for range noise."""
    warnings: tuple[str, ...] = ()
    """One line each, for the user: warnings of finding the floors."""
    scope: SurveyScope | None = None
    """None: all of the building, see `planner_core.requirements.scope`."""
    as_in_paper: bool = False
    """Whether patches are seen as in the method paper: whole or not at all, and ground that is a single plane from the
    room below, too."""

    @property
    def counts_parts(self) -> bool:
        """Whether it is counted how much of a patch is seen, which samples tell."""
        return self.scan_mode == VisibilityMode.PATCHES and not self.as_in_paper

    @property
    def patches_observed(self) -> BoolArray | None:
        """(P,) bool: patches that visibility is computed of; the others only occlude. None: all are."""
        return None if self.scope is None or self.scope.observed.all() else self.scope.observed

"""Whether a tripod can stand at a position: ground below it and around, nothing in its way, a building about it.

Local frame, metres. The tests run in order of cost, each on what the ones before left over:

    headroom   nothing within 0.2 m above the sensor
    below      the first surface straight down is ground of the floor (no slab: nothing above its elevation)
    ring       so it is for the tripod's feet, on a ring around
    clearance  nothing nearer than `clearance_m` in eight directions, at three heights from shins to sensor; between
               jambs, and in passages, 0.1 m less
    open air   not under open sky, where most of the floor is covered and the interior is surveyed

On a flight of stairs the legs have different lengths: feet stand further apart (`TREADS`), each on a tread of its own.

Where none stands anywhere, `refusals_in_words` has the causes and what helps. A position counts for the first cause
that it meets: tests of the place come before what the site rules out, so that a tripod could stand at the latter.

References
----------
López et al. 2023, section 3.3: ground below, a ring of rays, four rays of clearance at the sensor. Ours look in eight
directions at three heights, since a table or a railing is lower than the sensor.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from planner_core.engine.scan_engine import ScanEngine
from planner_core.model import (
    BoolArray,
    FloatArray,
    Floor,
    InstrumentHeights,
    Int32Array,
    PlanSettings,
    RayHits,
    Scope,
    Survey,
)
from planner_core.model.arrays import area_normals, bounds_of, lengths
from planner_core.positions.ground_surface import GroundSurface, grid_on_ground
from planner_core.positions.local_site import PERSON
from planner_core.progress import Progress, ProgressEvent, silent

#: Room for the hand and the instrument's carrying handle.
HEADROOM_M = 0.2
#: Ground under the feet may differ this much from that under the sensor; a ledge is deeper.
MAX_STEP_M = 0.15
#: The lowest level of the clearance test: over thresholds and rugs.
SHIN_M = 0.2
#: Triangles within these of a place on ground that is no floor's are what a tripod there stands on.
_LEVEL_M, _AROUND_M = 0.02, 0.6
#: A height counts as ground if it is this near; float32 ranges of tens of metres are good to micrometres.
_SLACK_M = 0.01
#: Nearer to the ground's plane than any object is high.
_FLUSH_M = 0.002
#: What people climb in one step, and a little more: a cell of free space lies over two treads at most.
_CELL_RISE_M = 0.25
#: Free rays a batch; bounds memory on devices.
_RAYS = 400_000
#: Of 16 horizontal directions, this share has to end at something for a place without slab to be indoors. Outside a
#: corner of an L-shaped house three quarters do at most.
_ENCLOSED_SHARE = 0.8
_BODY_DIRECTIONS = 8
#: Less than the clearance, in passages that are no wider than twice of it: crews set up in a door of 0.7 m.
_PASSAGE_LESS_M = 0.1
#: Directions are turned this much off the axes and diagonals of the grid: a ray in the plane of a wall or a mitre meets
#: it or not by rounding, and Embree has been seen to report such a plane at range 0. At 0.4 m it is 3 mm.
_OFF_AXIS_RAD = 0.0071
_ENCLOSURE_DIRECTIONS = 16
_UP, _DOWN = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])
NO_GROUND = "no ground of this floor below"
_TOO_LOW = "too little headroom"
_BLOCKED = "something between sensor and ground"
_UNEVEN = "uneven or no ground around"
_TOO_CLOSE = "too close to something"
OUTSIDE = "outside the building"
IN_KEEP_OUT = "in a keep-out"
FORBIDDEN = "at a forbidden position"
OUT_OF_SCOPE = "out of scope"
UNREACHABLE = "not reachable on foot"
#: What the site rules out of the positions at which a tripod could stand.
_OF_SITE = {
    IN_KEEP_OUT: "leave some of the floor out of the keep-outs",
    FORBIDDEN: "give forbidden positions a smaller radius (--forbid)",
    OUT_OF_SCOPE: "plan the whole model (--scope all)",
    UNREACHABLE: "give an entrance on the ground there (--entrance)",
}
#: What a place lacks. Walls around a plane are counted by horizontal beams, a roof over slabs by vertical ones.
_OF_PLACE = {
    NO_GROUND: "the ground lies between the points of the grid: use a finer grid (--grid)",
    _TOO_LOW: "give a lower instrument height (--height)",
    _BLOCKED: "elements fill the space above the ground: check that they do not lie in each other, or leave a class of "
    "them out (--leave-out)",
    _UNEVEN: "the ground is narrower than a tripod, or in steps: load the file that has the slabs, or mark a larger "
    "surface as ground (docs/howto/pick-ground.md)",
    _TOO_CLOSE: "give less clearance (--clearance), or a finer grid (--grid)",
}
_NOT_ENCLOSED = "walls enclose nothing there: load the file that has all walls of the floor"
_IN_THE_OPEN = "it lies under open sky beside ground under a roof: plan the outside (--scope exterior)"


@dataclass(frozen=True)
class Feet:
    """How a tripod stands.

    ring_radius_m : of its feet. rise_m : of the ground of a foot, at most, over or under that below the sensor.
    n_rays, apart : directions in which ground is searched for; it has to be in all that are so many directions apart,
    for one turn of the tripod. clear_from_m : above the ground; what lies lower is no obstacle.
    """

    ring_radius_m: float
    rise_m: float
    n_rays: int
    apart: int
    clear_from_m: float


#: On a flight: the legs of survey tripods extend by 0.6 m and more, and spread to 0.35 m at eye height. At 0.35 m the
#: treads of 45 degrees rise by 0.35 m and one riser at most. The upper treads are no obstacle to the legs beside them.
TREADS = Feet(ring_radius_m=0.35, rise_m=0.5, n_rays=12, apart=4, clear_from_m=0.7)


@dataclass
class RefusalTally:
    """How many positions were tried, and why some were refused."""

    n_tried: int = 0
    rejected: dict[str, int] = field(default_factory=dict)

    def refuse(self, reason: str, number: int) -> None:
        """Count positions refused for `reason`."""
        if number:
            self.rejected[reason] = self.rejected.get(reason, 0) + number


@dataclass(frozen=True)
class _Tops:
    """Some triangles by their highest point. number : (K,) int32. low_m, high_m : (K, 3) of their bounds."""

    number: Int32Array
    low_m: FloatArray
    high_m: FloatArray

    @classmethod
    def of(cls, corners_m: FloatArray, which: BoolArray) -> _Tops:
        """Take those `which`, (N,) bool, of triangles (N, 3, 3)."""
        number = np.flatnonzero(which)
        low_m, high_m = bounds_of(corners_m[number])
        order = np.argsort(high_m[:, 2], kind="stable")
        return cls(number[order].astype(np.int32), low_m[order], high_m[order])

    def around(self, place_m: FloatArray, rise_m: float) -> Int32Array:
        """Triangles at a place (3,) on the ground whose tops are `rise_m` higher or lower at most."""
        first = int(np.searchsorted(self.high_m[:, 2], place_m[2] - rise_m))
        end = int(np.searchsorted(self.high_m[:, 2], place_m[2] + rise_m, side="right"))
        low_m, high_m = self.low_m[first:end, :2], self.high_m[first:end, :2]
        near = ((low_m <= place_m[:2] + _AROUND_M) & (high_m >= place_m[:2] - _AROUND_M)).all(axis=1)
        return self.number[first:end][near]


class Tripods:
    """A survey's tripod: how high it sets the scanner, where to try it, and where on each floor it can stand.

    Its figures are those of `PlanSettings`. Tests and ground of a floor are computed when first needed, and kept.
    """

    def __init__(self, survey: Survey, settings: PlanSettings, engine: ScanEngine) -> None:
        self.survey, self.engine = survey, engine
        self.heights, self.grid_step_m, self.clearance_m = settings.heights, settings.grid_step_m, settings.clearance_m
        self.special_places = settings.special_places
        self.ring_radius_m, self.n_ring_rays = settings.ground_ring_radius_m, settings.n_ground_ring_rays
        self._tests: dict[int, TripodTests] = {}
        self._ground: dict[int, GroundSurface] = {}

    def on_floor(self, floor: int) -> Tripods:
        """Return the tripods of one floor alone, by its index."""
        alone = copy(self)
        alone.survey = replace(self.survey, planned=(floor,))
        return alone

    def tests(self, floor: int) -> TripodTests:
        """Return the tests on a floor, by its index."""
        if floor not in self._tests:
            self._tests[floor] = TripodTests(self, self.survey.floors[floor])
        return self._tests[floor]

    def ground(self, floor: int) -> GroundSurface:
        """Return the ground of a floor, by its index."""
        if floor not in self._ground:
            self._ground[floor] = GroundSurface(self.survey, self.survey.floors[floor])
        return self._ground[floor]

    def climbed_ground_m(self, place_m: FloatArray) -> FloatArray:
        """(K,) heights of what is walked on at places (K, 3) that are true to a cell of free space: treads, ramps."""
        above_m = place_m + np.array([0.0, 0.0, _CELL_RISE_M])
        down = np.broadcast_to(_DOWN, above_m.shape)
        found_m = self.engine.cast_rays(above_m, down, range_max_m=2.0 * _CELL_RISE_M).range_m
        return np.where(np.isfinite(found_m), above_m[:, 2] - found_m, place_m[:, 2])

    @cached_property
    def level_tops(self) -> _Tops:
        """Triangles that lie level."""
        corners_m = self._corners_m()
        return _Tops.of(corners_m, np.ptp(corners_m[:, :, 2], axis=1) <= _LEVEL_M)

    @cached_property
    def walked_tops(self) -> _Tops:
        """Triangles that are no steeper than what people walk up."""
        corners_m = self._corners_m()
        cross = area_normals(corners_m)
        length = lengths(cross)
        return _Tops.of(corners_m, (length > 0) & (np.abs(cross[:, 2]) >= np.cos(PERSON.max_slope_rad) * length))

    def _corners_m(self) -> FloatArray:
        corners_m: FloatArray = self.survey.scene.vertices_m[self.survey.scene.triangles]
        return corners_m

    def reject(
        self,
        floor: int,
        position_m: FloatArray,
        ground_m: FloatArray,
        on_floor: BoolArray,
        *,
        treads: bool = True,
    ) -> tuple[BoolArray, dict[str, int]]:
        """Test positions (N, 3) over ground at heights (N,), also where it is not the floor's own.

        Thresholds between slabs, landings and treads of stairs are ground of no floor: around places that are not
        `on_floor`, (N,) bool, what is level is ground, and where that is not enough, and `treads` is set, so is what
        is climbed to.

        Returns
        -------
        As `TripodTests.reject`.
        """
        place_m = np.column_stack([position_m[:, :2], ground_m])
        tests = self.tests(floor)
        level = tests.with_ground_around(place_m[~on_floor])
        kept, reasons = level.reject(position_m, ground_m)
        on_stairs = np.flatnonzero(~kept & ~on_floor)
        if treads and on_stairs.size:
            stand, _ = tests.with_ground_around(place_m[on_stairs], TREADS).reject(
                position_m[on_stairs], ground_m[on_stairs]
            )
            if stand.any():
                kept[on_stairs[stand]] = True
                _, reasons = level.reject(position_m[~kept], ground_m[~kept])
        return kept, reasons


class TripodTests:
    """The tests on one floor of a survey.

    A floor that is open for the most part (no roof in the model) is taken as it is; of any other, what lies under open
    sky is outside.
    """

    def __init__(self, tripods: Tripods, floor: Floor) -> None:
        self._tripods, self._engine, self._floor = tripods, tripods.engine, floor
        scene = tripods.survey.scene
        # Axis by axis: along rows NumPy takes 25 times as long.
        extent_m = [np.ptp(along) for along in scene.vertices_m.T]
        self._reach_m = float(np.linalg.norm(extent_m)) + 1.0  # longer than any line through the scene
        self._is_ground = np.zeros(scene.n_triangles + 1, dtype=bool)  # the last entry is the miss, -1
        self._is_ground[floor.ground_triangles] = True
        self._has_slab = not _stands_on_plane(floor)
        self._feet = Feet(tripods.ring_radius_m, MAX_STEP_M, tripods.n_ring_rays, 1, SHIN_M)
        self._mostly_covered = self._has_slab and self._is_mostly_covered()

    def with_ground_around(self, place_m: FloatArray, feet: Feet | None = None) -> TripodTests:
        """Return the tests where what places on the ground (K, 3) lie in is ground of the floor, too.

        Without `feet` it is what is level with them; on `feet` of unequal height, what these can stand on.
        """
        other = copy(self)
        if feet is not None:
            other._feet = feet
        if not place_m.shape[0]:
            return other
        tops = self._tripods.level_tops if feet is None else self._tripods.walked_tops
        rise_m = _LEVEL_M if feet is None else feet.rise_m
        other._is_ground = self._is_ground.copy()
        for place in place_m:
            other._is_ground[tops.around(place, rise_m)] = True
        return other

    def keep(
        self, position_m: FloatArray, ground_m: FloatArray, tally: RefusalTally, progress: Progress = silent
    ) -> BoolArray:
        """(N,) bool: where a tripod can stand, of positions (N, 3) over ground at heights (N,); counted in the tally.

        A position without ground has NaN for its height.
        """
        kept = ~np.isnan(ground_m)
        tally.n_tried += kept.size
        tally.refuse(NO_GROUND, int(np.count_nonzero(~kept)))
        kept[kept], reasons = self.reject(position_m[kept], ground_m[kept], progress)
        for reason, number in reasons.items():
            tally.refuse(reason, number)
        return kept

    def reject(
        self, position_m: FloatArray, ground_m: FloatArray, progress: Progress = silent
    ) -> tuple[BoolArray, dict[str, int]]:
        """Test positions (N, 3) over ground at heights (N,).

        Returns
        -------
        (N,) bool, True where a tripod can stand; and how many were refused, by reason. A position refused by one test
        is not counted by the next.
        """
        tests = (
            (_TOO_LOW, self._lacks_headroom),
            (_BLOCKED, self._lacks_ground),
            (_UNEVEN, self._lacks_ring),
            (_TOO_CLOSE, self._lacks_clearance),
            (OUTSIDE, self._is_outside),
        )
        kept = np.ones(position_m.shape[0], dtype=bool)
        reasons: dict[str, int] = {}
        for number, (reason, test) in enumerate(tests):
            left = np.flatnonzero(kept)
            bad = left[test(position_m[left], ground_m[left])]
            kept[bad] = False
            if bad.size:
                reasons[reason] = int(bad.size)
            progress(ProgressEvent("candidates", number + 1, len(tests), self._floor.name))
        return kept, reasons

    def lacks_headroom(self, position_m: FloatArray) -> BoolArray:
        """(N,) bool: whether something hangs too low over positions (N, 3)."""
        return self._hits_any(position_m, _UP, HEADROOM_M)

    # Each takes positions (K, 3) and ground heights (K,), gives (K,) bool, True = refused.
    def _lacks_headroom(self, position_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        del ground_m
        return self.lacks_headroom(position_m)

    def _lacks_ground(self, position_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        return ~self._stands(position_m, position_m[:, 2] - ground_m, _SLACK_M)

    def _lacks_ring(self, position_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        ring = _circle(self._feet.n_rays) * self._feet.ring_radius_m
        feet = (position_m[:, None, :] + ring).reshape(-1, 3)
        height = np.repeat(position_m[:, 2] - ground_m, ring.shape[0])
        stands = self._stands(feet, height, self._feet.rise_m)
        # Axes: position, leg, turn. On level ground there is one turn with as many legs as directions.
        apart = self._feet.apart
        lacks = np.any((~stands).reshape(-1, ring.shape[0] // apart, apart), axis=1)
        return np.asarray(np.all(lacks, axis=1))

    def _lacks_clearance(self, position_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        clearance_m = self._tripods.clearance_m
        narrow_m = clearance_m - _PASSAGE_LESS_M
        nearest_m = np.full((position_m.shape[0], _BODY_DIRECTIONS), np.inf)
        height = position_m[:, 2] - ground_m
        for share in (0.0, 0.5, 1.0):  # of the way from the shins up to the sensor
            level = position_m.copy()
            low = np.minimum(self._feet.clear_from_m, height)
            level[:, 2] = ground_m + low + share * (height - low)
            left = np.flatnonzero((nearest_m > narrow_m).all(axis=1))
            hits = self._cast(level[left], _circle(_BODY_DIRECTIONS), clearance_m)
            range_m = hits.range_m.astype(np.float64).reshape(-1, _BODY_DIRECTIONS)
            nearest_m[left] = np.fmin(nearest_m[left], range_m)
        near = np.isfinite(nearest_m)
        return np.asarray(near.any(axis=1) & ~(_in_passage(near) & (nearest_m > narrow_m).all(axis=1)))

    def _is_outside(self, position_m: FloatArray, ground_m: FloatArray) -> BoolArray:
        del ground_m
        scope = self._tripods.survey.scope
        if scope is not None and scope.outdoors_m:  # which ground that is depends on rooms, see `SurveyScope.admits`
            return np.zeros(position_m.shape[0], dtype=bool)
        if not self._has_slab:
            hits = self._cast(position_m, _circle(_ENCLOSURE_DIRECTIONS), self._reach_m)
            ends = np.isfinite(hits.range_m).reshape(-1, _ENCLOSURE_DIRECTIONS)
            return np.asarray(ends.mean(axis=1) < _ENCLOSED_SHARE)
        if not self._mostly_covered or (scope is not None and scope.kind != Scope.INTERIOR):
            return np.zeros(position_m.shape[0], dtype=bool)
        return ~self._hits_any(position_m, _UP, self._reach_m)

    def _is_mostly_covered(self) -> bool:
        plan_m, ground_m, _ = grid_on_ground(self._tripods.survey, self._floor, self._tripods.grid_step_m)
        if not ground_m.size:
            return False
        over = np.column_stack([plan_m, ground_m + _SLACK_M])
        up = np.broadcast_to(_UP, over.shape)
        return bool(np.isfinite(self._engine.cast_rays(over, up, range_max_m=self._reach_m).range_m).mean() >= 0.5)

    def _stands(self, position_m: FloatArray, height_m: FloatArray, slack_m: float) -> BoolArray:
        """Tell whether ground is the first thing straight below, `height_m` down."""
        hits = self._cast(position_m, _DOWN, self._reach_m)
        with np.errstate(invalid="ignore"):
            off_m = np.abs(hits.range_m - height_m)
            # Undersides of cabinets and doors often lie in the ground's plane, and engines differ in which of two
            # equal hits they report: what is flush with the ground counts as ground.
            # Where a plane stands for a slab, one of another kind at that height is ground just as well.
            is_ground = self._is_ground[hits.triangle] | (not self._has_slab)
            return (is_ground & (off_m <= slack_m)) | (off_m <= _FLUSH_M)

    def _hits_any(self, position_m: FloatArray, directions: FloatArray, range_max_m: float) -> BoolArray:
        hits = self._cast(position_m, directions, range_max_m)
        return np.asarray(np.isfinite(hits.range_m).reshape(-1, directions.shape[0]).any(axis=1))

    def _cast(self, position_m: FloatArray, directions: FloatArray, range_max_m: float) -> RayHits:
        """Every direction from every position, position by position."""
        n_each = max(1, _RAYS // directions.shape[0])
        ranges, triangles = [np.empty(0, np.float32)], [np.empty(0, np.int32)]
        for start in range(0, position_m.shape[0], n_each):
            part = position_m[start : start + n_each]
            origins = np.repeat(part, directions.shape[0], axis=0)
            hits = self._engine.cast_rays(origins, np.tile(directions, (part.shape[0], 1)), range_max_m=range_max_m)
            ranges.append(hits.range_m)
            triangles.append(hits.triangle)
        return RayHits(range_m=np.concatenate(ranges), triangle=np.concatenate(triangles))


def refusals_in_words(rejected: dict[str, int], floors: list[Floor], heights: InstrumentHeights | None = None) -> str:
    """Each cause with its number of positions, most first, and what helps against the one that decides.

    It is the largest cause of the site's, where a tripod could stand, else the largest of the place's. Points of a grid
    beside the floor have no ground below: that decides only where it is the only cause. Above what tripods reach, a
    height that was given is the first thing to change.
    """
    largest_first = sorted(rejected, key=lambda cause: (cause == NO_GROUND, -rejected[cause]))
    has_plane = any(map(_stands_on_plane, floors))
    remedies = {**_OF_SITE, **_OF_PLACE, OUTSIDE: _NOT_ENCLOSED if has_plane else _IN_THE_OPEN}
    of_site = [cause for cause in largest_first if cause in _OF_SITE]
    deciding = (of_site or largest_first or [NO_GROUND])[0]
    n_free = sum(rejected[cause] for cause in of_site)
    where = f"of {n_free} where a tripod could stand, {rejected[deciding]} are {deciding}" if of_site else deciding
    counts = ", ".join(f"{cause}: {rejected[cause]}" for cause in largest_first)
    remedy = remedies[deciding]
    if heights is not None and not of_site and heights.is_ordered and heights.fixed_m[0] > heights.high_m:
        remedy = (
            f"give a lower instrument height (--height): {heights.fixed_m[0]:g} m may be above the ceiling, and "
            f"tripods of this scanner stand at {heights.low_m:g} to {heights.high_m:g} m"
        )
    return f"({counts}); {where}: {remedy}"


def _stands_on_plane(floor: Floor) -> bool:
    """Whether a plane stands for the floor's slab, and not for ground beside it."""
    return floor.origin not in ("slab", "surface") and floor.plane_m.size > 0


def _in_passage(near: BoolArray) -> BoolArray:
    """(N,) bool: where something is near, (N, 8) by direction, on both sides of a line that is free."""
    found = np.zeros(near.shape[0], dtype=bool)
    for along in range(_BODY_DIRECTIONS // 2):
        ahead, left, behind, right = np.roll(near, -along, axis=1)[:, :: _BODY_DIRECTIONS // 4].T
        found |= ~ahead & ~behind & left & right
    return found


def _circle(n: int) -> FloatArray:
    """(n, 3) horizontal unit vectors, evenly from nearly +x."""
    angle = _OFF_AXIS_RAD + np.arange(n) * (2.0 * np.pi / n)
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])

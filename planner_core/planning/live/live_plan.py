"""The live plan: a plan folder's scene, engine and figures held ready, so that a moved station is answered at once.

Input what a plan folder holds; output, for any `Draft`, the figures of a plan, and for a dragged station a `Preview`.
Everything is a function of the draft: what is remembered between calls makes them fast and changes no answer. One call
at a time: it is not made for several threads.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner_core.coverage.why import steepest_curve
from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import RequirementError
from planner_core.model import BeamTemplate, CurveStep, FieldTime, Plan, PlanSettings, Route, Survey, UInt8Array
from planner_core.network.links import least_listed_overlap
from planner_core.plan_folder.viewer_layers import (
    UInt16Array,
    cloud_bytes,
    layers_of,
    lost_bytes,
    packed_cloud,
    seen_bytes,
)
from planner_core.planning.live.draft import Draft, DraftStation, Place, local_place
from planner_core.planning.live.figures import (
    TIMES_SEEN,
    LeftSurface,
    layer_named,
    left_surfaces,
    links_as_scanned,
    links_by_targets,
    plan_of,
    registration_of,
    times_seen_bytes,
)
from planner_core.planning.live.pairs import PairFinder
from planner_core.planning.live.preview import Preview, Standing, coverages, differing
from planner_core.planning.live.station_observations import StationObserver, rows_of
from planner_core.planning.live.tally import CoverageAreas, Tally, changed, coverage_areas, covered_area_m2, figure_of
from planner_core.planning.live.tripod_positions import GroundMap, TripodPosition, TripodPositions
from planner_core.positions.admissibility import Tripods
from planner_core.positions.local_site import ends_of, floor_named, local_site
from planner_core.positions.reach import Reach
from planner_core.progress import Progress, silent
from planner_core.requirements.compliance import losses_of, rows_of_quality
from planner_core.requirements.demand import Demand
from planner_core.requirements.goals import Goal
from planner_core.requirements.observe_candidates import SeenPatches
from planner_core.route.route import field_time, plan_route
from planner_core.scanner.template import preview_template, window_template

#: Standings that are remembered: the draft's, the one without the station that is dragged, and those before them.
_KEPT_STANDINGS = 4
#: Of a part of a cloud: 3 bytes each.
CLOUD_BEAMS = 1_000_000
#: Id of a station that has none yet, as in the previews of a new one; no other has it.
NEW_ID = ""


@dataclass(frozen=True)
class DraftFigures:
    """plan : of the draft, without route, reasons and bound. curve : as of `Why`, the steepest first.

    unseen : what candidates could see and the draft does not, largest first.
    """

    plan: Plan
    curve: tuple[CurveStep, ...]
    unseen: tuple[LeftSurface, ...]


@dataclass(frozen=True)
class RouteResult:
    """The walk through a draft's stations, which takes seconds to find."""

    route: Route
    field_time: FieldTime


@dataclass(frozen=True)
class CloudWindow:
    """A part of a scan. template : of its beams. n_beams : that the scanner has in it. content : `cloud_bytes`."""

    template: BeamTemplate
    n_beams: int
    content: bytes


class LivePlan:
    """Answers for the drafts of one plan; made by `planner_core.planning.live.opening.open_live`.

    document, plan_sha256 : of plan.json. draft : of the plan as it is. layers : of figures, by id.
    """

    def __init__(
        self,
        document: dict[str, Any],
        plan_sha256: str,
        survey: Survey,
        settings: PlanSettings,
        engine: ScanEngine,
        demand: Demand,
        reach: Reach,
    ) -> None:
        self.document, self.plan_sha256 = document, plan_sha256
        self.survey, self.settings = survey, settings
        self.layers = {layer.id: layer for layer in layers_of(settings.scanner)}
        self._engine, self._demand, self._reach = engine, demand, reach
        self._area_m2 = survey.patches.area_m2
        self._achievable = demand.times_met[0] >= settings.requirements.seen_from
        self._parts: CoverageAreas = coverage_areas(survey, demand)
        self._observer = StationObserver(survey, engine, demand.goals.qualities)
        self.draft = _draft_of(document, survey)
        requirements = settings.requirements
        self._pairs = PairFinder(
            survey,
            self._area_m2,
            demand.times_met.max(axis=0) > 0,
            min_overlap=least_listed_overlap(requirements.overlap),
            measure=requirements.overlap_measure,
            of=requirements.overlap_of,
            pre_alignment=settings.pre_alignment,
        )
        self.tripods = Tripods(survey, settings, engine)
        site = local_site(survey, settings.site)
        self._tripod_positions = TripodPositions(self.tripods, site, reach, height_m=self._usual_height_m())
        self._standings: OrderedDict[tuple[DraftStation, ...], Standing] = OrderedDict()

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The requirements, in the order of plan.json's results and of `Preview.goals`."""
        return self._demand.goals.each

    @property
    def engine(self) -> ScanEngine:
        """What looks."""
        return self._engine

    @property
    def reach(self) -> Reach:
        """Where one can walk."""
        return self._reach

    @property
    def n_scans(self) -> int:
        """Positions that were scanned so far; what is remembered does not count."""
        return self._observer.n_scans

    # ------------------------------------------------------------------------------------------ figures
    def figures(self, draft: Draft) -> DraftFigures:
        """Compute the figures that plan.json has of a plan, for a draft."""
        standing, rows = self._standing(draft), self._rows(draft)
        plan = plan_of(self.survey, self.settings, self._engine, self._demand, self._parts, draft, rows, standing.links)
        seen_from = self.settings.requirements.seen_from
        counted, seen = self._parts.overall.counted, plan.times_seen >= seen_from
        return DraftFigures(
            plan=plan,
            curve=steepest_curve(rows_of_quality(self._demand, rows), draft.ids, self._area_m2, counted, seen_from),
            unseen=left_surfaces(self.survey, counted & ~seen),
        )

    def walk(self, draft: Draft, *, progress: Progress = silent) -> RouteResult:
        """Find the walk through a draft's stations in their order; those whose scan exists are not walked to.

        Where the review has an entrance, it begins there, in the shortest order; where one can walk at all is as in the
        plan.
        """
        index = {floor.id: number for number, floor in enumerate(self.survey.floors)}
        heights = [each.instrument_height_m for each in draft.stations]
        scanned = np.array([each.fixed for each in draft.stations], dtype=np.bool_)
        route = plan_route(
            self._reach,
            np.array([each.position_m for each in draft.stations], dtype=np.float64).reshape(-1, 3),
            np.array([math.nan if height is None else height for height in heights], dtype=np.float64),
            np.array([index[each.floor] for each in draft.stations], dtype=np.int32),
            ends=ends_of(self.settings.site.entered_at(draft.entrances_m), self.survey.scene.offset_m),
            scanned=scanned,
            # As in all that is handed over of a review, which knows no shorter order without the scene.
            order=None if draft.entrances_m else np.arange(len(draft.stations)),
            seed=self.settings.seed,
            progress=progress,
        )
        n_scans = int((~scanned).sum())
        return RouteResult(route, field_time(self.settings.crew, n_scans=n_scans, walk_m=route.length_m))

    # ------------------------------------------------------------------------------------------ previews
    def preview(
        self,
        draft: Draft,
        station: str | None,
        floor: str,
        position_m: tuple[float, float] | Place,
        instrument_height_m: float,
        *,
        layer: str = TIMES_SEEN,
    ) -> Preview:
        """Say what the draft would be worth with a station elsewhere, or with one more.

        Parameters
        ----------
        station
            Id of the one that is moved; None: a new one.
        position_m
            (x, y) or (x, y, z) in the local frame; z, the sensor's, distinguishes grounds above each other. The station
            is put where a tripod can stand, see `Preview.spot`; where there is no such place nearby, it stays.

        Raises
        ------
        RequirementError
            No such station, floor or layer; figures that are none.
        DeviceError
            The device fails.
        """
        painted = layer_named(layer, self.layers)
        moved = None if station is None else draft.station(station)
        others = draft if moved is None else draft.without(moved.id)
        spot = self.snap(draft, floor, position_m, instrument_height_m)
        name = NEW_ID if moved is None else moved.id
        there = DraftStation(name, self._floor_id(floor), spot.position_m, instrument_height_m)
        if moved is not None:
            there = replace(there, fixed=moved.fixed, locked=moved.locked)
        base, without = self._standing(draft), self._standing(others)
        new = self._observer.observe(spot.position_m)
        old = None if moved is None else base.observations_of(moved.id)
        change = changed(base.tally, base.covered_m2, without.tally, old, new, self._parts, self._area_m2)
        patch, times_seen, values = differing(base.tally, change, self._achievable, painted)
        overall, floors, goals = coverages(self._parts, change.covered_m2)
        new_links = self._pairs.links_of(name, new, list(zip(others.ids, without.tally.looks, strict=True)))
        links = links_as_scanned(self.settings, draft, new_links)
        all_links = (*links_as_scanned(self.settings, draft, without.links), *links)
        stations = (*others.stations, there)
        if self.settings.requirements.joins_by_targets(self.survey.scene.source.doors):
            rows = rows_of((*without.tally.looks, new), self._demand.n_patches, len(self._demand.goals.qualities))
            of = (self.survey, self.settings, self._engine, self._demand)
            all_links = links_by_targets(*of, rows, stations, all_links)
            links = tuple(link for link in all_links if name in (link.a, link.b))
        return Preview(
            spot=spot,
            station=there,
            draft=draft.having(there),
            patch=patch,
            times_seen=times_seen,
            values=values,
            overall=overall,
            floors=floors,
            goals=goals,
            covered_m2=float(self._area_m2[new.met[0]].sum()),
            own_m2=change.own_m2,
            links=links,
            registration=registration_of(self.settings, all_links, stations),
        )

    def snap(
        self, draft: Draft, floor: str, position_m: tuple[float, float] | Place, instrument_height_m: float
    ) -> TripodPosition:
        """Find where a station that is dragged to a place would stand; raises as `preview`."""
        return self._tripod_positions.nearest(
            floor,
            (position_m[0], position_m[1]),
            draft,
            height_m=instrument_height_m,
            sensor_z_m=position_m[2] if len(position_m) == 3 else None,
        )

    def ground(self, draft: Draft, floor: str) -> GroundMap:
        """Return the map of where stations may stand on a floor; raises RequirementError where there is none."""
        return self._tripod_positions.ground(floor, draft)

    # ------------------------------------------------------------------------------------------ what is painted
    def times_seen(self, draft: Draft) -> UInt8Array:
        """(P,) uint8, as viewer/patches.u8."""
        return times_seen_bytes(self._standing(draft).tally.times_met[0], self._achievable)

    def layer(self, draft: Draft, layer: str) -> UInt16Array:
        """(P,) uint16, as the layer's file of the plan folder; raises RequirementError where the plan has none such."""
        painted = layer_named(layer, self.layers)
        if painted is None:
            return self.times_seen(draft).astype(np.uint16)
        return painted.quantised(figure_of(layer, self._standing(draft).tally.best(layer)))

    def seen(self, draft: Draft, station: str) -> bytes:
        """What a station sees, as its file below viewer/seen; raises RequirementError where there is no such."""
        observed = self._observer.observe(draft.station(station).position_m)
        return seen_bytes(observed.patch, observed.met[0], self._area_m2.size)

    def lost(self, draft: Draft, station: str) -> bytes:
        """What requirements would lose without a station, as its file below viewer/lost; raises as `seen`."""
        at = draft.ids.index(draft.station(station).id)
        return lost_bytes(losses_of(self._demand, self._rows(draft))[at])

    def cloud(self, draft: Draft, station: str) -> bytes:
        """Return the scan of a station, as viewer/clouds holds it; raises as `seen`."""
        template = preview_template(self.survey.template)
        scans = self._engine.scan(template, draft.station(station).at_m[None])
        return packed_cloud(scans.range_m[0], scans.cos_incidence[0], template)

    def cloud_window(
        self, draft: Draft, station: str, azimuth_rad: float, width_rad: float, elevation_rad: tuple[float, float]
    ) -> CloudWindow:
        """Scan what a station sees in a window, by as many of its beams as `CLOUD_BEAMS` allows, evenly thinned.

        Arguments are those of `window_template`. Raises as `seen`, and RequirementError for a window without a beam.
        """
        at_m = draft.station(station).at_m
        window = window_template(self.survey.template, azimuth_rad, width_rad, elevation_rad)
        if window is None:
            raise RequirementError("window: got one without a beam of the scanner, expected some; widen it")
        template = preview_template(window, max_beams=CLOUD_BEAMS)
        scans = self._engine.scan(template, at_m[None])
        n_beams = window.shape[0] * window.shape[1]
        return CloudWindow(template, n_beams, cloud_bytes(scans.range_m[0], scans.cos_incidence[0], template))

    # ------------------------------------------------------------------------------------------ inside
    def _rows(self, draft: Draft) -> SeenPatches:
        return rows_of(self._standing(draft).tally.looks, self._demand.n_patches, len(self._demand.goals.qualities))

    def _standing(self, draft: Draft) -> Standing:
        known = self._standings.get(draft.stations)
        if known is not None:
            self._standings.move_to_end(draft.stations)
            return known
        # Those of other drafts are held anyway, also where they are too many for the observer to remember.
        held = {look.position_m: look for standing in self._standings.values() for look in standing.tally.looks}
        looks = [
            held.get(station.position_m) or self._observer.observe(station.position_m) for station in draft.stations
        ]
        tally = Tally(looks, n_patches=self._demand.n_patches, n_qualities=len(self._demand.goals.qualities))
        found = Standing(
            draft=draft,
            tally=tally,
            covered_m2=tuple(covered_area_m2(part, tally.times_met, self._area_m2) for part in self._parts.all),
            links=self._pairs.links(list(zip(draft.ids, looks, strict=True))),
        )
        self._standings[draft.stations] = found
        if len(self._standings) > _KEPT_STANDINGS:
            self._standings.popitem(last=False)
        return found

    def _floor_id(self, name: str) -> str:
        return self.survey.floors[floor_named(self.survey.floors, name, "station")].id

    def _usual_height_m(self) -> float:
        """Instrument height that maps of the ground are made for: the plan's median, else the tripod's lowest."""
        heights = [each.instrument_height_m for each in self.draft.stations if each.instrument_height_m is not None]
        lowest = self.settings.heights.to_try_m[0]
        return float(np.median(heights)) if heights else lowest


def _draft_of(document: dict[str, Any], survey: Survey) -> Draft:
    """Return the plan's own stations as a draft."""
    return Draft(
        tuple(
            DraftStation(
                id=str(row["id"]),
                floor=str(row["floor"]),
                position_m=local_place(row["position"], survey.scene.offset_m),
                instrument_height_m=row["instrument_height_m"],
                fixed=bool(row["fixed"]),
            )
            for row in document["stations"]
        )
    )

"""Fig. 14, overlap repair: scattered stations before and after 20, 40 and 60 % of overlap are required of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from planner_core.model import FloatArray
from planner_core.network.links import components, overlap_links, surface_of_patches
from planner_core.paper.overlap_repair import OverlapRepair, repair_overlap, station_overlaps
from planner_core.paper.point_distribution import PointDistribution
from planner_core.paper.search.thinning import best_apart

from .charts import COLOURS, chart, draw_walls
from .figure import Bench, Outcome, Picture
from .levels import Level, open_level

#: (radius, least distance of the first stations, their number): Table 2's range, then the paper's of 1.5 m and its
#: stress test, 1 m with stations scattered so that two have to be put between neighbours.
_TESTS = ((5.0, 6.0, 8), (1.5, 2.5, 20), (1.0, 6.0 - 1e-3, 8))
_REQUIRED = (0.2, 0.4, 0.6)


@dataclass(frozen=True)
class _Test:
    """One row of the picture: stations before, and repairs by required overlap."""

    radius_m: float
    first_m: FloatArray
    pool_m: FloatArray
    repairs: tuple[OverlapRepair, ...]

    def all_m(self, column: int) -> FloatArray:
        return np.concatenate([self.first_m, self.pool_m[self.repairs[column].added]])


def run(bench: Bench) -> Outcome:
    """Scatter stations by F2, repair their overlap, and ask the surfaces that the scans really share."""
    level = open_level(bench, "basement", n_azimuths=bench.at(450, None), grid_step_m=0.5, heights_m=(1.3,))
    position_m = level.candidates().position_m
    bench.tell(0, 3, "F2")
    worth = PointDistribution(level.survey.scene, level.survey.patches, level.engine).of(
        level.survey.template, position_m, progress=bench.progress
    )
    tests = []
    for radius_m, apart_m, n in _TESTS:
        first = best_apart(position_m, worth.n_patches, worth.f2_m2, n=n, least_distance_m=apart_m)
        pool_m = np.delete(position_m, first, axis=0)
        repairs = tuple(
            repair_overlap(position_m[first], pool_m, radius_m=radius_m, required=required) for required in _REQUIRED
        )
        tests.append(_Test(radius_m, position_m[first], pool_m, repairs))
    bench.tell(1, 3, "real overlap")
    # By scans of 1 or 1.5 m there is nothing to ask: this scanner then hardly sees the ground below itself.
    real = [_real_sets(level, tests[0], column) for column in range(3)]
    bench.tell(2, 3, "draw")
    pictures = _draw(bench, level, tests)
    bench.tell(3, 3)
    return _outcome(tests, real, pictures)


def _real_sets(level: Level, test: _Test, column: int) -> int:
    """Sets of stations that share the required part of really seen surface, pair by pair."""
    visibility = level.engine.visible_patches(level.survey.template, test.all_m(column))
    ids = tuple(str(index) for index in range(visibility.n_positions))
    seen = np.zeros(level.survey.patches.n_patches, dtype=bool)
    seen[visibility.patch] = True
    surface = surface_of_patches(level.survey.scene, level.survey.patches, seen)
    links = overlap_links(visibility, level.survey.patches.area_m2, ids, surface)
    return len(components(links, ids, threshold=_REQUIRED[column]))


def _sets_of(position_m: FloatArray, radius_m: float) -> int:
    near = np.linalg.norm(position_m[:, None, :2] - position_m[None, :, :2], axis=2) < 2 * radius_m
    return int(connected_components(near)[0])


def _draw(bench: Bench, level: Level, tests: list[_Test]) -> tuple[Picture, ...]:
    from matplotlib.patches import Circle

    walls = level.walls_m()
    shows = "Stations before (orange) and added by the repair (blue), with their circles"
    with chart(bench, "fig14.png", shows, columns=4, rows=len(tests), size_in=(3.0, 3.2)) as (_, axes, drawn):
        for row, test in enumerate(tests):
            for column in range(4):
                one = axes[4 * row + column]
                draw_walls(one, walls)
                n_first = len(test.first_m)
                stations = test.first_m if column == 0 else test.all_m(column - 1)
                for index, place in enumerate(stations):
                    colour = COLOURS[1] if index < n_first else COLOURS[0]
                    one.add_patch(Circle(place[:2], test.radius_m, facecolor=colour, alpha=0.12, linewidth=0))
                    one.plot(*place[:2], "o", color=colour, markersize=2.5)
                added = len(stations) - n_first
                title = "before" if column == 0 else f"{100 * _REQUIRED[column - 1]:.0f} %: {added} added"
                one.set_title(f"radius {test.radius_m:g} m, {title}", fontsize=8, loc="left")
    return tuple(drawn)


def _outcome(tests: list[_Test], real: list[int], pictures: tuple[Picture, ...]) -> Outcome:
    numbers: list[dict[str, Any]] = []
    for test in tests:
        least = [float(station_overlaps(test.all_m(c), radius_m=test.radius_m).min()) for c in range(3)]
        numbers.append(
            {
                "radius_m": test.radius_m,
                "stations_before": len(test.first_m),
                "sets_before": _sets_of(test.first_m, test.radius_m),
                "added": [len(one.added) for one in test.repairs],
                "sets_of_circles_after": [len(one.sets) for one in test.repairs],
                "short": [len(one.short) for one in test.repairs],
                "least_overlap": least,
            }
        )
    kept = all(not one.short and one.is_joined for test in tests for one in test.repairs)
    grows = all(row["added"] == sorted(row["added"]) for row in numbers)
    sentences = "; ".join(
        f"radius {row['radius_m']:g} m: {row['stations_before']} stations in {row['sets_before']} sets, "
        f"{', '.join(str(n) for n in row['added'])} added for 20, 40 and 60 %"
        for row in numbers
    )
    return Outcome(
        found=(
            f"{sentences}. Afterwards {'every' if kept else 'not every'} station overlaps as required and "
            f"{'all hang' if kept else 'not all hang'} together, by circles. By the surface that scans really share, "
            f"pair by pair, the stations of the first row form {real[0]}, {real[1]} and {real[2]} sets: circles reach "
            "through walls."
        ),
        agrees="yes" if kept and grows else "partly" if kept else "no",
        pictures=pictures,
        numbers={"tests": numbers, "sets_by_real_overlap": real},
    )

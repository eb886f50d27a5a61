"""Fig. 13, each spatial search with genetic selection after it, on a level of the school -> maps and sets.

All of it twice: searches guided by F2 of squared distances, as Eq. 2 is printed, and of plain ones, as the text has it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import scenes_synthetic
from planner_core.model import BoolArray, FloatArray, Int64Array, Visibility
from planner_core.paper.genetic import GeneticResult, GeneticSettings, select_genetic
from planner_core.paper.search import SearchResult, SearchSettings
from planner_core.scene.patches import patch_triangles
from planner_core.select.greedy import select_greedy
from planner_core.select.problem import Constraint, CoverProblem, cover_problem
from scenes_synthetic.model import Room
from scenes_synthetic.school import VOID_M

from .charts import COLOURS, chart, draw_nothing, draw_walls, label
from .fig11 import inside
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level
from .searches import SEARCHES, UNITS, decided, run_search, sees_nothing

FLOOR = 1
#: The room round the void; the library opens to it by a doorway of 4 m, all others have a door.
MAIN = f"Gallery {FLOOR}"
_OPEN = (MAIN, f"Library {FLOOR}")
#: The rooms of the west side: toilets and staff room.
SMALL = (f"Girls {FLOOR}", f"Boys {FLOOR}", f"Staff room {FLOOR}")
#: Of what a pool can see, what its selection has to.
COVERAGE = 0.95
#: Rooms that are named as those where most improved positions are.
_N_CROWDED = 3
#: Ranges that are tested for how far they reach through the void: Table 2's, and a farther one.
_RANGES_M = (5.0, 20.0)
#: Faces of a room lie on its outline.
_FACE_M = 0.05


@dataclass(frozen=True)
class Ground:
    """What all searches have in common: starts (N, 3), rooms of the level, and patches (P,) of the enclosed ones."""

    level: Level
    starts_m: FloatArray
    rooms: tuple[Room, ...]
    enclosed: BoolArray

    @property
    def area_m2(self) -> FloatArray:
        """(P,) area of the patches."""
        return self.level.survey.patches.area_m2


@dataclass(frozen=True)
class Combined:
    """One search and its selections. Shares are of the scannable area: what all starts and pools see together.

    index : (M,) agents whose best positions make up the pool, each position once. chosen : indices into the pool, by
    seed of the genetic selection. run : the genetic selection of the first seed. covers, covers_enclosed : shares, by
    seed. eq9 : stations that Eq. 9 leaves, by seed.
    """

    result: SearchResult
    index: Int64Array
    pool_share: float
    pool_share_enclosed: float
    run: GeneticResult
    chosen: list[Int64Array]
    covers: list[float]
    covers_enclosed: list[float]
    greedy: int
    eq9: list[int]
    eq9_share: float

    @property
    def pool_m(self) -> FloatArray:
        """(M, 3) the pool."""
        return self.result.position_m[self.index]

    @property
    def n_stations(self) -> list[int]:
        """Stations by seed."""
        return [int(one.size) for one in self.chosen]


def run(bench: Bench) -> Outcome:
    """Search with all three methods from one set of starts, and select from what each finds."""
    ground = _ground(bench)
    settings = SearchSettings(seed=bench.seed, fixed_height=not bench.full, max_iterations=bench.at(20, 60))
    pictures: list[Picture] = []
    numbers: dict[str, Any] = {"n_starts": len(ground.starts_m), "columns": ground.level.columns}
    for done, distance in enumerate(UNITS):
        results: dict[str, SearchResult] = {}
        for part, name in enumerate(SEARCHES):
            bench.tell(4 * done + part, 8, f"{SEARCHES[name]}, {distance}")
            results[name], _ = run_search(bench, name, ground.level, ground.starts_m, settings, distance=distance)
        bench.tell(4 * done + 3, 8, f"select, {distance}")
        found = _select(bench, ground, results)
        nothing = sees_nothing(ground.level, distance=distance)
        pictures += _draw(bench, ground, found, nothing, distance)
        numbers[distance] = {"sees_nothing": nothing, **{name: _facts(ground, one) for name, one in found.items()}}
    bench.tell(8, 8)
    numbers["other_levels_by_range"] = [(range_m, _share_elsewhere(ground, range_m)) for range_m in _RANGES_M]
    return Outcome(found=_say(ground, numbers), agrees=verdict(numbers), pictures=tuple(pictures), numbers=numbers)


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether medians by search, guided by squared distances, bear the paper out; see `findings`."""
    return at_native_columns(numbers, lambda: by_share(findings(numbers["squared"]).values()))


def findings(facts: Mapping[str, Any]) -> dict[str, bool]:
    """The paper's sentences, and whether medians by search bear them out.

    Tabu search needs the fewest stations, has more of them in the main room than the others, and covers less of the
    enclosed rooms; annealing has stations in more small rooms than local search.
    """
    ls, sa, ts = (facts[name] for name in SEARCHES)
    return {
        "that tabu search needs fewest stations": ts["stations"] < min(ls["stations"], sa["stations"]),
        "that they are in the main room": ts["stations_in_main"] > max(ls["stations_in_main"], sa["stations_in_main"]),
        "that they cover enclosed rooms worse": ts["covers_enclosed"]
        < min(ls["covers_enclosed"], sa["covers_enclosed"]),
        "that annealing reaches more small rooms": sa["small_rooms"] > ls["small_rooms"],
    }


def rooms_of(rooms: Sequence[Room], position_m: FloatArray) -> dict[str, int]:
    """Count positions (N, 3) by room."""
    return {room.name: int(inside(room, position_m).sum()) for room in rooms}


def in_rooms(rooms: Sequence[Room], point_m: FloatArray) -> BoolArray:
    """(N,) bool: which points (N, 3) lie in one of the rooms or on its walls, floor or ceiling."""
    found = np.zeros(len(point_m), dtype=bool)
    for room in rooms:
        corners = np.array(room.outline_m)
        low = np.array([*corners.min(axis=0), room.floor_m]) - _FACE_M
        high = np.array([*corners.max(axis=0), room.floor_m + room.height_m]) + _FACE_M
        found |= ((point_m >= low) & (point_m <= high)).all(axis=1)
    return found


def rows(visibility: Visibility, first: int, last: int) -> Visibility:
    """Visibility of the positions `first` to `last` - 1 alone."""
    starts = visibility.starts[first : last + 1]
    return Visibility(starts - starts[0], visibility.patch[starts[0] : starts[-1]], visibility.n_patches)


def seen_by(visibility: Visibility, index: Int64Array | range) -> BoolArray:
    """(P,) bool: patches that some positions see together."""
    seen = np.zeros(visibility.n_patches, dtype=bool)
    for position in index:
        seen[visibility.row(int(position))] = True
    return seen


def _ground(bench: Bench) -> Ground:
    school = scenes_synthetic.build("school", seed=bench.seed)
    level = open_level(
        bench,
        school.scene,
        floor=FLOOR,
        grid_step_m=bench.at(5.0, 0.5),
        heights_m=bench.at((1.3,), ()),
    )
    rooms = tuple(room for room in school.rooms if room.storey == FLOOR)
    middle_m = patch_triangles(level.survey.scene, level.survey.patches).mean(axis=1)
    enclosed = in_rooms([room for room in rooms if room.name not in _OPEN], middle_m)
    return Ground(level, level.candidates(n_halvings=0).position_m, rooms, enclosed)


def _select(bench: Bench, ground: Ground, results: dict[str, SearchResult]) -> dict[str, Combined]:
    """Select from each pool."""
    # Agents that began at a valid place of the grid, but not of the lattice, may have found nothing.
    index = {name: _once(result) for name, result in results.items()}
    places = [ground.starts_m, *(results[name].position_m[own] for name, own in index.items())]
    template = ground.level.survey.template
    whole = ground.level.engine.visible_patches(template, np.concatenate(places), progress=bench.progress)
    ends = np.cumsum([len(one) for one in places])
    achievable = seen_by(whole, range(whole.n_positions))
    found = {}
    for (name, own), first, last in zip(index.items(), ends[:-1], ends[1:], strict=True):
        view = rows(whole, int(first), int(last))
        found[name] = _combined(bench, ground, results[name], own, view, achievable)
    return found


def _once(result: SearchResult) -> Int64Array:
    """Agents with a valid best position; where several have the same one, the first."""
    at = np.flatnonzero(result.found)
    _, first = np.unique(result.position_m[at], axis=0, return_index=True)
    return np.asarray(at[np.sort(first)], dtype=np.int64)


def _combined(
    bench: Bench, ground: Ground, result: SearchResult, index: Int64Array, view: Visibility, achievable: BoolArray
) -> Combined:
    area_m2 = ground.area_m2
    pool = seen_by(view, range(view.n_positions))
    problem = cover_problem(view, area_m2, (Constraint(pool, COVERAGE),))
    seeds = range(bench.seed, bench.seed + bench.at(5, 20))
    runs = [_evolve(problem, "fewest", seed) for seed in seeds]
    eq9 = [_evolve(problem, "eq9", seed) for seed in seeds]
    seen = [seen_by(view, one.chosen.astype(np.int64)) for one in runs]
    alone = seen_by(view, eq9[0].chosen.astype(np.int64))

    def share(mask: BoolArray, of: BoolArray) -> float:
        return float(area_m2[mask & of].sum() / area_m2[of].sum())

    enclosed = achievable & ground.enclosed
    return Combined(
        result=result,
        index=index,
        pool_share=share(pool, achievable),
        pool_share_enclosed=share(pool, enclosed),
        run=runs[0],
        chosen=[one.chosen.astype(np.int64) for one in runs],
        covers=[share(one, achievable) for one in seen],
        covers_enclosed=[share(one, enclosed) for one in seen],
        greedy=len(select_greedy(problem).chosen),
        eq9=[int(one.chosen.size) for one in eq9],
        eq9_share=share(alone, achievable),
    )


def _evolve(problem: CoverProblem, objective: str, seed: int) -> GeneticResult:
    """Table 3's parameters, the library's defaults."""
    return select_genetic(problem, GeneticSettings(objective=objective, seed=seed))


def _facts(ground: Ground, one: Combined) -> dict[str, Any]:
    """Medians over the seeds of the genetic selection, and what the pool is like."""
    by_room = [rooms_of(ground.rooms, one.pool_m[chosen]) for chosen in one.chosen]
    in_pool = rooms_of(ground.rooms, one.pool_m)
    enclosed = [room.name for room in ground.rooms if room.name not in _OPEN]
    worth_f1, worth_f2 = one.result.f1[one.index], one.result.f2[one.index]
    return {
        "pool": len(one.index),
        "pool_share": one.pool_share,
        "pool_share_of_enclosed": one.pool_share_enclosed,
        "pool_by_room": in_pool,
        "pool_in_main": in_pool[MAIN] / len(one.index),
        "stations_by_seed": one.n_stations,
        "stations": float(np.median(one.n_stations)),
        "stations_greedy": one.greedy,
        "stations_eq9_by_seed": one.eq9,
        "eq9_covers": one.eq9_share,
        "stations_in_main": float(np.median([by[MAIN] / sum(by.values()) for by in by_room])),
        "covers": float(np.median(one.covers)),
        "covers_enclosed": float(np.median(one.covers_enclosed)),
        "rooms": float(np.median([sum(number > 0 for number in by.values()) for by in by_room])),
        "enclosed_rooms": float(np.median([sum(by[name] > 0 for name in enclosed) for by in by_room])),
        "small_rooms": float(np.median([sum(by[name] > 0 for name in SMALL) for by in by_room])),
        "pool_small_rooms": sum(in_pool[name] > 0 for name in SMALL),
        "median_f1": float(np.median(worth_f1[one.chosen[0]])),
        "median_f2": float(np.median(worth_f2[one.chosen[0]])),
    }


def _share_elsewhere(ground: Ground, range_m: float) -> float:
    """Return how much of the area that the starts would see with such a range belongs to other levels."""
    template = replace(ground.level.survey.template, range_max_m=range_m)
    view = ground.level.engine.visible_patches(template, ground.starts_m)
    seen = seen_by(view, range(view.n_positions))
    return float(ground.area_m2[seen & ~ground.level.patches_of_level()].sum() / ground.area_m2[seen].sum())


#: Pictures by the distance that guided the searches, and what to call it.
_FILES = {"squared": ("fig13.png", "squared"), "euclidean": ("fig13-plain.png", "plain")}


def _draw(
    bench: Bench, ground: Ground, found: dict[str, Combined], nothing: float, distance: str
) -> tuple[Picture, ...]:
    (file, called), unit = _FILES[distance], UNITS[distance]
    shows = (
        "Stations of local search, annealing and tabu search with genetic selection; the sets by generation; F1, F2 of "
        f"{called} distances"
    )
    with chart(bench, file, shows, columns=3, rows=3, size_in=(4.3, 3.1)) as (_, axes, drawn):
        walls = ground.level.walls_m()
        for row, (name, one) in enumerate(found.items()):
            _draw_map(axes[3 * row], ground, one, walls)
            title = f"{name.upper()} + GA: {one.n_stations[0]} stations of {len(one.index)}"
            axes[3 * row].set_title(title, fontsize=9, loc="left")
            _draw_generations(axes[3 * row + 1], one)
            _draw_worth(axes[3 * row + 2], one, unit)
            draw_nothing(axes[3 * row + 2], nothing, unit=unit)
        handles, names = axes[0].get_legend_handles_labels()
        axes[0].legend(
            handles, names, fontsize=7, frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, 0.02)
        )
        for column in (1, 2):
            same = axes[column::3]
            low = min(one.get_xlim()[0] for one in same), min(one.get_ylim()[0] for one in same)
            high = max(one.get_xlim()[1] for one in same), max(one.get_ylim()[1] for one in same)
            for one in same:
                one.set_xlim(low[0], high[0])
                one.set_ylim(low[1], high[1])
    return tuple(drawn)


def _draw_map(axes: Any, ground: Ground, one: Combined, walls_m: FloatArray) -> None:
    draw_walls(axes, walls_m)
    (x0, y0), (x1, y1) = VOID_M
    axes.fill([x0, x1, x1, x0], [y0, y0, y1, y1], color="#eeeeee", zorder=0)
    axes.text((x0 + x1) / 2, (y0 + y1) / 2, "void", fontsize=7, color="#777777", ha="center", va="center")
    axes.plot(*ground.starts_m[:, :2].T, ".", color="#bbbbbb", markersize=2.5, label="start")
    axes.plot(*one.pool_m[:, :2].T, ".", color=COLOURS[5], markersize=3.5, label="improved")
    axes.plot(
        *one.pool_m[one.chosen[0], :2].T,
        "o",
        color=COLOURS[1],
        markersize=4.5,
        markeredgecolor="white",
        markeredgewidth=0.5,
        label="station",
    )


def _draw_generations(axes: Any, one: Combined) -> None:
    axes.plot(one.run.active_by_iteration, color=COLOURS[1])
    axes.set_ylim(bottom=0)
    label(axes, "Best set by generation", "generation", "stations")
    axes.yaxis.label.set_color(COLOURS[1])
    twin = axes.twinx()
    covered = one.run.covered_by_iteration / one.run.covered_by_iteration[-1] * one.covers[0]
    twin.plot(100 * covered, color=COLOURS[0])
    twin.set_ylim(0, 105)
    twin.set_ylabel("covered, % of scannable", fontsize=8, color=COLOURS[0])
    twin.tick_params(labelsize=8)


def _draw_worth(axes: Any, one: Combined, unit: str) -> None:
    valid = np.isfinite(one.result.history.f2[0])
    f1, f2 = one.result.f1[one.index], one.result.f2[one.index]
    axes.plot(
        one.result.history.f1[0][valid], one.result.history.f2[0][valid], ".", color="#bbbbbb", markersize=3, zorder=0
    )
    axes.plot(f1, f2, ".", color=COLOURS[5], markersize=4)
    axes.plot(
        f1[one.chosen[0]],
        f2[one.chosen[0]],
        "o",
        color=COLOURS[1],
        markersize=4,
        markeredgecolor="white",
        markeredgewidth=0.4,
    )
    label(axes, "Positions", "F1, patches", f"F2, {unit}")


def _say(ground: Ground, numbers: Mapping[str, Any]) -> str:
    squared, plain = numbers["squared"], numbers["euclidean"]
    (near, near_share), (far, far_share) = numbers["other_levels_by_range"]
    of_squared, of_plain = findings(squared), findings(plain)
    same = by_share(of_squared.values()) == by_share(of_plain.values())
    return (
        f"all in the order local search, annealing, tabu search, medians over {len(squared['ts']['stations_by_seed'])} "
        f"seeds of the genetic selection, which takes the fewest stations for {100 * COVERAGE:.0f} % of what the pool "
        f"sees. From {len(ground.starts_m)} starts on {ground.level.floor.name} of the school, with squared distances "
        f"as Eq. 2 prints them, {_say_of(ground, squared, 'm2')} With plain distances, as the text has it, "
        f"{_say_of(ground, plain, 'm')} {decided(of_squared, of_plain, same_verdict=same)} Of what the starts see, "
        f"{100 * near_share:.1f} % belongs to other levels at a range of {near:g} m, {100 * far_share:.1f} % if it "
        f"were {far:g} m."
    )


def _say_of(ground: Ground, facts: Mapping[str, Any], unit: str) -> str:
    def each(key: str, scale: float = 1.0, digits: int = 0) -> str:
        ls, sa, ts = (f"{scale * facts[name][key]:.{digits}f}" for name in SEARCHES)
        return f"{ls}, {sa} and {ts}"

    def spans(key: str) -> str:
        ls, sa, ts = (span(facts[name][key]) for name in SEARCHES)
        return f"{ls}, {sa} and {ts}"

    ts = facts["ts"]
    most = sorted(ts["pool_by_room"].items(), key=lambda item: -item[1])[:_N_CROWDED]
    crowded = ", ".join(f"{name} ({number} of {ts['pool']})" for name, number in most)
    return (
        f"the pools see {each('pool_share', 100)} % of the scannable area (all starts and these pools together), and "
        f"of its part in enclosed rooms {each('pool_share_of_enclosed', 100)} %. {each('stations')} stations are "
        f"selected (over the seeds {spans('stations_by_seed')}; a greedy choice needs {each('stations_greedy')}), "
        f"which cover {each('covers', 100)} % of the scannable area and {each('covers_enclosed', 100)} % of that in "
        f"enclosed rooms. Of {len(ground.rooms)} rooms, {each('rooms')} have a station; of the {len(SMALL)} small "
        f"ones in the west, {each('small_rooms')}. In the main room, the gallery, are {each('pool_in_main', 100)} % of "
        f"the improved positions and {each('stations_in_main', 100)} % of the stations; tabu search gathers in "
        f"{crowded}. Median F2 of the stations: {each('median_f2', 1.0, 1)} {unit} (a station that sees nothing: "
        f"{facts['sees_nothing']:.1f}), F1 {each('median_f1')} patches. With Eq. 9, the same genetic selection ends "
        f"with {spans('stations_eq9_by_seed')} stations, which cover {each('eq9_covers', 100)} %."
    )


def span(numbers: Sequence[int]) -> str:
    """Name the least and the greatest."""
    low, high = min(numbers), max(numbers)
    return f"{low}" if low == high else f"{low} to {high}"

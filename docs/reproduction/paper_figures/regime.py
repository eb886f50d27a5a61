"""When F2 rewards reaching a patch: its sign against the columns of a scan, with d^2 and d; and what slivers weigh.

No figure of the paper, but what its figures of F2 hang on: few returns on a patch cost more than none.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planner_core.engine.patch_samples import places_of
from planner_core.model import FloatArray
from planner_core.paper.euclidean_distance import EuclideanSums
from planner_core.paper.point_distribution import mean_distances_m2
from planner_core.paper.reference_distance import REFERENCE_POINTS_PER_M2, reference_distances_of_patches_m2
from planner_core.scene.patches import make_patches

from .charts import COLOURS, chart, label
from .fig11 import SLENDER, is_slender
from .figure import Bench, Outcome, Picture, Verdict, at_native_columns, by_share
from .levels import Level, open_level

_SCENES = ("basement", "hole-walls")
_COLUMNS = (450, 900, 1800, 4500)
_DISTANCES = ("squared", "euclidean")
_AREAS_M2 = (0.01, 0.02, 0.04, 0.08, 0.16)
_HEIGHT_M = 1.3
#: The paper's second scanner, used at its own columns alone.
_OTHER = "pandar64"
#: Shares up to which reaching pays: of positions worse than one that sees nothing, of patches dearer than unreached.
FEW_WORSE, FEW_DEARER = 0.05, 0.5


def run(bench: Bench) -> Outcome:
    """Ask positions at random for both distances at several numbers of columns; weigh slivers over patch areas."""
    rows: list[dict[str, Any]] = []
    n_steps = len(_SCENES) * len(_COLUMNS) + 1
    for scene in _SCENES:
        for columns in _COLUMNS:
            bench.tell(len(rows) // len(_DISTANCES), n_steps, f"{scene}, {columns} columns")
            level = open_level(bench, scene, n_azimuths=columns, grid_step_m=0.5, heights_m=(_HEIGHT_M,))
            position_m = _some(level.candidates().position_m, bench.at(24, 200), bench.seed)
            shares = _shares(level, position_m)
            rows += [{"scene": scene, "columns": columns, "distance": name, **one} for name, one in shares.items()]
    bench.tell(n_steps - 1, n_steps, "slivers")
    slivers = _slivers(bench)
    native = level.native_columns
    other: list[dict[str, Any]] = []
    columns_of = {"hdl-64e": {"used": max(_COLUMNS), "native": native}}
    for scene in _SCENES:
        level = open_level(bench, scene, scanner=_OTHER, grid_step_m=0.5, heights_m=(_HEIGHT_M,))
        shares = _shares(level, _some(level.candidates().position_m, bench.at(24, 200), bench.seed))
        other += [{"scene": scene, "scanner": _OTHER, "distance": name, **one} for name, one in shares.items()]
        columns_of |= level.columns
    numbers = {
        "columns": columns_of,
        "n_positions": bench.at(24, 200),
        "rows": rows,
        "at_native": [row for row in rows if row["columns"] == native] + other,
        "slivers": slivers,
    }
    pictures = _draw(bench, rows, slivers)
    bench.tell(n_steps, n_steps)
    return Outcome(found=_say(numbers), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether reaching pays with all scanners, scenes and distances: for positions as a whole, and for most patches."""

    def judged() -> Verdict:
        rows = numbers["at_native"]
        return by_share(
            (
                all(row["worse_than_nothing"] <= FEW_WORSE for row in rows),
                all(row["dearer"] < FEW_DEARER for row in rows),
            )
        )

    return at_native_columns(numbers, judged)


def _some(position_m: FloatArray, n: int, seed: int) -> FloatArray:
    at = np.random.default_rng(seed).permutation(len(position_m))[:n]
    return np.asarray(position_m[np.sort(at)])


def _shares(level: Level, position_m: FloatArray) -> dict[str, dict[str, float]]:
    """By distance: reached patches that cost more than unreached ones, and positions worse than seeing nothing."""
    survey = level.survey
    references = {
        "squared": reference_distances_of_patches_m2(
            survey.scene, survey.patches, points_per_m2=REFERENCE_POINTS_PER_M2
        )
    }
    plain = EuclideanSums(survey.scene, survey.patches, points_per_m2=REFERENCE_POINTS_PER_M2)
    references["euclidean"] = plain.reference_m
    costs: dict[str, list[FloatArray]] = {name: [] for name in _DISTANCES}
    for position in position_m:
        returns = level.engine.patch_returns(survey.template, position[None], moments=True)
        assert returns.moments is not None
        places = places_of(survey.scene, survey.patches, returns.patch)
        means = mean_distances_m2(
            returns.n_returns, returns.moments, slice(None), places.corners_m, places.normal, position
        )
        costs["squared"].append(means - 2.0 * references["squared"][returns.patch])
        batch = level.engine.scan(survey.template, position[None])
        patch, means = plain.of_patches(survey.template, batch, 0, position)
        costs["euclidean"].append(means - 2.0 * references["euclidean"][patch])
    return {
        name: {
            "dearer": float((np.concatenate(each) > 0).mean()),
            "worse_than_nothing": float(np.mean([one.sum() > 0 for one in each])),
        }
        for name, each in costs.items()
    }


def _slivers(bench: Bench) -> list[dict[str, float]]:
    """By patch area: what patches that are much longer than wide have of all patches, of the area and of references."""
    scene = open_level(bench, "basement", heights_m=(_HEIGHT_M,)).survey.scene
    rows = []
    for area_m2 in _AREAS_M2:
        patches = make_patches(scene, max_area_m2=area_m2)
        slender = is_slender(scene, patches)
        squared = reference_distances_of_patches_m2(scene, patches, points_per_m2=REFERENCE_POINTS_PER_M2)
        plain = EuclideanSums(scene, patches, points_per_m2=REFERENCE_POINTS_PER_M2).reference_m
        rows.append(
            {
                "patch_area_m2": area_m2,
                "of_patches": float(slender.mean()),
                "of_area": float(patches.area_m2[slender].sum() / patches.area_m2.sum()),
                "of_squared": float(squared[slender].sum() / squared.sum()),
                "of_euclidean": float(plain[slender].sum() / plain.sum()),
            }
        )
    return rows


def _say(numbers: Mapping[str, Any]) -> str:
    def each(scene: str, distance: str, key: str) -> str:
        rows = [row for row in numbers["rows"] if (row["scene"], row["distance"]) == (scene, distance)]
        return ", ".join(f"{100 * row[key]:.0f}" for row in rows)

    columns = ", ".join(map(str, _COLUMNS))
    sentences = " ".join(
        f"In {scene}, with d2 {each(scene, 'squared', 'dearer')} % of the reached patches cost more than if they were "
        f"not reached, and {each(scene, 'squared', 'worse_than_nothing')} % of the positions score worse than a "
        f"station that sees nothing; with d it is {each(scene, 'euclidean', 'dearer')} % and "
        f"{each(scene, 'euclidean', 'worse_than_nothing')} %."
        for scene in _SCENES
    )
    slivers = "; ".join(
        f"{row['patch_area_m2']:g} m2: {100 * row['of_patches']:.0f} % of the patches, {100 * row['of_area']:.0f} % of "
        f"the area, {100 * row['of_squared']:.0f} % of the references with d2 and "
        f"{100 * row['of_euclidean']:.0f} % with d"
        for row in numbers["slivers"]
    )
    other = "; ".join(
        f"{row['scene']}, {row['distance']}: {100 * row['dearer']:.0f} % and {100 * row['worse_than_nothing']:.0f} %"
        for row in numbers["at_native"]
        if row.get("scanner") == _OTHER
    )
    return (
        f"{numbers['n_positions']} positions at random, {_HEIGHT_M:g} m above the ground, HDL-64E at 5 m with "
        f"{columns} columns. {sentences} The Pandar64 with its own 1800 columns has ({other}). "
        f"Patches more than {SLENDER:g} times as long as wide make up, "
        f"in the basement by the area that patches are cut to: {slivers}."
    )


def _draw(bench: Bench, rows: list[dict[str, Any]], slivers: list[dict[str, float]]) -> tuple[Picture, ...]:
    shows = "F2's sign against the columns of a scan, and the weight of slivers against the area of patches"
    with chart(bench, "f2-regime.png", shows, columns=3, size_in=(3.9, 3.3)) as (_, axes, drawn):
        titles = ("Reached patches dearer than unreached", "Positions worse than seeing nothing")
        for one, key, title in zip(axes, ("dearer", "worse_than_nothing"), titles, strict=False):
            for scene, colour in zip(_SCENES, COLOURS, strict=False):
                for distance, style in zip(_DISTANCES, ("o-", "s--"), strict=True):
                    mine = [row for row in rows if (row["scene"], row["distance"]) == (scene, distance)]
                    x, y = [row["columns"] for row in mine], [row[key] for row in mine]
                    one.plot(x, y, style, color=colour, markersize=4, linewidth=1, label=f"{scene}, {distance}")
            one.set_xscale("log")
            one.set_xticks(_COLUMNS, [str(n) for n in _COLUMNS])
            one.minorticks_off()
            one.set_ylim(-0.02, 1)
            label(one, title, "columns of a scan (HDL-64E: 4500)", "share")
        axes[0].legend(fontsize=7, frameon=False)
        for key, name, colour in (
            ("of_squared", "of references, d2", COLOURS[0]),
            ("of_euclidean", "of references, d", COLOURS[1]),
            ("of_patches", "of patches", COLOURS[6]),
            ("of_area", "of area", "#888888"),
        ):
            axes[2].semilogx(_AREAS_M2, [row[key] for row in slivers], "o-", color=colour, markersize=4, label=name)
        axes[2].set_xticks(_AREAS_M2, [f"{area:g}" for area in _AREAS_M2])
        axes[2].minorticks_off()
        axes[2].set_ylim(0, 1)
        axes[2].legend(fontsize=7, frameon=False)
        label(axes[2], "What slivers make up, basement", "area that patches are cut to, m2", "share")
    return tuple(drawn)

"""Fig. 2, how triangles are cut: by the longest edge, by edges in turn or at random; and the returns that cuts lose.

The test of a ray against a triangle is the usual one (Moeller and Trumbore) in float32, as on a GPU: without the margin
by which our own engine makes triangles larger, and required for comparison.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planner_core.engine.open_engine import open_engine
from planner_core.model import BoolArray, Float32Array, FloatArray
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.patches import make_patches

from .charts import COLOURS, chart, label
from .figure import Bench, Outcome, Picture, Verdict

#: A wall of 4 x 2.5 m, turned so that no coordinate is special, and as far from the origin as models in site
#: coordinates are: there float32 steps are 0.03 mm.
_WALL_M = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 2.5], [0.0, 0.0, 2.5]])
_TURN_RAD, _AT_M, _AWAY_M = 0.7, (311.3, 207.1, 3.3), 2.0
KINDS = ("longest edge", "by turns", "at random")
AREA_M2, _DRAWN_AREA_M2 = 0.005, 0.16
#: The usual threshold of the determinant under which a triangle counts as seen from its edge.
EPSILON = 1e-7
#: Lost returns that bad cuts have over good ones, from which on they lose notably more.
NOTABLE = 2.0
SIGMAS = 3.0


def run(bench: Bench) -> Outcome:
    """Cut one wall in three ways, and cast beams at it that all have to return."""
    rng = np.random.default_rng(bench.seed)
    origin_m, beams = _beams(bench.at(200_000, 2_000_000), rng)
    lost: dict[str, float] = {}
    ours: dict[str, int] = {}
    slender: dict[str, float] = {}
    for done, kind in enumerate(KINDS):
        bench.tell(done, len(KINDS), kind)
        corners_m = cut(wall_triangles(), AREA_M2, kind, bench.seed)
        lost[kind] = 1e6 * float((~hits(corners_m, origin_m, beams)).mean())
        ours[kind] = _lost_by_engine(corners_m, origin_m, beams)
        slender[kind] = float(np.median(slenderness(corners_m)))
    pictures = _draw(bench, lost)
    bench.tell(len(KINDS), len(KINDS))
    numbers = {"n_beams": len(beams), "lost": lost, "lost_by_our_engine": ours, "median_length_over_width": slender}
    return Outcome(found=_say(numbers), agrees=verdict(numbers), pictures=pictures, numbers=numbers)


def verdict(numbers: Mapping[str, Any]) -> Verdict:
    """Whether edges cut at random or in turn lose more returns than longest edges.

    `yes`: twice as many, and by more than three standard deviations of such counts; `partly`: more.
    """
    lost = {kind: value * numbers["n_beams"] / 1e6 for kind, value in numbers["lost"].items()}
    good = lost.pop("longest edge")
    bad = max(lost.values())
    if bad <= good:
        return "no"
    return "yes" if bad >= NOTABLE * good and bad - good > SIGMAS * np.sqrt(bad + good) else "partly"


def wall_triangles() -> Float32Array:
    """(2, 3, 3) float32, metres."""
    return _placed(_WALL_M)[[[0, 1, 2], [0, 2, 3]]].astype(np.float32)


def _placed(point_m: FloatArray) -> FloatArray:
    cos, sin = np.cos(_TURN_RAD), np.sin(_TURN_RAD)
    return np.asarray(point_m @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) + _AT_M)


def cut(corners_m: Float32Array, area_m2: float, kind: str, seed: int) -> Float32Array:
    """(N, 3, 3) float32: triangles halved until none is larger than `area_m2`; see `KINDS`."""
    rng = np.random.default_rng(seed)
    turn = 0
    while True:
        e, f = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
        large = np.linalg.norm(np.cross(e, f).astype(np.float64), axis=1) / 2 > area_m2
        if not large.any():
            return corners_m
        mine = corners_m[large]
        if kind == "longest edge":
            edge = (np.roll(mine, -1, axis=1) - mine).astype(np.float64)
            first = (edge**2).sum(axis=2).argmax(axis=1)
        else:
            first = rng.integers(0, 3, len(mine)) if kind == "at random" else np.full(len(mine), turn % 3)
        row, second = np.arange(len(mine)), (first + 1) % 3
        middle = (mine[row, first] + mine[row, second]) / np.float32(2.0)
        one, other = mine.copy(), mine.copy()
        one[row, second], other[row, first] = middle, middle
        corners_m = np.concatenate([corners_m[~large], one, other])
        turn += 1


def slenderness(corners_m: Float32Array) -> FloatArray:
    """(N,) longest edge over the height above it."""
    edge = (np.roll(corners_m, -1, axis=1) - corners_m).astype(np.float64)
    twice_m2 = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1)
    return np.asarray((edge**2).sum(axis=2).max(axis=1) / twice_m2)


def _beams(n: int, rng: np.random.Generator) -> tuple[Float32Array, Float32Array]:
    """A sensor before the wall, and unit directions (N, 3) to places on it, none within 1 cm of its rim."""
    u, v = rng.uniform(0.01, 3.99, n), rng.uniform(0.01, 2.49, n)
    origin = _placed(np.array([[1.7, -_AWAY_M, 1.3]]))[0]
    away = _placed(np.column_stack([u, np.zeros(n), v])) - origin
    return origin.astype(np.float32), (away / np.linalg.norm(away, axis=1, keepdims=True)).astype(np.float32)


def hits(corners_m: Float32Array, origin_m: Float32Array, beams: Float32Array) -> BoolArray:
    """(B,) bool: whether beams (B, 3) meet any of triangles (N, 3, 3), in float32 throughout."""
    found = np.zeros(len(beams), dtype=bool)
    one, zero = np.float32(1.0), np.float32(0.0)
    for a, b, c in corners_m:
        e, f, away = b - a, c - a, origin_m - a
        p = np.cross(beams, f)
        det = p @ e
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = one / det
            u = (p @ away) * inverse
            q = np.cross(away, e)
            v = (beams @ q) * inverse
            found |= (np.abs(det) > EPSILON) & (u >= zero) & (v >= zero) & (u + v <= one)
    return found


def _lost_by_engine(corners_m: Float32Array, origin_m: Float32Array, beams: Float32Array) -> int:
    scene = scene_from_arrays(corners_m.reshape(-1, 3).astype(np.float64), np.arange(3 * len(corners_m)).reshape(-1, 3))
    engine = open_engine(scene, make_patches(scene, max_area_m2=1.0))
    found = engine.cast_rays(
        np.tile(origin_m.astype(np.float64), (len(beams), 1)), beams.astype(np.float64), range_max_m=100.0
    )
    return int(np.isnan(found.range_m).sum())


def _say(numbers: Mapping[str, Any]) -> str:
    def each(key: str) -> str:
        return ", ".join(f"{kind} {numbers[key][kind]:.4g}" for kind in KINDS)

    return (
        f"{numbers['n_beams']} beams at a wall of 4 x 2.5 m from {_AWAY_M:g} m, cut to triangles of at most "
        f"{AREA_M2:g} m2 and {np.hypot(*_AT_M[:2]):.0f} m from the origin, all of which have to return. Of a "
        f"million, the usual test in float32 loses: {each('lost')}. The median triangle is longer than wide: "
        f"{each('median_length_over_width')} times. Our engine, whose triangles are larger by the bound of rounding, "
        f"loses of all these beams: {each('lost_by_our_engine')}."
    )


def _draw(bench: Bench, lost: dict[str, float]) -> tuple[Picture, ...]:
    from matplotlib.collections import PolyCollection

    shows = "A wall cut by its longest edges, by edges in turn and at random; returns lost"
    with chart(bench, "fig02.png", shows, columns=4, size_in=(3.2, 2.6)) as (_, axes, drawn):
        flat = _WALL_M[[[0, 1, 2], [0, 2, 3]]].astype(np.float32)
        for one, kind in zip(axes, KINDS, strict=False):
            triangles = cut(flat, _DRAWN_AREA_M2, kind, bench.seed)[:, :, [0, 2]]
            one.add_collection(PolyCollection(list(triangles), facecolor="none", edgecolor="#444444", linewidth=0.5))
            one.set_aspect("equal")
            one.set_axis_off()
            one.autoscale_view()
            one.set_title(kind, fontsize=9, loc="left")
        bars = axes[3].bar(list(lost), list(lost.values()), color=COLOURS[: len(lost)])
        axes[3].bar_label(bars, fmt="%.0f", fontsize=8)
        axes[3].tick_params(axis="x", labelsize=7)
        label(axes[3], "Returns lost, float32", "", "of a million beams")
    return tuple(drawn)

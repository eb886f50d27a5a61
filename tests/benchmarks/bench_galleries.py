"""Galleries extruded: stations of our plans beside the optimum of the art gallery problem.

    python -m tests.benchmarks.bench_galleries [--write docs/benchmarks/drawings.md]

1. Galleries of scenes_synthetic whose fewest guards are proven by hand, and polygons of TLSPLIB's galleries, read from
   ../shared/data/agp. Their optimum is computed here, for guards at least 1 cm and at least 0.4 m from walls.
2. Each is raised to 2.7 m and planned by `tlsplan plan --effort quick`: an ideal scanner, no network, and its floor
   alone to be covered, by 100 % and by 99 %.
   and by 99 %.

The optimum is that of Tozoni, de Rezende and de Souza (2013, The Quest for Optimal Solutions for the Art Gallery
Problem): the fewest guards that see some witnesses is a lower bound; where they see all of the gallery, it is the
optimum; else the parts that they miss get witnesses, too. Guards come from the corners and the faces of the
arrangement of what witnesses see: every set of witnesses that one spot sees is seen from such a one. What a spot
sees is computed by scenes_synthetic.plan_view, in rational numbers. Not a test: nothing here fails.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.optimize import LinearConstraint, milp

from planner_core.model import BoolArray, FloatArray
from scenes_synthetic import build
from scenes_synthetic.plan_view import Edge, Exact, edges_of, exact, sights
from tests.benchmarks.bench_drawings import DATA, put

PROVEN = ("comb-gallery", "plus-corridor", "spiral", "column-hall")
#: Polygons of docs/tlsplib/tlsplib/catalogue.py, and metres in their unit there.
POLYGONS = (("simple_40_13", 1.5), ("simple_40_5", 1.3), ("general_40_20", 1.0))
HEIGHT_M = 2.7
NEAREST_M, CLEARANCE_M = 0.01, 0.4
"""Guards stand this far from walls at least: almost anywhere, and as tripods do."""
_SAME_M = 1e-7
_LEAST_MISSED_M2 = 1e-5
_MOST_ROUNDS = 60
#: A witness lies off the middle of what is missed: on no line through two corners.
_OFF = np.array([0.0137, 0.0071])

IDEAL = {
    "name": "ideal",
    "title": "Ideal scanner",
    "source": "looks everywhere, as far as there is to see",
    "range_min_m": 0.01,
    "range_max_m": 500,
    "elevation_deg": {"first": 90, "last": -90},
    "modes": [{"id": "only", "title": "0.05 degrees", "step_deg": 0.05, "seconds": 60}],
    "default_mode": "only",
    "instrument_height_min_m": 1.4,
    "instrument_height_max_m": 1.8,
}


# ---------------------------------------------------------------------------------------------- the optimum
@dataclass(frozen=True)
class Optimum:
    """n : the fewest guards, or a lower bound. is_reached : whether so many see all that can be seen."""

    n: int
    is_reached: bool

    def __str__(self) -> str:
        return f"{self.n}" if self.is_reached else f"{self.n} or more"


def optimum(room: Any, clearance_m: float) -> Optimum:
    """The fewest guards for a room (shapely Polygon, metres), at least `clearance_m` from its walls."""
    rings = [ring.coords[:-1] for ring in (room.exterior, *room.interiors)]
    edges = [edge for ring in rings for edge in edges_of(ring, [""] * len(ring))]
    stands = room.buffer(-clearance_m, join_style="mitre")
    witnesses = [_off_middle(part) for part in _near_corners(room)]
    seen_of = [_seen(edges, at) for at in witnesses]
    guards: FloatArray = np.empty((0, 2))
    for _ in range(_MOST_ROUNDS):
        reach = [shapely.intersection(seen, stands) for seen in seen_of]
        kept = [each.area > _LEAST_MISSED_M2 for each in reach]  # else no guard sees it
        spots, sees = _spots([each for each, is_kept in zip(reach, kept, strict=True) if is_kept])
        guards = spots[_cover(sees)]
        seen = shapely.union_all([_seen(edges, tuple(at)) for at in guards.tolist()])
        missed = [part for part in shapely.get_parts(shapely.difference(room, seen)) if part.area > _LEAST_MISSED_M2]
        new = [at for at in map(_off_middle, missed) if at not in witnesses]
        seen_new = [_seen(edges, at) for at in new]
        if not any(shapely.intersection(each, stands).area > _LEAST_MISSED_M2 for each in seen_new):
            return Optimum(len(guards), is_reached=True)
        witnesses, seen_of = witnesses + new, seen_of + seen_new
    return Optimum(len(guards), is_reached=False)


def _near_corners(room: Any) -> list[Any]:
    """Where a gallery is hardest to see: the pieces of it about its corners."""
    corners = shapely.points(shapely.get_coordinates(room))
    pieces = [shapely.intersection(room, disc) for disc in shapely.buffer(corners, 0.05)]
    return list(dict.fromkeys(part for piece in pieces for part in shapely.get_parts(piece).tolist()))


def _off_middle(part: Any) -> tuple[float, float]:
    """A spot in general position inside of a part of a gallery."""
    middle = shapely.get_coordinates(part.representative_point())[0]
    for size in (1.0, 0.3, 0.1, 0.03, 0.01, 0.001):
        at = middle + size * _OFF * np.sqrt(part.area)
        if shapely.contains_xy(part, *at):
            return float(at[0]), float(at[1])
    return float(middle[0]), float(middle[1])


def _seen(edges: list[Edge], at: tuple[float, ...]) -> Any:
    """What a spot sees, shapely Polygon."""
    spot: Exact = exact((at[0], at[1]))
    triangles = [[_float(spot), _float(sight.start), _float(sight.end)] for sight in sights(edges, spot)]
    return shapely.union_all([each for each in map(shapely.Polygon, triangles) if each.area > 0.0], grid_size=1e-9)


def _float(at: Exact) -> tuple[float, float]:
    return float(at[0]), float(at[1])


def _spots(reach: list[Any]) -> tuple[FloatArray, BoolArray]:
    """Spots (S, 2), and which of W witnesses each sees, (S, W): a spot of each largest set."""
    lines = shapely.union_all([each.boundary for each in reach])
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines).tolist()))
    inner = shapely.get_coordinates(shapely.point_on_surface(faces))
    corners = np.unique(shapely.get_coordinates(lines), axis=0)
    spots = np.vstack([inner, corners])
    points = shapely.points(spots)
    sees = np.empty((len(spots), len(reach)), dtype=np.bool_)
    for column, area in enumerate(reach):
        wide = area.buffer(_SAME_M)
        shapely.prepare(wide)
        sees[:, column] = shapely.contains(wide, points)
    _, first = np.unique(sees, axis=0, return_index=True)
    first = np.sort(first)  # of the same set, a face's middle comes before a corner
    spots, sees = spots[first], sees[first]
    order = np.argsort(-sees.sum(axis=1), kind="stable")
    kept: list[int] = []
    for row in order.tolist():
        if not kept or not (sees[row] <= sees[kept]).all(axis=1).any():
            kept.append(row)
    return spots[kept], sees[kept]


def _cover(sees: BoolArray) -> list[int]:
    """Rows of the fewest spots that see every witness."""
    n = len(sees)
    found = milp(np.ones(n), constraints=LinearConstraint(sees.T.astype(float), lb=1.0), integrality=np.ones(n),
                 bounds=(0, 1))  # fmt: skip
    return [int(row) for row in np.flatnonzero(found.x > 0.5)]


# ---------------------------------------------------------------------------------------------- galleries
def galleries() -> Iterator[tuple[str, Any, int | None]]:
    """Name, shapely Polygon in metres, and the fewest guards where they are proven by hand."""
    for name in PROVEN:
        scene = build(name)
        room = shapely.Polygon(scene.rooms[0].outline_m)
        for part in scene.parts:
            if part.name.startswith("Column"):
                room = room.difference(shapely.MultiPoint(part.solid.vertices_m[:, :2]).convex_hull)
        yield name, room, len(scene.truth.stations_m)
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs" / "tlsplib"))
    from tlsplib.gallery import plan_of

    for name, unit_m in POLYGONS:
        walls = plan_of(DATA / "agp" / f"{name}.graphml.xz", unit_cm=round(100 * unit_m)).walls
        lines = 0.01 * np.array(walls, dtype=np.float64).reshape(-1, 2, 2)
        rings = sorted(shapely.get_parts(shapely.polygonize(shapely.linestrings(lines))), key=lambda ring: -ring.area)
        room = shapely.Polygon(rings[0].exterior)
        yield f"TLSPLIB, {name}", room.difference(shapely.union_all(rings[1:])) if rings[1:] else rings[0], None


def raise_to_obj(room: Any, path: Path) -> None:
    """Write a gallery as floor, ceiling and walls without thickness."""
    rows, objects = [], {"floor": [], "ceiling": [], "wall": []}  # type: ignore[var-annotated]

    def corner(x: float, y: float, z: float) -> int:
        rows.append(f"v {x:.6f} {y:.6f} {z:.6f}")
        return len(rows)

    for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(room)):
        around = shapely.get_coordinates(shapely.orient_polygons(triangle))[:3].tolist()
        objects["floor"].append([corner(x, y, 0.0) for x, y in around])
        objects["ceiling"].append([corner(x, y, HEIGHT_M) for x, y in around[::-1]])
    for ring in (room.exterior, *room.interiors):
        along = shapely.get_coordinates(ring).tolist()
        for (x0, y0), (x1, y1) in pairwise(along):
            foot, top = (corner(x0, y0, 0.0), corner(x1, y1, 0.0)), (corner(x1, y1, HEIGHT_M), corner(x0, y0, HEIGHT_M))
            objects["wall"].append([*foot, *top])
    lines = [*rows]
    for name, polygons in objects.items():
        lines += [f"o {name}", *("f " + " ".join(map(str, each)) for each in polygons)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def stations(folder: Path, room: Any, percent: float) -> str:
    """Plan a gallery."""
    scene, scanner, out = folder / "gallery.obj", folder / "ideal.json", folder / f"plan-{percent:g}"
    raise_to_obj(room, scene)
    scanner.write_text(json.dumps(IDEAL), encoding="utf-8")
    command = [sys.executable, "-m", "tlsplan", "plan", scene, "--scanner", scanner, "--scope", "all", "--deliverable",
               "none", "--no-cover", "name=wall", "--no-cover", "name=ceiling", "--network", "none", "--coverage",
               f"{percent:g}", "--clearance", f"{CLEARANCE_M:g}", "--effort", "quick", "--verify", "0", "-o", out,
               "--overwrite", "--json"]  # fmt: skip
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if not done.stdout:
        raise SystemExit(done.stderr)
    found = json.loads(done.stdout)
    return f"{len(found['stations'])}"


def table(only: str) -> Iterator[str]:
    yield (
        "| gallery | corners | floor, m² | optimum, proven by hand | optimum | 0.4 m from walls "
        "| stations, 100 % | stations, 99 % |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for name, room, proven in galleries():
        if only not in name:
            continue
        corners = len(shapely.get_coordinates(room)) - 1 - len(room.interiors)
        best, best_clear = optimum(room, NEAREST_M), optimum(room, CLEARANCE_M)
        with tempfile.TemporaryDirectory() as folder:
            ours = [stations(Path(folder), room, percent) for percent in (100.0, 99.0)]
        yield (
            f"| {name} | {corners} | {room.area:.0f} | {proven or ''} | {best} | {best_clear} | {ours[0]} | {ours[1]} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", default="", help="galleries with this in their name")
    given = parser.parse_args()
    rows = []
    for row in table(given.only):
        rows.append(row)
        print(row, flush=True)
    if given.write:
        put(given.write, "galleries", rows)


if __name__ == "__main__":
    main()

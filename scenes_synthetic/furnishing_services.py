"""Services of real triangle density: sanitary ware, radiators, lamps, ducts, pipes, boilers, columns, round balusters.

Fixtures as in `furniture`: centred on x = 0, back at y = 0, front towards -y. Runs (ducts, pipes, railings) and columns
are given where they go, in the scene's frame.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from scenes_synthetic.model import Part
from scenes_synthetic.solids import Point, Solid, box, join, rectilinear
from scenes_synthetic.tessellated import (
    bent,
    circle,
    copies,
    cylinder,
    ellipsoid,
    lathe,
    pipe,
    rectangle,
    rounded_box,
    sweep,
)


def toilet(*, n_sides: int = 24) -> Solid:
    """An oval bowl with its seat, and a cistern with its button."""
    bowl = [
        (0.0, 0.0), (0.11, 0.0), (0.1, 0.08), (0.12, 0.2), (0.175, 0.36), (0.185, 0.4),
        (0.15, 0.4), (0.13, 0.3), (0.06, 0.19), (0.0, 0.17),
    ]  # fmt: skip
    seat = [(0.12, 0.405), (0.19, 0.405), (0.195, 0.415), (0.19, 0.425), (0.12, 0.425)]
    middle, oval = (0.0, -0.42, 0.0), (1.0, 1.25)
    return join(
        [
            lathe(bowl, n_sides=n_sides, at_m=middle, stretch=oval),
            lathe(seat, n_sides=n_sides, at_m=middle, stretch=oval),
            rounded_box((-0.19, -0.18, 0.4), (0.19, 0.0, 0.8), 0.04, n_corner=max(2, n_sides // 6), n_edge=2),
            cylinder((0.0, -0.09, 0.801), 0.025, 0.012, n_sides=n_sides),
        ]
    )


def washbasin(*, n_sides: int = 24) -> Solid:
    """An oval basin on a turned pedestal, with a tap."""
    bowl = [
        (0.0, 0.66), (0.08, 0.66), (0.17, 0.72), (0.235, 0.82), (0.25, 0.85),
        (0.215, 0.85), (0.18, 0.78), (0.09, 0.72), (0.0, 0.71),
    ]  # fmt: skip
    foot = [(0.0, 0.0), (0.11, 0.0), (0.075, 0.1), (0.06, 0.4), (0.075, 0.655), (0.0, 0.655)]
    tap = bent([(0.0, -0.05, 0.84), (0.0, -0.05, 0.98), (0.0, -0.17, 0.98), (0.0, -0.17, 0.94)], 0.03, n_bend=4)
    middle = (0.0, -0.24, 0.0)
    return join(
        [
            lathe(bowl, n_sides=n_sides, at_m=middle, stretch=(1.15, 0.9)),
            lathe(foot, n_sides=n_sides, at_m=(0.0, -0.16, 0.0)),
            pipe(tap, 0.012, n_sides=max(6, n_sides // 2)),
            ellipsoid((0.0, -0.05, 1.0), (0.03, 0.02, 0.015), n_sides=max(6, n_sides // 2), n_rings=4),
        ]
    )


def urinal(*, n_sides: int = 24) -> Solid:
    """A deep oval shell on the wall."""
    shell = [
        (0.0, 0.5), (0.06, 0.5), (0.13, 0.56), (0.17, 0.75), (0.175, 1.0),
        (0.15, 1.0), (0.14, 0.76), (0.08, 0.6), (0.0, 0.58),
    ]  # fmt: skip
    return lathe(shell, n_sides=n_sides, at_m=(0.0, -0.18, 0.0))


def radiator(width_m: float, height_m: float = 0.6, *, n_sides: int = 8, foot_m: float = 0.12) -> Solid:
    """Pairs of upright tubes between two headers, with a valve; it hangs on the wall."""
    n = max(3, int((width_m - 0.05) / 0.05))
    x = np.linspace(-width_m / 2 + 0.04, width_m / 2 - 0.04, n)
    tube = cylinder((0.0, 0.0, 0.0), 0.013, height_m - 0.06, n_sides=n_sides)
    spots = [(float(v), y, foot_m + 0.03) for v in x for y in (-0.05, -0.11)]
    pieces = [copies(tube, spots)]
    for z in (foot_m + 0.03, foot_m + height_m - 0.03):
        for y in (-0.05, -0.11):
            pieces.append(pipe([(-width_m / 2, y, z), (width_m / 2, y, z)], 0.019, n_sides=n_sides))
    valve = [(0.0, 0.0), (0.02, 0.0), (0.025, 0.05), (0.015, 0.07), (0.0, 0.07)]
    pieces.append(lathe(valve, n_sides=2 * n_sides, at_m=(width_m / 2 + 0.01, -0.08, foot_m)))
    return join(pieces)


def panel_radiator(width_m: float, height_m: float = 0.6, *, foot_m: float = 0.12) -> Solid:
    """Two flat panels with soft edges, a pipe to each end, a valve; it hangs on the wall."""
    half, z = width_m / 2, foot_m + 0.06
    panels = [
        rounded_box((-half, y, foot_m), (half, y + 0.03, foot_m + height_m), 0.014, n_corner=1, n_edge=1)
        for y in (-0.14, -0.08)
    ]
    feed = bent([(half - 0.05, -0.11, z), (half + 0.08, -0.11, z), (half + 0.08, -0.11, 0.0)], 0.03, n_bend=2)
    valve = [(0.0, 0.0), (0.025, 0.0), (0.02, 0.06), (0.0, 0.06)]
    return join([*panels, pipe(feed, 0.01, n_sides=5), lathe(valve, n_sides=8, at_m=(half + 0.08, -0.11, z + 0.02))])


def louvre_lamp(length_m: float = 1.2, width_m: float = 0.3, *, n_blades: int = 12) -> Solid:
    """A ceiling luminaire 0.08 m deep, open below behind cross blades; its top is z = 0, its middle the origin."""
    edge, blade = 0.02, 0.004
    bays = np.linspace(-length_m / 2 + edge, length_m / 2 - edge, n_blades + 2)
    ends = [-length_m / 2, bays[0], bays[-1], length_m / 2]
    x = np.sort(np.concatenate([ends, bays[1:-1] - blade / 2, bays[1:-1] + blade / 2]))
    y = [-width_m / 2, -width_m / 2 + edge, -blade / 2, blade / 2, width_m / 2 - edge, width_m / 2]
    filled = np.ones((x.size - 1, 5, 2), dtype=bool)
    filled[1::2, 1, 0] = filled[1::2, 3, 0] = False
    return rectilinear(x, y, [-0.08, -0.02, 0.0], filled=filled)


def pendant_lamp(drop_m: float = 0.8, *, n_sides: int = 20) -> Solid:
    """A bell on a cord; z = 0 is the ceiling."""
    bell = [
        (0.0, 0.02), (0.03, 0.03), (0.1, -0.02), (0.19, -0.17), (0.2, -0.2),
        (0.21, -0.2), (0.2, -0.16), (0.11, 0.0), (0.04, 0.05), (0.0, 0.05),
    ]  # fmt: skip
    return join(
        [
            cylinder((0.0, 0.0, -0.02), 0.05, 0.02, n_sides=n_sides),
            pipe([(0.0, 0.0, -0.021), (0.0, 0.0, -drop_m + 0.04)], 0.006, n_sides=6),
            lathe(bell, n_sides=n_sides, at_m=(0.0, 0.0, -drop_m)),
            ellipsoid((0.0, 0.0, -drop_m - 0.06), (0.035, 0.035, 0.05), n_sides=n_sides, n_rings=n_sides // 3),
        ]
    )


def grille(width_m: float = 0.6, *, n_slats: int = 14) -> Solid:
    """A square air outlet with slats, flush with the ceiling z = 0."""
    half, edge = width_m / 2, 0.03
    lines = np.linspace(-half + edge, half - edge, 2 * n_slats + 2)
    x = [-half, *lines.tolist(), half]
    filled = np.ones((len(x) - 1, 3, 2), dtype=bool)
    filled[1::2, 1, 0] = False
    return rectilinear(x, [-half, -half + edge, half - edge, half], [-0.02, -0.006, 0.0], filled=filled)


def column(name: str, storey: int, at_m: Point, radius_m: float, height_m: float, *, n_sides: int = 32) -> Part:
    """Build a round column, as a prism of many sides, on a base ring."""
    near, far = radius_m + 0.005, radius_m + 0.04
    base = lathe([(near, 0.0), (far, 0.0), (far, 0.08), (near, 0.12)], n_sides=n_sides, at_m=at_m)
    shaft = cylinder(at_m, radius_m, height_m, n_sides=n_sides)
    return Part(name, "IfcColumn", storey, join([shaft, base]), predefined_type="COLUMN")


def duct(name: str, storey: int, path_m: Sequence[Point], width_m: float, height_m: float, *, n_bend: int = 6) -> Part:
    """Build a sheet metal duct with round bends, flanges every metre and a half and hangers."""
    outline = rectangle(width_m, height_m)
    pieces = [sweep(bent(path_m, 0.8 * width_m, n_bend=n_bend), outline)]
    for start, end in itertools.pairwise(path_m):
        a, b = np.asarray(start), np.asarray(end)
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        for at in np.arange(width_m, length - 0.8 * width_m, 1.5):
            middle = a + at * along
            pieces.append(
                sweep([middle - 0.02 * along, middle + 0.02 * along], 1.02 * outline + 0.04 * np.sign(outline))
            )
    return Part(name, "IfcDuctSegment", storey, join(pieces), predefined_type="RIGIDSEGMENT")


def pipe_run(name: str, storey: int, path_m: Sequence[Point], radius_m: float, *, n_sides: int = 16) -> Part:
    """Build a pipe with round bends and a sleeve every two metres."""
    pieces = [pipe(bent(path_m, 3 * radius_m, n_bend=6), radius_m, n_sides=n_sides)]
    for start, end in itertools.pairwise(path_m):
        a, b = np.asarray(start), np.asarray(end)
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        for at in np.arange(6 * radius_m, length - 5 * radius_m, 2.0):
            middle = a + at * along
            pieces.append(sweep([middle - 0.03 * along, middle + 0.03 * along], circle(1.25 * radius_m, n_sides)))
    return Part(name, "IfcPipeSegment", storey, join(pieces), predefined_type="RIGIDSEGMENT")


def boiler(radius_m: float = 0.5, height_m: float = 1.9, *, n_sides: int = 48) -> Solid:
    """A standing tank with domed ends on three feet, with a man hole and a gauge; centred on its axis."""
    dome = [(radius_m * np.cos(t), 0.35 * radius_m * np.sin(t)) for t in np.linspace(0, np.pi / 2, 9)]
    foot, head = 0.15 + 0.35 * radius_m, height_m - 0.35 * radius_m
    below = [(float(r), float(foot - z)) for r, z in dome[-2::-1]]
    above = [(float(r), float(head + z)) for r, z in dome[:-1]]
    profile = [(0.0, 0.15), *below, *above, (0.0, height_m)]
    pieces = [lathe(profile, n_sides=n_sides)]
    for turn in np.deg2rad([30.0, 150.0, 270.0]):
        at = (0.7 * radius_m * float(np.cos(turn)), 0.7 * radius_m * float(np.sin(turn)), 0.0)
        pieces.append(cylinder(at, 0.04, 0.3, n_sides=12))
    y = -radius_m
    pieces.append(sweep([(0.0, y + 0.05, 1.0), (0.0, y - 0.06, 1.0)], circle(0.2, 24)))
    pieces.append(sweep([(0.0, y + 0.05, 1.45), (0.0, y - 0.04, 1.45)], circle(0.06, 24)))
    return join(pieces)


def pump(*, n_sides: int = 20) -> Solid:
    """A motor and a pump housing on a base plate."""
    fins = [box((-0.1 + 0.04 * i, -0.34, 0.2), (-0.08 + 0.04 * i, -0.06, 0.42)) for i in range(6)]
    return join(
        [
            rounded_box((-0.4, -0.4, 0.0), (0.3, 0.0, 0.1), 0.03),
            sweep([(-0.15, -0.2, 0.3), (0.2, -0.2, 0.3)], circle(0.13, n_sides)),
            *fins,
            ellipsoid((-0.25, -0.2, 0.3), (0.12, 0.18, 0.18), n_sides=n_sides, n_rings=n_sides // 2),
            cylinder((-0.25, -0.2, 0.45), 0.05, 0.3, n_sides=n_sides),
        ]
    )


def round_railing(
    name: str, storey: int, start_m: Point, end_m: Point, *, height_m: float = 1.1, n_sides: int = 6
) -> Part:
    """Build a round hand rail and a lower rail on round balusters 0.13 m apart, between two points at floor height."""
    start, end = np.asarray(start_m), np.asarray(end_m)
    length = float(np.linalg.norm(end - start))
    share = np.linspace(0.0, 1.0, max(2, round(length / 0.13) + 1))[1:-1, None]
    high, low = np.array([0.0, 0.0, height_m - 0.025]), np.array([0.0, 0.0, 0.1])
    baluster = cylinder((0.0, 0.0, 0.1), 0.008, height_m - 0.12, n_sides=n_sides)
    post = cylinder((0.0, 0.0, 0.0), 0.02, height_m - 0.02, n_sides=2 * n_sides)
    n_posts = max(2, round(length / 1.8) + 1)
    inset = 0.03 / length
    posts = start + np.linspace(inset, 1 - inset, n_posts)[:, None] * (end - start)
    pieces = [
        pipe([start + high, end + high], 0.025, n_sides=2 * n_sides),
        pipe([start + low, end + low], 0.012, n_sides=n_sides),
        copies(baluster, start + share * (end - start)),
        copies(post, posts),
    ]
    return Part(name, "IfcRailing", storey, join(pieces), predefined_type="BALUSTRADE")


def stair_rail(
    name: str, storey: int, foot_m: Point, *, going_m: float, riser_m: float, n_treads: int, n_sides: int = 6
) -> Part:
    """Build a hand rail that climbs along +y, 0.95 m over the treads, on a post every five or six of them.

    foot_m : where the flight begins, below the rail; the first post stands on the middle of the first tread.
    """
    height = 0.95
    tread = np.unique(np.round(np.linspace(1, n_treads, max(2, round(n_treads / 5.5) + 1))))
    spots = np.column_stack([np.zeros(tread.size), (tread - 0.5) * going_m, tread * riser_m]) + np.asarray(foot_m)
    overhang = np.array([0.0, 0.3 * going_m, 0.3 * riser_m])
    rail = np.array([spots[0] - overhang, spots[-1] + overhang]) + np.array([0.0, 0.0, height])
    post = cylinder((0.0, 0.0, 0.0), 0.018, height - 0.01, n_sides=n_sides)
    solid = join([pipe(rail, 0.022, n_sides=2 * n_sides), copies(post, spots)])
    return Part(name, "IfcRailing", storey, solid, predefined_type="HANDRAIL")


def barrel(*, n_sides: int = 32) -> Solid:
    """A drum with two hoops, 0.88 m high; centred on its axis."""
    profile = [
        (0.0, 0.0), (0.29, 0.0), (0.29, 0.28), (0.305, 0.3), (0.29, 0.32), (0.29, 0.56), (0.305, 0.58), (0.29, 0.6),
        (0.29, 0.88), (0.27, 0.88), (0.27, 0.86), (0.0, 0.86),
    ]  # fmt: skip
    return lathe(profile, n_sides=n_sides)


def _upright(solid: Solid) -> Solid:
    """Tip a solid turned about z so that its axle is parallel to y."""
    x, y, z = solid.vertices_m.T
    return Solid(np.stack([x, -z, y], axis=1), solid.triangles)


def bicycle(*, n_sides: int = 8, n_around: int = 40) -> Solid:
    """Two wheels with spokes, a frame of tubes, saddle, handle bar; 1.7 m along x, centred on its middle."""
    radius, tyre = 0.33, 0.02
    ring = circle(tyre, n_sides) + np.array([radius - tyre, 0.0])
    wheel = _upright(lathe([(float(r), float(z)) for r, z in ring], n_sides=n_around))
    spokes = []
    for turn in np.arange(12) * np.pi / 6:
        c, s = float(np.cos(turn)), float(np.sin(turn))
        spokes.append(pipe([(0.02 * c, 0.0, 0.02 * s), (0.3 * c, 0.001, 0.3 * s)], 0.002, n_sides=4))
    hub = sweep([(0.0, -0.04, 0.0), (0.0, 0.04, 0.0)], circle(0.025, 12))
    front, rear = (0.53, 0.0, radius), (-0.53, 0.0, radius)
    crank, saddle, head = (-0.1, 0.0, 0.3), (-0.28, 0.0, 0.86), (0.36, 0.0, 0.84)
    tubes = [(crank, saddle), (crank, head), (rear, crank), (rear, (-0.25, 0.0, 0.78)), ((-0.24, 0.0, 0.74), head)]
    bar = bent([(0.25, -0.28, 0.98), (0.38, -0.2, 0.98), (0.38, 0.2, 0.98), (0.25, 0.28, 0.98)], 0.05, n_bend=4)
    return join(
        [
            copies(join([wheel, hub, *spokes]), [front, rear]),
            *(pipe(ends, 0.016, n_sides=n_sides) for ends in tubes),
            pipe([front, (0.37, 0.0, 0.98)], 0.017, n_sides=n_sides),
            pipe(bar, 0.012, n_sides=n_sides),
            ellipsoid((-0.29, 0.0, 0.89), (0.13, 0.07, 0.03), n_sides=2 * n_sides, n_rings=6),
        ]
    )


def cartons(width_m: float, depth_m: float, rng: np.random.Generator, *, n: int = 4) -> Solid:
    """A row of boxes with soft edges, of uneven height, one beside the other."""
    edges = np.linspace(-width_m / 2, width_m / 2, n + 1)
    heights = rng.uniform(0.2, 0.42, size=n)
    deep = rng.uniform(0.7, 1.0, size=n) * depth_m
    return join(
        [
            rounded_box((a + 0.01, -d, 0.0), (b - 0.01, -0.01, h), 0.015, n_corner=1, n_edge=1)
            for a, b, d, h in zip(edges[:-1], edges[1:], deep, heights, strict=True)
        ]
    )


def sprinkler(*, n_sides: int = 12) -> Solid:
    """A sprinkler head under the ceiling z = 0."""
    profile = [
        (0.0, -0.09),
        (0.03, -0.09),
        (0.03, -0.085),
        (0.008, -0.07),
        (0.012, -0.03),
        (0.04, -0.006),
        (0.0, -0.006),
    ]
    return lathe(profile, n_sides=n_sides)

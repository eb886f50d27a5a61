"""Seats of real triangle density: tube chairs with curved backs, swivel chairs with castors, armchairs, turned chairs.

As in `furniture`: centred on x = 0, standing on z = 0, back at y = 0, front towards -y.
"""

from __future__ import annotations

import itertools

import numpy as np

from planner_core.model import FloatArray
from scenes_synthetic.solids import Solid, join, place
from scenes_synthetic.tessellated import (
    bent,
    circle,
    copies,
    cylinder,
    lathe,
    pipe,
    rectangle,
    rounded_box,
    rounded_rectangle,
    sweep,
)


def _arc(width_m: float, sag_m: float, y_m: float, z_m: float, *, n: int) -> FloatArray:
    """(n + 1, 3) points along x that bulge to +y in the middle: the path of a curved back."""
    share = np.linspace(-1.0, 1.0, n + 1)
    return np.column_stack([share * width_m / 2, y_m + sag_m * (1 - share**2), np.full(n + 1, z_m)])


def _on_ground(solid: Solid) -> Solid:
    """Cut the feet of slanting tubes level with the floor."""
    vertices = solid.vertices_m.copy()
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.0)
    return Solid(vertices, solid.triangles)


def school_chair(*, n_sides: int = 5) -> Solid:
    """A seat and a curved back of plywood on bent steel tubes: what class rooms have."""
    tube = 0.012
    pieces = []
    for x in (-0.18, 0.18):
        front = [(x, -0.41, 0.0), (x, -0.39, 0.42), (x, -0.07, 0.42), (x, -0.03, 0.8)]
        pieces.append(pipe(bent(front, 0.05, n_bend=1), tube, n_sides=n_sides))
        pieces.append(pipe([(x * 0.9, -0.1, 0.42), (x * 0.95, -0.015, 0.0)], tube, n_sides=n_sides))
    seat = [(0.0, -0.43, 0.43), (0.0, -0.39, 0.445), (0.0, -0.15, 0.44), (0.0, -0.06, 0.455)]
    pieces.append(sweep(seat, rectangle(0.4, 0.014)))
    pieces.append(sweep(_arc(0.4, 0.03, -0.055, 0.72, n=3), rectangle(0.014, 0.18)))
    return _on_ground(join(pieces))


def _lying_wheel(x_m: float, y_m: float, radius_m: float, width_m: float, *, n_sides: int) -> Solid:
    """A wheel whose axle is parallel to x, with bevelled rims."""
    ring = circle(radius_m, n_sides)
    middle = (x_m - width_m / 2, y_m, radius_m)
    path = [middle, (x_m + width_m / 2, y_m, radius_m)]
    return sweep(path, ring)


def swivel_chair(*, n_sides: int = 12, arms: bool = True) -> Solid:
    """An office chair: five feet with twin castors, a gas spring, upholstered seat and back, arm rests."""
    middle = -0.3
    pieces = [
        lathe(
            [
                (0.0, 0.06),
                (0.05, 0.06),
                (0.055, 0.12),
                (0.03, 0.16),
                (0.026, 0.36),
                (0.09, 0.38),
                (0.1, 0.41),
                (0, 0.41),
            ],
            n_sides=2 * n_sides,
            at_m=(0.0, middle, 0.0),
        )
    ]
    foot = join(
        [
            pipe(bent([(0.04, 0.0, 0.1), (0.2, 0.0, 0.1), (0.29, 0.0, 0.075)], 0.1, n_bend=3), 0.018, n_sides=n_sides),
            _lying_wheel(0.27, -0.02, 0.028, 0.03, n_sides=2 * n_sides),
            _lying_wheel(0.27, 0.02, 0.028, 0.03, n_sides=2 * n_sides),
            cylinder((0.285, 0.0, 0.04), 0.008, 0.03, n_sides=n_sides),
        ]
    )
    pieces += [place(foot, (0.0, middle, 0.0), turn_deg=18.0 + 72.0 * i) for i in range(5)]
    fine = max(2, n_sides // 3)
    pieces.append(rounded_box((-0.25, -0.54, 0.42), (0.25, -0.06, 0.5), 0.09, n_corner=2 * fine, n_edge=2 * fine))
    back = rounded_rectangle(0.06, 0.5, 0.028, n_corner=fine)
    pieces.append(sweep(_arc(0.44, 0.06, -0.1, 0.84, n=3 * n_sides), back))
    spine = bent([(0.0, -0.2, 0.4), (0.0, -0.02, 0.4), (0.0, -0.03, 0.85)], 0.1, n_bend=4)
    pieces.append(pipe(spine, 0.02, n_sides=n_sides))
    for side in (-1.0, 1.0) if arms else ():
        post = [(side * 0.2, -0.3, 0.43), (side * 0.3, -0.3, 0.43), (side * 0.3, -0.3, 0.67)]
        pieces.append(pipe(bent(post, 0.05, n_bend=4), 0.016, n_sides=n_sides))
        x = sorted((side * 0.265, side * 0.335))
        pad = rounded_box((x[0], -0.44, 0.66), (x[1], -0.18, 0.69), 0.03, n_corner=fine, n_edge=2)
        pieces.append(pad)
    return join(pieces)


def turned_chair(*, n_sides: int = 12) -> Solid:
    """A wooden chair: turned legs and spindles, a soft seat, a bowed top rail."""
    turned = [
        (0.0, 0.0),
        (0.014, 0.0),
        (0.022, 0.08),
        (0.014, 0.11),
        (0.02, 0.2),
        (0.024, 0.32),
        (0.015, 0.36),
        (0.022, 0.42),
    ]
    leg = lathe([*turned, (0.0, 0.42)], n_sides=n_sides)
    feet = [(sx * 0.17, y, 0.0) for sx in (-1, 1) for y in (-0.39, -0.07)]
    spindle = lathe(
        [(0.0, 0.45), (0.008, 0.45), (0.013, 0.6), (0.008, 0.72), (0.01, 0.83), (0.0, 0.83)], n_sides=n_sides
    )
    share = np.linspace(-0.8, 0.8, 6)
    spots = np.column_stack([share * 0.19, -0.065 + 0.03 * (1 - share**2), np.zeros(6)])
    fine = max(2, n_sides // 4)
    return join(
        [
            copies(leg, feet),
            rounded_box((-0.21, -0.44, 0.415), (0.21, -0.02, 0.465), 0.06, n_corner=2 * fine, n_edge=fine),
            copies(spindle, spots),
            sweep(_arc(0.42, 0.03, -0.065, 0.86, n=2 * n_sides), rounded_rectangle(0.03, 0.09, 0.012, n_corner=fine)),
        ]
    )


def armchair(width_m: float = 0.85, *, n_corner: int = 5) -> Solid:
    """Upholstery: base, seat cushions, back and two arms, on turned feet; wider than 1.3 m it is a sofa."""
    half, depth, n_edge = width_m / 2, 0.85, n_corner
    n_cushions = max(1, round((width_m - 0.4) / 0.6))
    foot = lathe([(0.0, 0.0), (0.02, 0.0), (0.03, 0.05), (0.035, 0.13), (0.0, 0.13)], n_sides=4 * n_corner)
    feet = [(sx * (half - 0.1), y, 0.0) for sx in (-1, 1) for y in (-depth + 0.1, -0.1)]

    def soft(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Solid:
        return rounded_box((x[0], y[0], z[0]), (x[1], y[1], z[1]), 0.06, n_corner=n_corner, n_edge=n_edge)

    pieces = [
        copies(foot, feet),
        soft((-half + 0.02, half - 0.02), (-depth, -0.02), (0.12, 0.3)),
        soft((-half, -half + 0.18), (-depth, -0.01), (0.14, 0.6)),
        soft((half - 0.18, half), (-depth, -0.01), (0.14, 0.6)),
        soft((-half + 0.17, half - 0.17), (-0.25, 0.0), (0.2, 0.82)),
    ]
    edges = np.linspace(-half + 0.185, half - 0.185, n_cushions + 1)
    for low, high in itertools.pairwise(edges):
        pieces.append(soft((low + 0.004, high - 0.004), (-depth - 0.01, -0.24), (0.295, 0.44)))
    return join(pieces)


def stool(height_m: float = 0.5, *, n_sides: int = 12) -> Solid:
    """A round seat on four splayed legs with a ring for the feet."""
    seat = lathe(
        [(0.0, -0.04), (0.15, -0.04), (0.165, -0.02), (0.15, 0.0), (0.0, 0.0)],
        n_sides=2 * n_sides,
        at_m=(0.0, -0.2, height_m),
    )
    pieces = [seat]
    for quarter in range(4):
        leg = pipe([(0.09, 0.0, height_m - 0.03), (0.17, 0.0, 0.0)], 0.012, n_sides=n_sides)
        pieces.append(place(leg, (0.0, -0.2, 0.0), turn_deg=45.0 + 90.0 * quarter))
    tyre = [(0.13, 0.15), (0.15, 0.15), (0.15, 0.165), (0.13, 0.165)]
    pieces.append(lathe(tyre, n_sides=2 * n_sides, at_m=(0.0, -0.2, 0.0)))
    return _on_ground(join(pieces))

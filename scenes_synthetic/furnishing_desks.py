"""Desks and what lies on them, shelves with books, cabinets, plants: furniture of real triangle density.

As in `furniture`: centred on x = 0, standing on z = 0, back at y = 0, front towards -y.
"""

from __future__ import annotations

import itertools

import numpy as np

from planner_core.model import FloatArray
from scenes_synthetic import furniture
from scenes_synthetic.solids import Solid, box, join
from scenes_synthetic.tessellated import (
    bent,
    copies,
    cylinder,
    ellipsoid,
    lathe,
    pipe,
    rectangle,
    rounded_box,
    rounded_rectangle,
    skin,
)

_STAND_M = [(0.0, 0.0), (0.11, 0.0), (0.1, 0.012), (0.02, 0.02), (0.0, 0.02)]
_LAMP_FOOT_M = [(0.0, 0.0), (0.09, 0.0), (0.085, 0.02), (0.02, 0.03), (0.0, 0.03)]


def school_desk(width_m: float = 1.3, depth_m: float = 0.55, *, n_sides: int = 5) -> Solid:
    """A pupils' table: a board with round corners on two bent frames of tube, and a bag rail."""
    half = width_m / 2
    pieces = [rounded_box((-half, -depth_m, 0.7), (half, 0.0, 0.725), 0.03, n_corner=1, n_edge=1)]
    for x in (-half + 0.08, half - 0.08):
        frame = [(x, -depth_m + 0.05, 0.0), (x, -depth_m + 0.05, 0.69), (x, -0.05, 0.69), (x, -0.05, 0.0)]
        pieces.append(pipe(bent(frame, 0.05, n_bend=1), 0.016, n_sides=n_sides))
    pieces.append(pipe([(-half + 0.09, -0.1, 0.55), (half - 0.09, -0.1, 0.55)], 0.01, n_sides=n_sides))
    return join(pieces)


def office_desk(width_m: float = 1.6, depth_m: float = 0.8, *, n_sides: int = 12) -> Solid:
    """A rounded top on two lifting columns with feet, a cable tray and a modesty panel."""
    half, fine = width_m / 2, max(2, n_sides // 3)
    pieces = [rounded_box((-half, -depth_m, 0.71), (half, 0.0, 0.74), 0.04, n_corner=2 * fine, n_edge=fine)]
    for x in (-half + 0.22, half - 0.22):
        pieces.append(cylinder((x, -depth_m / 2, 0.03), 0.045, 0.38, n_sides=2 * n_sides))
        pieces.append(cylinder((x, -depth_m / 2, 0.4), 0.038, 0.309, n_sides=2 * n_sides))
        low, high = (x - 0.04, -depth_m + 0.06, 0.0), (x + 0.04, -0.06, 0.035)
        pieces.append(rounded_box(low, high, 0.03, n_corner=fine, n_edge=2))
    pieces.append(box((-half + 0.3, -0.06, 0.45), (half - 0.3, -0.045, 0.7)))
    pieces.append(furniture.block(width_m - 0.7, 0.1, 0.04, foot_m=0.62))
    return join(pieces)


def pedestal(*, n_sides: int = 8) -> Solid:
    """A drawer unit on castors: 0.42 m wide, 0.58 m high, three fronts with bow handles."""
    pieces = [rounded_box((-0.21, -0.53, 0.06), (0.21, -0.01, 0.58), 0.015, n_corner=2, n_edge=2)]
    wheel = ellipsoid((0.0, 0.0, 0.031), (0.03, 0.03, 0.03), n_sides=n_sides, n_rings=3)
    pieces.append(copies(wheel, [(x, y, 0.0) for x in (-0.16, 0.16) for y in (-0.48, -0.06)]))
    for foot, head in ((0.08, 0.23), (0.24, 0.39), (0.4, 0.56)):
        pieces.append(rounded_box((-0.2, -0.55, foot), (0.2, -0.531, head), 0.008, n_corner=1, n_edge=1))
        z = (foot + head) / 2
        bow = [(-0.07, -0.545, z), (-0.07, -0.58, z), (0.07, -0.58, z), (0.07, -0.545, z)]
        pieces.append(pipe(bent(bow, 0.015, n_bend=2), 0.006, n_sides=n_sides))
    return join(pieces)


def computer(*, n_sides: int = 12, n_screens: int = 1) -> Solid:
    """Screens on stands, a keyboard with all its keys, a mouse: to be stood on a desk, 0.65 m deep."""
    pieces = []
    for i in range(n_screens):
        x = (i - (n_screens - 1) / 2) * 0.58
        pieces.append(rounded_box((x - 0.27, -0.2, 0.12), (x + 0.27, -0.16, 0.46), 0.012, n_corner=2, n_edge=2))
        neck = bent([(x, -0.15, 0.02), (x, -0.1, 0.2), (x, -0.17, 0.3)], 0.05, n_bend=3)
        pieces.append(pipe(neck, 0.018, n_sides=n_sides))
        pieces.append(lathe(_STAND_M, n_sides=2 * n_sides, at_m=(x, -0.15, 0.0)))
    pieces.append(rounded_box((-0.22, -0.6, 0.0), (0.22, -0.45, 0.014), 0.012, n_corner=2, n_edge=1))
    column, row = np.meshgrid(np.arange(18), np.arange(6))
    keys = np.stack([-0.207 + 0.0235 * column, -0.59 + 0.022 * row, np.full(column.shape, 0.0145)], axis=-1)
    cap = skin(_square_rings(((0.0, 0.018), (0.002, 0.016)), 0.006), ((0.009, 0.009, 0.0), (0.009, 0.009, 0.006)))
    pieces.append(copies(cap, keys.reshape(-1, 3)))
    pieces.append(ellipsoid((0.31, -0.53, 0.017), (0.03, 0.055, 0.016), n_sides=n_sides, n_rings=n_sides // 2))
    return join(pieces)


def _square_rings(spans_m: tuple[tuple[float, float], ...], height_m: float) -> FloatArray:
    z = np.linspace(0.0, height_m, len(spans_m))
    return np.array([[(a, a, h), (b, a, h), (b, b, h), (a, b, h)] for (a, b), h in zip(spans_m, z, strict=True)])


def desk_lamp(*, n_sides: int = 16) -> Solid:
    """A weighted foot, a jointed arm, a bell-shaped shade."""
    arm = bent([(0.0, -0.1, 0.02), (0.0, -0.05, 0.28), (0.0, -0.28, 0.44), (0.0, -0.34, 0.4)], 0.03, n_bend=3)
    shade = [
        (0.0, 0.06),
        (0.03, 0.06),
        (0.045, 0.02),
        (0.075, -0.05),
        (0.07, -0.05),
        (0.04, 0.01),
        (0.02, 0.05),
        (0.0, 0.05),
    ]
    return join(
        [
            lathe(_LAMP_FOOT_M, n_sides=2 * n_sides, at_m=(0.0, -0.1, 0.0)),
            pipe(arm, 0.008, n_sides=max(6, n_sides // 2)),
            lathe(shade[::-1], n_sides=2 * n_sides, at_m=(0.0, -0.36, 0.36)),
        ]
    )  # fmt: skip


def mug(*, n_sides: int = 20) -> Solid:
    """A mug with a handle."""
    wall = [(0.0, 0.0), (0.035, 0.0), (0.04, 0.005), (0.04, 0.095), (0.036, 0.095), (0.035, 0.008), (0.0, 0.008)]
    ear = bent([(0.039, 0.0, 0.08), (0.07, 0.0, 0.075), (0.07, 0.0, 0.03), (0.039, 0.0, 0.02)], 0.012, n_bend=3)
    return join([lathe(wall, n_sides=n_sides), pipe(ear, 0.005, n_sides=6)])


def waste_bin(*, n_sides: int = 20) -> Solid:
    """A tapered bin, open on top."""
    wall = [(0.0, 0.0), (0.11, 0.0), (0.14, 0.33), (0.145, 0.34), (0.135, 0.34), (0.105, 0.01), (0.0, 0.01)]
    return lathe(wall, n_sides=n_sides, at_m=(0.0, -0.15, 0.0))


def book_rows(
    width_m: float,
    depth_m: float,
    levels_m: FloatArray,
    space_m: float,
    rng: np.random.Generator,
    *,
    thick_m: tuple[float, float] = (0.025, 0.055),
    n_spine: int = 2,
) -> Solid:
    """Books with round spines on boards at `levels_m`, `space_m` between boards; a tenth of the places is empty.

    n_spine : chords a corner of the books' outline; with 0 they are boxes.
    """
    outline = rounded_rectangle(1.0, 1.0, 0.25, n_corner=n_spine) if n_spine else rectangle(1.0, 1.0)
    flat = outline + np.array([0.5, -0.5])
    ring = np.column_stack([flat, np.zeros(len(flat))])
    book = skin(np.stack([ring, ring + np.array([0.0, 0.0, 1.0])]), ((0.5, -0.5, 0.0), (0.5, -0.5, 1.0)))
    at, size = [], []
    for level in levels_m:
        thick = rng.uniform(*thick_m, size=int(width_m / thick_m[0]) + 1)
        start = np.concatenate([[0.0], np.cumsum(thick + 0.002)[:-1]])
        kept = (start + thick < width_m - 0.01) & (rng.random(thick.size) > 0.1)
        thick, start = thick[kept], start[kept]
        height = rng.uniform(0.62, 0.92, size=thick.size) * space_m
        deep = rng.uniform(0.65, 0.85, size=thick.size) * depth_m
        front = -depth_m + 0.02 + deep  # spines stand in line, two centimetres behind the edge of the board
        at.append(np.column_stack([start - width_m / 2 + 0.005, front, np.full(thick.size, level + 0.0005)]))
        size.append(np.column_stack([thick, deep, height]))
    return copies(book, np.concatenate(at), np.concatenate(size))


def bookshelf(
    width_m: float,
    depth_m: float,
    height_m: float,
    rng: np.random.Generator,
    *,
    n_boards: int,
    thick_m: tuple[float, float] = (0.025, 0.055),
    n_spine: int = 2,
) -> Solid:
    """A case with boards, filled with books, or with binders where `thick_m` is that of binders."""
    board = 0.03
    step = (height_m - board) / (n_boards + 1)
    levels = np.arange(n_boards + 1, dtype=np.float64) * step + board
    case = furniture.shelf(width_m, depth_m, height_m, n_boards=n_boards)
    rows = book_rows(width_m - 0.07, depth_m - 0.03, levels, step - board, rng, thick_m=thick_m, n_spine=n_spine)
    return join([case, rows])


def cabinet(width_m: float, depth_m: float, height_m: float, *, n_doors: int = 2, n_sides: int = 8) -> Solid:
    """A body on a plinth with door leaves and bow handles."""
    half = width_m / 2
    pieces = [furniture.cupboard(width_m, depth_m - 0.03, height_m)]
    edges = np.linspace(-half, half, n_doors + 1)
    for i, (low, high) in enumerate(itertools.pairwise(edges)):
        leaf = ((low + 0.003, -depth_m + 0.006, 0.09), (high - 0.003, -depth_m + 0.0295, height_m - 0.01))
        pieces.append(rounded_box(*leaf, 0.01, n_corner=2, n_edge=1))
        x = high - 0.05 if i % 2 == 0 else low + 0.05
        z, y = height_m / 2, -depth_m
        bow = [(x, y + 0.02, z - 0.08), (x, y - 0.025, z - 0.08), (x, y - 0.025, z + 0.08), (x, y + 0.02, z + 0.08)]
        pieces.append(pipe(bent(bow, 0.015, n_bend=2), 0.006, n_sides=n_sides))
    return join(pieces)


def round_table(radius_m: float, *, n_sides: int = 32) -> Solid:
    """A round top on a turned column with a broad foot; centred, so its back is at y = radius."""
    profile = [
        (0.0, 0.0), (0.6 * radius_m, 0.0), (0.58 * radius_m, 0.02), (0.06, 0.05), (0.045, 0.3), (0.05, 0.65),
        (0.12, 0.7), (radius_m - 0.01, 0.71), (radius_m, 0.725), (radius_m - 0.01, 0.74), (0.0, 0.74),
    ]  # fmt: skip
    return lathe(profile, n_sides=n_sides)


def plant(height_m: float, rng: np.random.Generator, *, n_leaves: int = 90, n_sides: int = 6) -> Solid:
    """A pot with soil, a stem, and leaves all round it; centred on its stem."""
    pot = [(0.0, 0.0), (0.13, 0.0), (0.18, 0.3), (0.19, 0.34), (0.165, 0.34), (0.16, 0.29), (0.0, 0.29)]
    stem = pipe([(0.0, 0.0, 0.28), (0.01, 0.02, 0.5 * height_m), (0.0, 0.0, 0.95 * height_m)], 0.015, n_sides=n_sides)
    leaf = ellipsoid((0.1, 0.0, 0.0), (0.1, 0.035, 0.004), n_sides=n_sides, n_rings=3)
    turn = rng.uniform(0.0, 2 * np.pi, n_leaves)
    droop = rng.uniform(-0.9, 0.5, n_leaves)
    size = rng.uniform(0.7, 1.5, n_leaves)
    c, s, cd, sd = np.cos(turn), np.sin(turn), np.cos(droop), np.sin(droop)
    rows = np.array([[c * cd, -s, c * sd], [s * cd, c, s * sd], [-sd, np.zeros(n_leaves), cd]])
    leaves = np.einsum("ijk,vj->kvi", rows, leaf.vertices_m) * size[:, None, None]
    radius = rng.uniform(0.02, 0.12, n_leaves)
    at = np.column_stack([c * radius, s * radius, rng.uniform(0.45, 0.95, n_leaves) * height_m])
    starts = np.arange(n_leaves)[:, None, None] * len(leaf.vertices_m)
    crown = Solid(
        np.round((leaves + at[:, None, :]).reshape(-1, 3), 6) + 0.0,
        (leaf.triangles + starts).reshape(-1, 3).astype(np.int32),
    )
    return join([lathe(pot, n_sides=4 * n_sides), stem, crown])


def board(width_m: float, height_m: float = 1.2, *, foot_m: float = 0.9) -> Solid:
    """A writing board in a frame, with a ledge for chalk."""
    half = width_m / 2
    return join(
        [
            furniture.block(width_m, 0.03, height_m, foot_m=foot_m),
            rounded_box((-half, -0.1, foot_m - 0.04), (half, -0.001, foot_m - 0.01), 0.012, n_corner=2, n_edge=1),
        ]
    )

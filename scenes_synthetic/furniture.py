"""Furniture and fittings: closed solids in their own frame, standing on z = 0, back at y = 0, front towards -y.

Each function returns a `Solid` centred on x = 0. The pieces of one item do not share an edge: a leg stands in from the
rim of what it carries, so that the item stays a closed 2-manifold.
"""

from __future__ import annotations

import numpy as np

from scenes_synthetic.solids import Solid, box, join, pierced_box, rectilinear


def _block(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Solid:
    return box((x[0], y[0], z[0]), (x[1], y[1], z[1]))


def table(width_m: float, depth_m: float, height_m: float = 0.74, *, top_m: float = 0.04) -> Solid:
    """A plate on four legs."""
    leg, inset = 0.06, 0.04
    half = width_m / 2
    parts = [_block((-half, half), (-depth_m, 0), (height_m - top_m, height_m))]
    for x in (-half + inset, half - inset - leg):
        for y in (-depth_m + inset, -inset - leg):
            parts.append(_block((x, x + leg), (y, y + leg), (0, height_m - top_m)))
    return join(parts)


def chair() -> Solid:
    """A seat of 0.45 m with a back, on four legs."""
    back = _block((-0.2, 0.2), (-0.04, -0.01), (0.46, 0.88))
    return join([table(0.44, 0.45, 0.46, top_m=0.05), back])


def shelf(width_m: float, depth_m: float, height_m: float, *, n_boards: int) -> Solid:
    """A case open to the front, with `n_boards` levels between bottom and top."""
    board = 0.03
    level = np.linspace(0.0, height_m - board, n_boards + 2)
    z = np.sort(np.concatenate([level, level + board]))
    x = [-width_m / 2, -width_m / 2 + board, width_m / 2 - board, width_m / 2]
    filled = np.ones((3, 2, z.size - 1), dtype=bool)
    filled[1, 0, 1::2] = False
    return rectilinear(x, [-depth_m, -0.02, 0.0], z, filled=filled)


def cupboard(width_m: float, depth_m: float, height_m: float) -> Solid:
    """A closed body on a plinth that stands back."""
    half = width_m / 2
    plinth = _block((-half + 0.02, half - 0.02), (-depth_m + 0.06, -0.02), (0, 0.08))
    return join([_block((-half, half), (-depth_m, 0), (0.08, height_m)), plinth])


def bed(width_m: float, length_m: float = 2.0) -> Solid:
    """A frame with a mattress, a headboard at the back and a pillow (two on a wide bed)."""
    half = width_m / 2
    parts = [
        _block((-half, half), (-length_m - 0.06, -0.06), (0.1, 0.3)),
        _block((-half + 0.05, half - 0.05), (-length_m, -0.12), (0.3, 0.5)),
        _block((-half - 0.03, half + 0.03), (-0.05, 0), (0, 0.95)),
    ]
    for x in (-half + 0.08, half - 0.16):
        for y in (-length_m - 0.02, -0.2):
            parts.append(_block((x, x + 0.08), (y, y + 0.08), (0, 0.1)))
    n_pillows = 2 if width_m > 1.2 else 1
    for i in range(n_pillows):
        middle = (i + 0.5) * width_m / n_pillows - half
        parts.append(_block((middle - 0.3, middle + 0.3), (-0.6, -0.18), (0.5, 0.6)))
    return join(parts)


def sofa(width_m: float, depth_m: float = 0.9) -> Solid:
    """Arms and back round a seat: one solid, open to the front, on four feet."""
    half = width_m / 2
    x = [-half, -half + 0.18, half - 0.18, half]
    filled = np.ones((3, 2, 3), dtype=bool)
    filled[1, 0, 1:] = False
    filled[:, 0, 2] = False
    body = rectilinear(x, [-depth_m, -0.22, 0.0], [0.1, 0.42, 0.6, 0.8], filled=filled)
    feet = [
        _block((fx, fx + 0.06), (fy, fy + 0.06), (0, 0.1))
        for fx in (-half + 0.05, half - 0.11)
        for fy in (-depth_m + 0.05, -0.11)
    ]
    return join([body, *feet])


def kitchen_counter(width_m: float) -> Solid:
    """Base units on a plinth under a worktop that stands proud, with a sink let into it."""
    half = width_m / 2
    sink = ((-half + 0.5, -0.5, 0.86), (-half + 1.0, -0.12, 0.91))
    worktop = pierced_box((-half, -0.62, 0.86), (half, 0, 0.91), [sink])
    body = _block((-half + 0.01, half - 0.01), (-0.58, -0.01), (0.1, 0.86))
    plinth = _block((-half + 0.03, half - 0.03), (-0.52, -0.03), (0, 0.1))
    return join([worktop, body, plinth])


def wall_cupboard(width_m: float, foot_m: float = 1.45, height_m: float = 0.7) -> Solid:
    """A closed body that hangs on the wall."""
    return _block((-width_m / 2, width_m / 2), (-0.35, 0), (foot_m, foot_m + height_m))


def block(width_m: float, depth_m: float, height_m: float, *, foot_m: float = 0.0) -> Solid:
    """A plain box: a refrigerator, a washing machine, a screen on a wall."""
    return _block((-width_m / 2, width_m / 2), (-depth_m, 0), (foot_m, foot_m + height_m))


def toilet() -> Solid:
    """A bowl before a cistern."""
    return join(
        [
            _block((-0.19, 0.19), (-0.16, 0), (0.41, 0.8)),
            _block((-0.13, 0.13), (-0.5, -0.02), (0, 0.3)),
            _block((-0.18, 0.18), (-0.62, -0.01), (0.3, 0.41)),
        ]
    )


def washbasin(width_m: float = 0.5) -> Solid:
    """A basin, hollow on top, that hangs on the wall."""
    half = width_m / 2
    x = [-half, -half + 0.05, half - 0.05, half]
    filled = np.ones((3, 3, 2), dtype=bool)
    filled[1, 1, 1] = False
    return rectilinear(x, [-0.42, -0.37, -0.1, 0.0], [0.7, 0.75, 0.85], filled=filled)


def bathtub(length_m: float = 1.7, width_m: float = 0.75) -> Solid:
    """A tub, hollow on top, its long side at the back."""
    half = length_m / 2
    x = [-half, -half + 0.07, half - 0.07, half]
    filled = np.ones((3, 3, 2), dtype=bool)
    filled[1, 1, 1] = False
    return rectilinear(x, [-width_m, -width_m + 0.07, -0.07, 0.0], [0.0, 0.15, 0.56], filled=filled)


def desk(width_m: float, depth_m: float = 0.65) -> Solid:
    """A table with a drawer unit under its right end."""
    half = width_m / 2
    drawers = _block((half - 0.44, half - 0.12), (-depth_m + 0.08, -0.05), (0.02, 0.6))
    return join([table(width_m, depth_m), drawers])

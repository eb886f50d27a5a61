"""A house of boxes: two rooms below, joined by a gap, one above, up a flight of stairs.

y 5 +------------+----------+-------------+
    |            |          | flight <-up |    The flight climbs from x 8.2 to x 5.5, y 4 to 5; the well above it is
  4 |            |          +----well-----+    as large. Walls are 0.2 m thick and lie outside of these lines, the one
  3 |   Küche    |                        |    between the rooms from x 4.0 to 4.2.
    |            ' gap, y 2 to 3          |
  2 | table      '                        |
  1 | (1,1)-(2,2)|                        |
    +------------+------------------------+
    0            4                       10  x
"""

from __future__ import annotations

from pathlib import Path

Point = tuple[float, float, float]
Box = tuple[Point, Point]
N_STEPS, STEP_M, TREAD_M, FOOT_X_M = 14, 0.2, 2.7 / 14, 8.2
#: The name of an element that tries to be markup.
EVIL = "wall <b>&amp; Küche Ψ"
PARTS: dict[str, list[Box]] = {
    "slab ground": [((-0.2, -0.2, -0.2), (10.2, 5.2, 0.0))],
    "wall west": [((-0.2, -0.2, 0.0), (0.0, 5.2, 5.6))],
    "wall east": [((10.0, -0.2, 0.0), (10.2, 5.2, 5.6))],
    "wall south": [((0.0, -0.2, 0.0), (10.0, 0.0, 5.6))],
    EVIL: [((0.0, 5.0, 0.0), (10.0, 5.2, 5.6))],
    "wall between south": [((4.0, 0.0, 0.0), (4.2, 2.0, 2.6))],
    "wall between north": [((4.0, 3.0, 0.0), (4.2, 5.0, 2.6))],
    "wall lintel": [((4.0, 2.0, 2.1), (4.2, 3.0, 2.6))],
    "slab upper south": [((0.0, 0.0, 2.6), (10.0, 4.0, 2.8))],
    "slab upper west": [((0.0, 4.0, 2.6), (5.5, 5.0, 2.8))],
    "slab upper east": [((8.2, 4.0, 2.6), (10.0, 5.0, 2.8))],
    "slab roof": [((-0.2, -0.2, 5.6), (10.2, 5.2, 5.8))],
    "table": [((1.0, 1.0, 0.0), (2.0, 2.0, 0.75))],
    "stair": [
        ((FOOT_X_M - (k + 1) * TREAD_M, 4.0, 0.0), (FOOT_X_M - k * TREAD_M, 5.0, (k + 1) * STEP_M))
        for k in range(N_STEPS)
    ],
}


def write_obj(path: Path, parts: dict[str, list[Box]], at_m: Point) -> Path:
    """Write boxes as triangles, one group per part; at_m : where the origin of the lines above lies."""
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    lines, n = [], 0
    for name, boxes in parts.items():
        lines.append(f"o {name}")
        for ends in boxes:
            for k in range(8):
                corner = [ends[k >> axis & 1][axis] + at_m[axis] for axis in range(3)]
                lines.append(f"v {' '.join(f'{value:.6f}' for value in corner)}")
            lines += [
                f"f {a + n + 1} {b + n + 1} {c + n + 1}\nf {a + n + 1} {c + n + 1} {d + n + 1}" for a, b, c, d in faces
            ]
            n += 8
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path

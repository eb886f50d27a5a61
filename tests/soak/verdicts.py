"""What a beam should have met, in float64: leaks, and why two engines name different triangles.

Beams are float32 origins and directions, vertices float32, as both engines have them; all of it is exact in float64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Rounding of an edge function in float32, a share of (reach * edge); reach: a vertex's distance + the longest edge.
#: block.h counts 1.25e-6 and takes lengths up to 1.23 times too long, each.
MARGIN = 2.1e-6
#: A hit in the margin counts as farther by 1e-5 (block.h, BESIDE), and float32 does the rest.
RANGE_SHARE = 2e-5
#: Rounding of a float32 range, a share of it that grows with 1 / cosine.
RANGE_ULPS = 16 * 2.0**-24
#: cos(incidence) below which the range along a triangle is not worth comparing: the beam runs in its plane.
EDGE_ON = 1e-5
#: A triangle whose volume with the origin is less than this share of (reach squared * sum of edges) is a line
#: to float32, be it a needle or seen edge-on: block.h takes its range from its vertices and its bounding box.
LINE = 1.25e-6 * 1.23**3

#: Why two engines may name different triangles for a beam, in the order of being asked; the last must stay empty.
REASONS = (
    "both along a shared edge or vertex",
    "two surfaces in one place",
    "in our margin",
    "in Open3D's rounding",
    "beside a line",
    "let through by Open3D",
    "unexplained",
)


@dataclass(frozen=True)
class Crossing:
    """Beams against one triangle each, float64.

    outside : how far outside, as a share of (reach * edge), see MARGIN; 0 or less inside. range : along the beam, NaN
    where it runs in the plane. cosine : |normal . beam|. is_line : whether the triangle is a line to float32, see LINE.
    """

    outside: Floats
    range: Floats
    cosine: Floats
    is_line: NDArray[np.bool_]


def cross(origins: Floats, beams: Floats, corners: Floats) -> Crossing:
    """Beams (N, 3), unit but for rounding, against triangles (N, 3, 3)."""
    a, b, c = (corners[:, k] - origins for k in range(3))
    sides = [(b, c), (c, a), (a, b)]
    normals = [np.cross(p, q) for p, q in sides]
    values = np.stack([np.einsum("ij,ij->i", beams, n) for n in normals], axis=1)
    edges = np.stack([np.linalg.norm(q - p, axis=1) for p, q in sides], axis=1)
    reach = np.linalg.norm(a, axis=1) + edges.max(axis=1)
    total = values.sum(axis=1)  # beam . (B - A) x (C - A): its sign is the side from which the triangle is seen
    side = np.where(total < 0, -1.0, 1.0)[:, None]
    unit = np.maximum(reach[:, None] * edges, 1e-300)
    outside = (-side * values / unit).max(axis=1)
    full = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(full, axis=1)
    volume = np.einsum("ij,ij->i", full, a)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = volume / total
        cosine = np.abs(total) / length
    # A triangle that rounding has left without area has no plane: whatever is said of it is edge-on.
    is_line = 2 * np.abs(volume) <= LINE * edges.sum(axis=1) * reach**2
    return Crossing(outside, along, np.where(length > 0, cosine, 0.0), is_line)


def tolerance(range_m: Floats, cosine: Floats) -> Floats:
    """How far two right ranges may be apart."""
    return range_m * (RANGE_SHARE + RANGE_ULPS / np.maximum(cosine, EDGE_ON))


def leaks(
    origins: Floats,
    beams: Floats,
    corners: Floats,
    triangle: Ints,
    range_m: Floats,
    must_end: bool,
    others: Ints,
) -> NDArray[np.bool_]:
    """Which of N beams were let through.

    A beam leaks where it misses although it must end, and where it goes on behind a triangle that it meets in float64:
    of those in `others` (N, K), -1 where there is none. corners (T, 3, 3) of the whole mesh.
    """
    missed = triangle < 0
    let_through = missed & must_end
    # Where OUR triangle is, whatever range was reported: that is another question, see `wrong_ranges`.
    own = cross(origins, beams, corners[np.maximum(triangle, 0)])
    in_it = ~missed & (own.outside <= MARGIN) & (own.cosine > EDGE_ON)
    reached = np.where(missed, np.inf, np.where(in_it, np.minimum(own.range, range_m), range_m))
    for k in range(others.shape[1]):
        asked = np.flatnonzero((others[:, k] >= 0) & ~let_through)
        met = cross(origins[asked], beams[asked], corners[others[asked, k]])
        # Rounding of float64 itself is some 1e-15: what lies that near an edge is left to its neighbour.
        inside = (met.outside < -1e-14) & (met.range > 0) & (met.cosine > EDGE_ON)
        far = reached[asked] > met.range + tolerance(met.range, met.cosine)
        let_through[asked[inside & far]] = True
    return let_through


def wrong_ranges(origins: Floats, beams: Floats, corners: Floats, range_m: Floats) -> NDArray[np.bool_]:
    """Which of N hits, each with the triangle (N, 3, 3) it names, have another range than the triangle's plane.

    Not asked of lines, whose planes say nothing: their ranges are kept inside a padded box, see block.h.
    """
    met = cross(origins, beams, corners)
    with np.errstate(invalid="ignore"):
        off = np.abs(range_m - met.range) > tolerance(met.range, met.cosine)
    return off & ~met.is_line & (met.cosine > EDGE_ON)


def explain(
    origins: Floats,
    beams: Floats,
    corners: Floats,
    cells: Ints,
    ours: tuple[Ints, Floats],
    theirs: tuple[Ints, Floats],
) -> Ints:
    """Index into REASONS for N beams for which the engines' (triangle, range) name different triangles.

    corners (T, 3, 3), cells (T, 3) vertex numbers. A miss is triangle -1, whatever its range.
    """
    hits = []
    for triangle, range_m in (ours, theirs):
        met = cross(origins, beams, corners[np.maximum(triangle, 0)])
        hits.append((triangle >= 0, np.where(triangle >= 0, range_m, np.inf), met))
    (hit_a, range_a, met_a), (hit_b, range_b, met_b) = hits
    both = hit_a & hit_b
    nearer = np.minimum(range_a, range_b)
    with np.errstate(invalid="ignore"):
        worst = np.minimum(np.where(hit_a, met_a.cosine, 1.0), np.where(hit_b, met_b.cosine, 1.0))
        same_place = both & (np.abs(range_a - range_b) <= tolerance(nearer, worst))
    cells_a, cells_b = cells[np.maximum(ours[0], 0)], cells[np.maximum(theirs[0], 0)]
    neighbours = (cells_a[:, :, None] == cells_b[:, None, :]).any(axis=(1, 2))
    we_first = range_a < range_b
    checks = (
        same_place & neighbours,
        same_place,
        we_first & (met_a.outside > 0) & (met_a.outside <= MARGIN),
        (we_first & (np.abs(met_a.outside) <= MARGIN)) | (~we_first & (np.abs(met_b.outside) <= MARGIN)),
        (hit_a & met_a.is_line) | (hit_b & met_b.is_line),
        we_first & (met_a.outside <= 0),
    )
    reason = np.full(len(origins), len(checks))
    for index in range(len(checks) - 1, -1, -1):
        reason[checks[index]] = index
    return reason

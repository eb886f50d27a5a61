"""Overlap of stations on real surfaces, the strength of each link, and whether the links join all stations.

Input the stations' `Visibility`, patch areas (m^2), centroids and normals (local frame); output `Link`s.

Overlap of i and j: area that both see / area that i sees, the smaller of both directions; or / area that either sees
(`OverlapMeasure`). The caller chooses which surface counts as seen (`OverlapOf`).

Strength: registration minimises distances from points p to planes with normal n. With c the area-weighted centroid of
the shared surface and L the root mean square distance of its patches from c, a small motion moves a patch along its
normal by J.m, J = (n, (p - c) x n / L). The smallest eigenvalue of sum a J J' / sum a is how well the worst determined
motion is held; it is at most 1/3 (three translations share the trace 1), so 3 times it is the strength. 0: some motion
is free, as along a straight corridor; 1: all are held alike. L makes it a figure of shape, not of size. Its eigenvector
is the weak motion.

What it means for errors, and which strength is enough: docs/method/registration.md.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from planner_core.model import (
    BoolArray,
    FloatArray,
    Link,
    LinkLimits,
    OverlapMeasure,
    Patches,
    PreAlignment,
    Scene,
    Visibility,
    WeakMotion,
)
from planner_core.model.arrays import area_normals
from planner_core.model.registration import SET_UP_SHARE
from planner_core.network.pair_overlap import (
    HeldPairs,
    PairSums,
    SharedSurface,
    held_by,
    matrices_of,
    overlapping_pairs,
)
from planner_core.network.weak_motion import weak_motion
from planner_core.scene.patches import patch_triangles

# --------------------------------------------------------------------------------------------------------- probability
# Probability that two scans register, of what is known before anybody scans.
# Input pairs' overlap, what their common surface holds and where registration starts; output probabilities in [0, 1].
# A logistic rule, made of the campaign of docs/benchmarks/registration.md, which has its derivation and how well it
# does on scenes that it has not seen; a test makes it anew from the campaign's rows. Registered: by point-to-plane ICP
# with normals compared, within 10 mm and 0.1 degrees.

#: Of a constant and the figures of `link_figures`, by where registration starts.
WEIGHTS: Final = MappingProxyType(
    {
        PreAlignment.TRACKED: (0.92, 2.98, 4.57),
        PreAlignment.MANUAL: (0.16, 3.13, 4.23),
        PreAlignment.LEVEL: (-4.44, 1.34, 0.71),
        PreAlignment.NONE: (-4.54, 1.32, 0.65),
    }
)
LEAST_HOLD_M2: Final = 1.3
"""The rule is made of pairs that hold as much. Others may slide however much of them overlaps, as in a tunnel."""
_LEAST_SHARE, _NOTHING_M2 = 1e-3, 0.01


def link_figures(share: FloatArray, held: HeldPairs) -> FloatArray:
    """(K, 2) what the rule takes of pairs. share : (K,) overlap, the smaller of both shares."""
    share = np.clip(share, 0.5, 1.0 - _LEAST_SHARE)
    overlap = np.where(held.hold_m2 >= LEAST_HOLD_M2, np.log(share / (1.0 - share)), 0.0)
    return np.column_stack([np.log(np.maximum(held.hold_m2, _NOTHING_M2)), overlap])


def probabilities(share: FloatArray, held: HeldPairs, start: PreAlignment) -> FloatArray:
    """(K,) probability that each pair registers from `start`; share as in `link_figures`."""
    odds, *weights = WEIGHTS[start]
    # Summed one by one: a matrix product's order of sums may depend on the number of pairs.
    sums = np.full(share.shape, odds)
    for weight, figure in zip(weights, link_figures(share, held).T, strict=True):
        sums += weight * figure
    return np.asarray(1.0 / (1.0 + np.exp(-sums)))


# --------------------------------------------------------------------------------------------------------------- links
#: Overlaps below this are not listed: nobody registers on a twentieth of a scan.
MIN_LISTED_OVERLAP = 0.05


def overlap_links(
    visibility: Visibility,
    patch_area_m2: FloatArray,
    station_ids: tuple[str, ...],
    surface: SharedSurface | None = None,
    position_m: FloatArray | None = None,
    *,
    min_overlap: float = MIN_LISTED_OVERLAP,
    measure: OverlapMeasure = OverlapMeasure.SMALLER_SHARE,
    pre_alignment: PreAlignment = PreAlignment.MANUAL,
) -> tuple[Link, ...]:
    """List the pairs of stations (rows of `visibility`) whose overlap is at least `min_overlap`, by station number.

    position_m : (S, 3) of the stations, local. Without it and `surface` strengths and probabilities are NaN and weak
    motions None. The figures are those of `candidate_links`, bit by bit.
    """
    of_pairs = None
    if surface is not None and position_m is not None:
        of_pairs = PairSums(visibility, patch_area_m2, surface, position_m)
    links = []
    for pairs in overlapping_pairs(visibility, patch_area_m2, min_overlap=min_overlap, measure=measure):
        strength, probability = np.full((2, pairs.first.size), np.nan)
        motions: list[WeakMotion | None] = [None] * pairs.first.size
        if of_pairs is not None:
            sums = of_pairs.of(pairs.first, pairs.second)
            matrix = matrices_of(sums)
            motions = [weak_motion(one) for one in matrix]
            held = held_by(sums, matrix)
            strength = held.strength
            probability = probabilities(pairs.share, held, pre_alignment)
        links += [
            Link(station_ids[i], station_ids[j], overlap, held, motion, probability=registers)
            for i, j, overlap, held, registers, motion in zip(
                pairs.first,
                pairs.second,
                pairs.overlap.tolist(),
                strength.tolist(),
                probability.tolist(),
                motions,
                strict=True,
            )
        ]
    return tuple(links)


def least_listed_overlap(required: float) -> float:
    """Overlap from which on links are listed: at least all that count, as set up, too."""
    return min(MIN_LISTED_OVERLAP, SET_UP_SHARE * required or MIN_LISTED_OVERLAP)


def with_scanned(links: Iterable[Link], scanned: Collection[str], limits: LinkLimits) -> tuple[Link, ...]:
    """Mark the links between `scanned` stations that count as these are set up, though below the limits."""
    as_set_up = limits.as_set_up()

    def counts(link: Link) -> bool:
        both = link.a in scanned and link.b in scanned
        return both and link.reaches(as_set_up) and not link.reaches(limits)

    return tuple(replace(link, as_set_up=counts(link)) for link in links)


def surface_of_patches(scene: Scene, patches: Patches, seen: BoolArray) -> SharedSurface:
    """Centroids and normals of the patches of all triangles with a patch in `seen`, (P,) bool; the others' are zero."""
    triangle_of_patch = patches.triangle_of_patch
    used = np.zeros(scene.n_triangles, dtype=bool)
    used[triangle_of_patch[seen]] = True
    # Only the triangles in question: all patches of a large scene would take gigabytes.
    part = replace(scene, triangles=scene.triangles[used])
    corners = patch_triangles(part, replace(patches, depth=patches.depth[used]))
    centroid_m = np.zeros((seen.size, 3))
    normal = np.zeros((seen.size, 3))
    at = used[triangle_of_patch]
    centroid_m[at] = corners.mean(axis=1)
    cross = area_normals(corners)
    length = np.sqrt((cross * cross).sum(axis=1, keepdims=True))
    normal[at] = np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)
    return SharedSurface(centroid_m=centroid_m, normal=normal)

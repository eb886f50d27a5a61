"""Positions that see random parts of a real room: overlaps of every size, and surfaces of every shape."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner_core.model import Visibility
from planner_core.network.links import SharedSurface, surface_of_patches
from planner_core.network.pair_overlap import AREA_TICK_M2
from planner_core.scene.patches import make_patches
from scenes_synthetic import rooms


@dataclass(frozen=True)
class View:
    """What positions see, of which surface."""

    visibility: Visibility
    area_m2: np.ndarray
    surface: SharedSurface

    def with_rows(self, rows: list[np.ndarray]) -> "View":
        starts = np.concatenate([[0], np.cumsum([row.size for row in rows])]).astype(np.int64)
        patch = np.concatenate([np.empty(0), *rows]).astype(np.int32)
        return View(Visibility(starts, patch, self.area_m2.size), self.area_m2, self.surface)

    def with_order(self, order: np.ndarray) -> "View":
        return self.with_rows([self.visibility.row(int(i)) for i in order])

    @property
    def position_m(self) -> np.ndarray:
        """(N, 3) where rows look from: amid what they see, whatever their order."""
        rows = (self.visibility.row(i) for i in range(self.visibility.n_positions))
        middle = [self.surface.centroid_m[row].mean(axis=0) if row.size else np.zeros(3) for row in rows]
        return np.array(middle).reshape(-1, 3)

    def common(self, i: int, j: int) -> np.ndarray:
        return np.array(sorted(set(self.visibility.row(i).tolist()) & set(self.visibility.row(j).tolist())), dtype=int)

    def overlaps(self) -> np.ndarray:
        """(N, N), the smaller share of seen area that is common, pair by pair; 0 where a row sees nothing."""
        ticks = np.rint(self.area_m2 / AREA_TICK_M2)  # whole: their sums are exact, in whatever order
        n = self.visibility.n_positions
        whole = [ticks[self.visibility.row(i)].sum() for i in range(n)]
        share = np.zeros((n, n))
        for i in range(n):
            for j in range(n):
                common = ticks[self.common(i, j)].sum()
                share[i, j] = common / max(whole[i], whole[j]) if common else 0.0
        return share

    def strength(self, i: int, j: int) -> float:
        """Of one link, by the formula at the head of `planner_core.network.links`."""
        patch = self.common(i, j)
        if patch.size == 0:
            return 0.0
        weight = (self.area_m2[patch] / self.area_m2[patch].sum())[:, None]
        normal = self.surface.normal[patch]
        arm = self.surface.centroid_m[patch] - (weight * self.surface.centroid_m[patch]).sum(axis=0)
        length_m = np.sqrt((weight * arm * arm).sum())
        if length_m == 0.0:
            return 0.0
        rows = np.concatenate([normal, np.cross(arm, normal) / length_m], axis=1)
        return float(np.clip(3.0 * np.linalg.eigvalsh((weight * rows).T @ rows)[0], 0.0, 1.0))


def _room() -> View:
    scene = rooms.l_room().scene
    patches = make_patches(scene, max_area_m2=0.3)
    everything = np.ones(patches.n_patches, dtype=bool)
    nothing = Visibility(np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.int32), patches.n_patches)
    surface = surface_of_patches(scene, patches, everything)
    # Askew: along the axes half of what a normal matrix is made of would be zero.
    turn = Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_matrix()
    surface = SharedSurface(surface.centroid_m @ turn.T, surface.normal @ turn.T)
    return View(nothing, patches.area_m2, surface)


@pytest.fixture(scope="session")
def make_view():
    """Make a view of `n` positions in an L-shaped room from a seed; two positions see nothing."""
    room = _room()

    def make(seed: int, n: int = 25) -> View:
        rng = np.random.default_rng(seed)
        centre = room.surface.centroid_m
        rows = []
        for _ in range(n):
            # A ball of the room's surface, thinned: neighbours share much, those far apart nothing.
            near = np.linalg.norm(centre - centre[rng.integers(len(centre))], axis=1) < rng.uniform(1.0, 4.0)
            rows.append(np.flatnonzero(near & (rng.random(len(centre)) < 0.8)))
        rows[n // 2] = rows[n - 1] = np.empty(0, dtype=int)
        return room.with_rows(rows)

    return make

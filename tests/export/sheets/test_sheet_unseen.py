"""What of a floor is seen: of surfaces that lie on each other, the topmost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner_core.export.sheets.building import Building
from planner_core.export.sheets.unseen import FloorVisibility, unseen_surface
from planner_core.model import BoolArray, FloatArray
from planner_core.scene.load import load_scene
from planner_core.scene.patches import make_patches, patch_triangles

#: A slab of 4 m x 4 m, and a carpet on the half of it where x < 2 m.
BOXES = {"slab": ((0.0, 0.0, -0.3), (4.0, 4.0, 0.0)), "carpet": ((0.0, 0.0, 0.005), (2.0, 4.0, 0.015))}
FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def write_boxes(path: Path) -> Path:
    lines, first = [], 1
    for name, ends in BOXES.items():
        lines.append(f"o {name}")
        lines += [f"v {ends[i & 1][0]} {ends[i >> 1 & 1][1]} {ends[i >> 2][2]}" for i in range(8)]
        lines += ["f " + " ".join(str(first + corner) for corner in face) for face in FACES]
        first += 8
    path.write_text("\n".join(lines) + "\n")
    return path


class Floor:
    """The two boxes; which of their patches are seen is up to the test."""

    def __init__(self, folder: Path) -> None:
        self.scene = load_scene(write_boxes(folder / "boxes.obj"))
        self.patches = make_patches(self.scene, max_area_m2=0.1)
        self.z_m = np.round(patch_triangles(self.scene, self.patches).mean(axis=1)[:, 2] + self.scene.offset_m[2], 6)
        self.x_m = patch_triangles(self.scene, self.patches).mean(axis=1)[:, 0] + self.scene.offset_m[0]

    def at(self, z_m: float) -> BoolArray:
        return np.asarray(self.z_m == z_m)

    def unseen(
        self, seen: BoolArray, achievable: BoolArray, required: BoolArray | None = None, *, low_m: float = 0.0
    ) -> FloorVisibility:
        scene = self.scene
        top = (np.abs(scene.vertices_m[scene.triangles][:, :, 2] + scene.offset_m[2]) < 1e-6).all(axis=1)
        ground = np.where(top, 0, -1).astype(np.int32)
        required = np.ones_like(seen) if required is None else required
        numbers = np.arange(len(scene.elements), dtype=np.int32)
        building = Building(scene, self.patches, ground, seen.astype(np.int32), achievable, required, numbers)
        window_m = np.array([[-1.0, -1.0], [5.0, 5.0]]) - scene.offset_m[:2]
        height_m = np.array([low_m, 2.5]) - scene.offset_m[2]
        return unseen_surface(building, 0, height_m=height_m, window_m=window_m)


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Floor:
    return Floor(tmp_path_factory.mktemp("boxes"))


def area_m2(triangles: FloatArray) -> float:
    sides = triangles[:, 1:] - triangles[:, :1]
    return float(0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]).sum())


def test_a_ceiling_that_is_seen_from_below_is_not_the_floor_above_it(floor: Floor) -> None:
    underside, slab, carpet = floor.at(-0.3), floor.at(0.0), floor.at(0.015)
    found = floor.unseen(underside, underside | slab | carpet)
    assert area_m2(found.seen) == 0.0
    # The carpet, and all of the slab, which is ground.
    assert area_m2(found.missed) == pytest.approx(8.0 + 16.0, rel=1e-4)


def test_a_ceiling_that_is_missed_from_below_marks_nothing_on_the_floor_above_it(floor: Floor) -> None:
    underside, slab, carpet = floor.at(-0.3), floor.at(0.0), floor.at(0.015)
    found = floor.unseen(slab | carpet, underside | slab | carpet)
    assert area_m2(found.missed) == 0.0
    assert area_m2(found.seen) == pytest.approx(8.0 + 16.0, rel=1e-4)


def test_a_covering_that_is_seen_hides_the_slab_below_it(floor: Floor) -> None:
    slab, carpet = floor.at(0.0), floor.at(0.015)
    open_slab = slab & (floor.x_m > 2.0)
    found = floor.unseen(carpet, carpet | open_slab)
    assert area_m2(found.seen) == pytest.approx(8.0, rel=1e-4)
    assert area_m2(found.missed) == pytest.approx(8.0, rel=0.1)  # patches lie across the carpet's edge
    assert found.missed[:, :, 0].mean(axis=1).min() + floor.scene.offset_m[0] > 2.0


def test_what_need_not_be_covered_is_neither_missed_nor_out_of_reach(floor: Floor) -> None:
    slab, carpet = floor.at(0.0), floor.at(0.015)
    west = floor.x_m < 2.0
    nothing = np.zeros_like(slab)
    # In the east the slab can't be seen; of the west only the slab below the carpet need be covered.
    found = floor.unseen(nothing, carpet | (slab & west), ~carpet)
    assert area_m2(found.missed) == pytest.approx(8.0, rel=0.1)
    assert area_m2(found.out_of_reach) == pytest.approx(8.0, rel=0.1)
    found = floor.unseen(nothing, carpet | (slab & west), carpet)
    assert area_m2(found.missed) == pytest.approx(8.0, rel=1e-4)
    assert area_m2(found.out_of_reach) == 0.0


def test_upright_surface_that_need_not_be_covered_marks_no_wall(floor: Floor) -> None:
    everything = np.ones_like(floor.at(0.0))

    def walls_m(required: BoolArray) -> FloatArray:
        return floor.unseen(~everything, everything, required, low_m=-0.3).walls + floor.scene.offset_m[:2]

    # The slab's sides stand for walls.
    walls = walls_m(everything)
    west = (np.abs(walls[:, :, 0]) < 0.05).all(axis=1)
    assert 0 < west.sum() < len(walls)
    np.testing.assert_array_equal(walls_m(floor.x_m > 1e-3), walls[~west])

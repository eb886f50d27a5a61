"""Occupancy grids, read with Pillow and PyYAML as map_server reads them: the house on paper, and Open3D's rays."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import open3d as o3d
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from PIL import Image
from robot_house import ROOMS, STAIRS, TABLE
from scipy import ndimage
from two_rooms import FOOT_X_M, N_STEPS, TREAD_M

from planner_core.export.occupancy import grey_png
from planner_core.export.options import Options
from planner_core.export.robot import write_robot
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.progress import silent

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
STEP, HEAD = 0.25, 1.7


class Served:
    """A map as map_server serves it: row 0 the lowest y, 0 free, 100 occupied, -1 unknown."""

    def __init__(self, path: Path) -> None:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert told["negate"] == 0
        assert told["mode"] == "trinary"
        pixels = np.asarray(Image.open(path.parent / told["image"]))
        assert pixels.dtype == np.uint8
        occupancy = (255.0 - pixels[::-1]) / 255.0
        self.cells = np.where(
            occupancy > told["occupied_thresh"], OCCUPIED, np.where(occupancy < told["free_thresh"], FREE, UNKNOWN)
        )
        self.resolution, (self.x, self.y, yaw) = told["resolution"], told["origin"]
        assert yaw == 0.0

    def at(self, x: Any, y: Any) -> NDArray[np.int64]:
        column = np.floor((np.asarray(x) - self.x) / self.resolution).astype(int)
        row = np.floor((np.asarray(y) - self.y) / self.resolution).astype(int)
        return np.asarray(self.cells[row, column])

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows, columns = np.indices(self.cells.shape)
        return self.x + (columns + 0.5) * self.resolution, self.y + (rows + 0.5) * self.resolution


@pytest.fixture(scope="module")
def maps(house_plan: PlanSource, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Served]:
    folder = tmp_path_factory.mktemp("maps")
    write_robot(house_plan, folder, Options(), silent)
    return {floor: Served(folder / "maps" / f"{floor}.yaml") for floor in ("F0", "F1")}


def test_the_ground_floor_is_as_drawn(maps: dict[str, Served]) -> None:
    served = maps["F0"]
    free = [(0.5, 0.5), (0.5, 4.5), (4.1, 2.5), (7.0, 1.0), (9.5, 4.5), (0.05, 0.06), (8.7, 0.7), (7.8, 4.5)]
    occupied = [(1.5, 1.5), (3.2, 4.3), (-0.1, 2.0), (4.1, 1.0), (4.1, 4.0), (5.0, 5.1), (10.1, 2.0)]
    unknown = [(-0.8, -0.8), (10.8, 5.5)]
    assert [served.at(*place) for place in free] == [FREE] * len(free)
    assert [served.at(*place) for place in occupied] == [OCCUPIED] * len(occupied)
    assert [served.at(*place) for place in unknown] == [UNKNOWN] * len(unknown)


def test_the_upper_floor_ends_at_the_well_and_not_at_the_top_of_the_flight(maps: dict[str, Served]) -> None:
    served = maps["F1"]
    assert served.at(2.0, 2.0) == FREE
    assert served.at(4.1, 1.0) == FREE  # the wall below stops at the ceiling
    for x in np.arange(6.1, 8.1, 0.1):
        across = [int(served.at(x, y)) for y in np.arange(3.9, 4.2, 0.01)]
        assert across[0] == FREE
        assert OCCUPIED in across, "the drop into the well"
    down = [int(served.at(x, 4.5)) for x in np.arange(5.0, 6.5, 0.01)]
    assert OCCUPIED not in down, "the way down the flight"
    assert set(down) == {FREE, UNKNOWN}


def test_the_floor_beside_the_flight_is_walled_off(maps: dict[str, Served]) -> None:
    served = maps["F0"]
    for x in np.arange(FOOT_X_M - (N_STEPS - 3) * TREAD_M, FOOT_X_M - 1.2 * TREAD_M, 0.01):
        across = [int(served.at(x, y)) for y in np.arange(3.5, 4.5, 0.01)]
        assert OCCUPIED in across, f"nothing between floor and flight at x = {x:.2f}"
        assert across[0] == across[-1] == FREE
    assert OCCUPIED not in {int(served.at(FOOT_X_M - 0.5 * TREAD_M, y)) for y in np.arange(3.5, 4.5, 0.01)}
    up = {int(served.at(x, 4.5)) for x in np.arange(FOOT_X_M - (N_STEPS - 3) * TREAD_M, 9.0, 0.01)}
    assert up == {FREE}


def test_the_picture_has_north_on_top(maps: dict[str, Served]) -> None:
    pixels = np.where(maps["F0"].cells[::-1] == OCCUPIED, 1, 0)
    half = pixels.shape[0] // 2
    table = slice(int((1.2 - maps["F0"].x) / 0.05), int((1.8 - maps["F0"].x) / 0.05))
    assert pixels[half:, table].sum() > pixels[:half, table].sum()  # the table stands at low y


def test_every_cell_of_rooms_is_free_where_boxes_leave_room(maps: dict[str, Served]) -> None:
    x, y = maps["F0"].centres()
    body = [box for box in [*ROOMS, TABLE, *STAIRS] if box[1][2] > STEP and box[0][2] < HEAD]
    inside = (x > 0) & (x < 10) & (y > 0) & (y < 5)
    half = 0.5 * maps["F0"].resolution

    def touched(slack: float) -> NDArray[np.bool_]:
        out = np.zeros(x.shape, dtype=bool)
        for (x0, y0, _), (x1, y1, _) in body:
            out |= (x > x0 - slack) & (x < x1 + slack) & (y > y0 - slack) & (y < y1 + slack)
        return out

    flight = (x > 5.5 - half) & (x < 8.2 + half) & (y > 4 - half)
    # The cells along the flight's side, from its second tread on, are its edge.
    beside = (x > FOOT_X_M - (N_STEPS - 1) * TREAD_M - 3 * half) & (x < FOOT_X_M) & (y > 4 - 3 * half) & ~flight
    clear = inside & ~touched(half + 1e-9) & ~flight & ~beside
    blocked = touched(-half) & ~flight
    assert (maps["F0"].cells[clear] == FREE).all()
    assert (maps["F0"].cells[blocked] == OCCUPIED).all()
    assert clear.sum() > 10_000


def test_rays_meet_nothing_over_free_ground(maps: dict[str, Served]) -> None:
    scene = o3d.t.geometry.RaycastingScene()
    for (x0, y0, z0), (x1, y1, z1) in [*ROOMS, TABLE, *STAIRS]:
        box = o3d.t.geometry.TriangleMesh.create_box(x1 - x0, y1 - y0, z1 - z0).translate([x0, y0, z0])
        scene.add_triangles(box)
    for floor, ground in (("F0", 0.0), ("F1", 2.8)):
        # The last cell of free ground may hang over a drop by half.
        surely = ndimage.binary_erosion(maps[floor].cells == FREE, np.ones((3, 3)))
        x, y = (values[surely] for values in maps[floor].centres())
        level = ~((x > 5.4) & (x < 8.3) & (y > 3.9))
        x, y = x[level][::7], y[level][::7]
        up = np.column_stack([x, y, np.full(x.size, ground + STEP), np.tile([0.0, 0.0, 1.0], (x.size, 1))])
        hit = scene.cast_rays(o3d.core.Tensor(up.astype(np.float32)))["t_hit"].numpy()
        assert (hit > HEAD - STEP - 1e-3).all(), floor
        up[:, 3:] = [0.0, 0.0, -1.0]
        hit = scene.cast_rays(o3d.core.Tensor(up.astype(np.float32)))["t_hit"].numpy()
        np.testing.assert_allclose(hit, STEP, atol=1e-4)


def test_no_ray_between_free_neighbours_meets_a_wall(maps: dict[str, Served]) -> None:
    scene = o3d.t.geometry.RaycastingScene()
    for (x0, y0, z0), (x1, y1, z1) in [*ROOMS, TABLE]:
        box = o3d.t.geometry.TriangleMesh.create_box(x1 - x0, y1 - y0, z1 - z0).translate([x0, y0, z0])
        scene.add_triangles(box)
    cells = maps["F0"].cells
    x, y = maps["F0"].centres()
    for axis, direction in ((1, (1.0, 0.0, 0.0)), (0, (0.0, 1.0, 0.0))):
        here = np.take(cells, range(cells.shape[axis] - 1), axis)
        there = np.take(cells, range(1, cells.shape[axis]), axis)
        both = (here == FREE) & (there == FREE)
        from_x, from_y = (np.take(values, range(cells.shape[axis] - 1), axis)[both] for values in (x, y))
        rays = np.column_stack([from_x, from_y, np.full(from_x.size, 1.0), np.tile(direction, (from_x.size, 1))])
        hit = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy()
        assert (hit > maps["F0"].resolution - 1e-4).all()


def test_the_flight_is_free_on_the_lower_floor(maps: dict[str, Served]) -> None:
    # Its last two steps are the upper floor's: they are within 0.3 m of it.
    below = [maps["F0"].at(FOOT_X_M - (k + 0.5) * TREAD_M, 4.5) for k in range(N_STEPS - 2)]
    above = [maps["F1"].at(FOOT_X_M - (k + 0.5) * TREAD_M, 4.5) for k in range(N_STEPS - 2, N_STEPS)]
    assert {int(cell) for cell in below + above} == {FREE}


@given(arrays(np.uint8, st.tuples(st.integers(1, 40), st.integers(1, 40))))
def test_any_picture_comes_back_from_its_png(picture: NDArray[np.uint8]) -> None:
    image = Image.open(io.BytesIO(grey_png(picture)))
    assert image.mode == "L"
    np.testing.assert_array_equal(np.asarray(image), picture)

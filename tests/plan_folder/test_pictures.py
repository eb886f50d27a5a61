"""Coverage pictures: what stands where in them, and what happens where nothing can draw them."""

import dataclasses
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import pyvista
from hypothesis import given
from hypothesis import strategies as st

from planner_core.engine.scan_engine import ScanEngine
from planner_core.errors import MissingPackageError
from planner_core.model import FloatArray, Link, Plan
from planner_core.plan_folder import offscreen, palette, pictures
from planner_core.plan_folder.drawing import png_canvas
from planner_core.plan_folder.folder import write_plan_folder
from planner_core.plan_folder.sheet import new_sheet, picture_box
from planner_core.progress import ProgressEvent

DRAW = """
import sys
import numpy, pyvista
from planner_core.plan_folder import pictures
from planner_core.plan_folder.offscreen import offscreen_window
eye = pictures.eye_on(numpy.eye(3), azimuth_rad=1.0, elevation_rad=0.8)
with offscreen_window() as window:
    seen = pictures.shoot(window, [pictures.Drawn(pyvista.Sphere(), (1.0, 0.0, 0.0))], eye, (64, 48))
print(seen.rgb.shape, numpy.isfinite(seen.depth_m).any(), "pyvista.plotting" in sys.modules)
"""


@pytest.fixture
def fresh_choice() -> Iterator[None]:
    """Forget which window opened before, and what the test finds out."""
    offscreen.window_class.cache_clear()
    yield
    offscreen.window_class.cache_clear()


@pytest.fixture(scope="module")
def ground_floor(plan: Plan) -> pictures.Seen:
    with offscreen.offscreen_window() as window:
        return pictures.render_floor(plan, plan.survey.floors[0], window)


def colour_at(seen: pictures.Seen, point_m: tuple[float, float, float]) -> FloatArray:
    height, width = seen.depth_m.shape
    ((x, y),) = 0.5 * (seen.eye.project(np.array([point_m])) + 1) * np.array([width, height])
    return seen.rgb[int(height - y), int(x)] / 255


@given(
    size=st.tuples(st.floats(1, 60), st.floats(1, 60), st.floats(0.5, 5)),
    azimuth=st.floats(-4, 4),
    elevation=st.floats(0.3, 1.4),
)
def test_eye_fills_the_picture_with_a_box(size: tuple[float, float, float], azimuth: float, elevation: float) -> None:
    corners = np.array([[x, y, z] for x in (0.0, size[0]) for y in (0, size[1]) for z in (0, size[2])])
    corners += np.array([500.0, -40, 7])
    seen = pictures.eye_on(corners, azimuth_rad=azimuth, elevation_rad=elevation).project(corners)
    np.testing.assert_allclose([seen.min(axis=0), seen.max(axis=0)], [[-1, -1], [1, 1]], atol=1e-6)


@pytest.mark.slow
def test_a_ball_is_drawn_where_the_eye_projects_its_middle() -> None:
    corners = np.array([[x, y, z] for x in (0.0, 8.0) for y in (0.0, 5.0) for z in (0.0, 2.0)])
    eye = pictures.eye_on(corners, azimuth_rad=1.1, elevation_rad=0.8)
    width, height = 600, 2 * round(300 * eye.half_height_tan / eye.half_width_tan)
    ball_m = np.array([6.5, 1.0, 1.5])
    ball = pictures.Drawn(pyvista.Sphere(radius=0.1, center=ball_m), (1.0, 0.0, 0.0))
    with offscreen.offscreen_window() as window:
        wide = pictures.shoot(window, [], eye, (width, height // 2))
        seen = pictures.shoot(window, [ball], eye, (width // 2, height // 2))
    assert (wide.rgb == 255).all()
    assert seen.rgb.shape == (height // 2, width // 2, 3), "a window draws pictures of any size, each by itself"
    row, column = np.nonzero(seen.rgb[:, :, 1] < 128)
    expected = 0.5 * (eye.project(ball_m[None])[0] + 1) * np.array(seen.rgb.shape[1::-1])
    np.testing.assert_allclose([column.mean() + 0.5, seen.rgb.shape[0] - row.mean() - 0.5], expected, atol=1.0)
    assert seen.depth_m.min() == pytest.approx(float(eye.depth_m(ball_m[None])[0]) - 0.1, abs=0.005)
    assert (np.isfinite(seen.depth_m) == (seen.rgb[:, :, 1] < 128)).mean() > 0.9999


def test_pixels_are_means_of_what_is_drawn_finer(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = np.random.default_rng(3).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    for times in (1, 2, 3, 4):
        monkeypatch.setattr(pictures, "OVERSAMPLING", times)
        part = drawn[: 40 // times * times, : 60 // times * times]
        mean = part.reshape(len(part) // times, times, -1, times, 3).mean(axis=(1, 3))
        light = np.linspace(0.5, 1.0, mean.shape[1], dtype=np.float32) * np.ones((len(mean), 1), dtype=np.float32)
        shown = pictures.averaged(part, light)
        step = 255 // pictures.N_LEVELS
        assert shown.dtype == np.uint8
        assert np.abs(shown - mean * light[:, :, None]).max() <= 0.5 * step + 1e-3
        assert (shown % step == 0).all()


@pytest.mark.slow
def test_picture_shows_walls_cut_dark_and_ground_in_the_colour_of_its_patch(
    plan: Plan, ground_floor: pictures.Seen
) -> None:
    cut_m = pictures.picture_cut_m(plan, plan.survey.floors[0])
    step = 0.5 / pictures.N_LEVELS + 1 / 255
    for wall in ((4.0, 0.7, cut_m), (4.0, 3.3, cut_m), (-0.1, 2.0, cut_m), (5.0, 4.1, cut_m)):
        np.testing.assert_allclose(colour_at(ground_floor, wall), palette.WALL, atol=step)
    middle_of_doorway = colour_at(ground_floor, (4.0, 2.1, 0.0))
    seen = palette.PATCH_COLOURS_SRGB[1:]
    assert np.abs(middle_of_doorway - seen).max(axis=1).min() < 0.12  # occlusion darkens a little
    np.testing.assert_allclose(colour_at(ground_floor, (-0.55, -0.55, 1.5)), [1, 1, 1], atol=step)


@pytest.mark.slow
def test_lines_are_shown_but_where_a_wall_hides_them(plan: Plan, ground_floor: pictures.Seen) -> None:
    for ends_m in pictures.strong_links(plan, list(plan.stations)):  # over the cut walls and through the doorway
        np.testing.assert_allclose(ground_floor.shown(ends_m), [ends_m])
    # Through the partition between the rooms, x from 3.9 to 4.1, below the cut.
    ends_m = np.array([(2.0, 0.7, 1.3), (6.0, 0.7, 1.3)])
    parts = ground_floor.shown(ends_m)
    assert 0.5 < sum(np.linalg.norm(part[1] - part[0]) for part in parts) < 4.0 - 0.2
    for part in parts:
        np.testing.assert_allclose(part[:, 1:], ends_m[:, 1:], atol=1e-9)
        assert part[1, 0] < 3.92 or part[0, 0] > 4.08
    assert ground_floor.shown(ends_m - (0.0, 0.0, 1.5)) == []  # below the ground
    legs_m = pictures.tripod_lines(pictures.stations_of(plan, plan.survey.floors[0]))
    assert legs_m.shape == (8, 2, 3)
    assert len(ground_floor.shown(legs_m[0])) == 1


def test_tripods_and_strong_links_are_drawn_and_weak_ones_are_not(plan: Plan, ground_floor: pictures.Seen) -> None:
    first, second, upstairs = plan.stations
    ends = pictures.strong_links(plan, [first, second])
    np.testing.assert_array_equal(ends, [[first.position_m, second.position_m]])
    weak = dataclasses.replace(plan, links=(Link(first.id, second.id, 0.29, 1.0),))
    assert pictures.strong_links(weak, [first, second]).shape == (0, 2, 3)
    assert pictures.strong_links(plan, [upstairs]).shape == (0, 2, 3)
    eye = ground_floor.eye
    box = picture_box(eye.half_width_tan, eye.half_height_tan)
    for links_m, n_seen in ((ends, 1), (ends[:0], 0)):
        canvas = new_sheet(box.height)
        pictures._draw_marks(canvas, [first, second], [1, 2], links_m, ground_floor, box)
        drawn = canvas.drawn()[:, :, :3] / 255
        at_m = np.array([ends[0].mean(axis=0), first.position_m - (0.0, 0.0, 0.4)])
        x_mm, y_mm = (0.5 * (eye.project(at_m) + 1) * (box.width, box.height) + (box.left, box.bottom)).T
        row, column = len(drawn) - pixels_at(y_mm), pixels_at(x_mm)
        link, pole = (drawn[r - 2 : r + 2, c - 2 : c + 2].reshape(-1, 3) for r, c in zip(row, column, strict=True))
        assert (np.abs(link - palette.LINK).max(axis=1) < 0.01).any() == n_seen
        assert (np.abs(pole - palette.STATION).max(axis=1) < 0.01).any()


def pixels_at(length_mm: FloatArray) -> FloatArray:
    return np.rint(length_mm / 25.4 * png_canvas.DPI).astype(int)


def test_every_patch_is_a_cell_and_level_ground_has_the_palettes_colour(plan: Plan) -> None:
    floor = plan.survey.floors[0]
    everything = np.ones(plan.survey.scene.n_triangles, dtype=np.bool_)
    surface = pictures.coloured_patches(plan, floor, everything)
    assert surface.n_cells == plan.survey.patches.n_patches
    ground = np.isin(plan.survey.patches.triangle_of_patch, floor.ground_triangles)
    index = palette.patch_colour_index(plan.times_seen[ground], plan.achievable[ground])
    np.testing.assert_array_equal(surface.cell_data["rgb"][ground], np.rint(255 * palette.PATCH_COLOURS_SRGB[index]))
    spared = dataclasses.replace(plan, required=~ground)
    pale = pictures.coloured_patches(spared, floor, everything).cell_data["rgb"]
    np.testing.assert_array_equal(
        pale[ground], np.broadcast_to(np.rint(255 * np.array(palette.NOT_REQUIRED)), (ground.sum(), 3))
    )
    np.testing.assert_array_equal(pale[~ground], surface.cell_data["rgb"][~ground])
    areas = surface.compute_cell_sizes(length=False, volume=False)["Area"]
    np.testing.assert_allclose(areas, plan.survey.patches.area_m2, rtol=1e-4)  # VTK keeps points as float32


def test_nothing_of_other_floors_or_above_the_cut_is_shown(plan: Plan) -> None:
    for floor in plan.survey.floors:
        box = pictures.box_m(plan, floor)
        used = pictures.triangles_in(plan.survey, box)
        bounds = np.reshape(pictures.cut_out(pictures.coloured_patches(plan, floor, used), box).bounds, (3, 2)).T
        np.testing.assert_array_less(box[0] - 1e-5, bounds[0])
        np.testing.assert_array_less(bounds[1], box[1] + 1e-5)
        assert bounds[1, 2] == pytest.approx(floor.elevation_m + pictures.CUT_HEIGHT_M, abs=1e-5)


@pytest.mark.slow
def test_drawing_says_nothing_on_stderr_without_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"):
        monkeypatch.delenv(name, raising=False)
    done = subprocess.run([sys.executable, "-c", DRAW], check=True, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("(48, 64, 3) True False\n", ""), "Plotter takes a second to import"


@pytest.mark.usefixtures("fresh_choice")
def test_no_window_is_an_error_with_the_remedy_and_not_the_end_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No EGL driver: VTK itself would end the process by a segmentation fault."""
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere")
    monkeypatch.setattr(offscreen, "WINDOWS", ("vtkEGLRenderWindow", "vtkNoSuchWindow"))
    with pytest.raises(MissingPackageError, match=r"libegl1.* or libosmesa6"):
        offscreen.window_class()


@pytest.mark.usefixtures("thumbnails")
def test_plan_without_a_window_is_written_and_says_that_pictures_are_left_out(
    plan: Plan, engine: ScanEngine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none_opens() -> str:
        raise MissingPackageError("none opens here; install <EGL>")

    monkeypatch.setattr(offscreen, "window_class", none_opens)
    events: list[ProgressEvent] = []
    write_plan_folder(plan, tmp_path / "plan", engine=engine, progress=events.append)
    report = tmp_path / "plan" / "report"
    assert sorted(path.name for path in report.glob("*_F0.png")) == ["links_F0.png", "map_F0.png"]
    page = (report / "index.html").read_text()
    assert "coverage pictures are left out: none opens here; install &lt;EGL&gt;" in page
    assert "picture_F" not in page
    left_out = [event.note for event in events if "left out" in event.note]
    assert left_out == [f"report/picture_F{i}.png is left out: none opens here; install <EGL>" for i in (0, 1)]
    assert events[-1].done == events[-1].total

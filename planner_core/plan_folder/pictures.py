r"""The coverage picture of a floor: cut open, in perspective, every patch in its colour. Plan, ScanEngine -> PNG.

PyVista draws the building off-screen (shading, hidden surfaces, edges); matplotlib adds what must be sharp: tripods and
links where the building does not hide them, station numbers, title, legend. Local frame, metres.

      (1)----(2)         number on the sensor, link to another sensor
       |      |
   ____|______|_____     cut, above the heads of tables, below those of doors
  |    |      |     |
  |___/|\____/|\____|    patches
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner_core.model import BoolArray, Float32Array, FloatArray, Floor, Plan, Station, Survey, UInt8Array
from planner_core.model.arrays import area_normals, bounds_of
from planner_core.plan_folder import palette
from planner_core.plan_folder.drawing.canvas import PAPER, Box, Canvas, Colour, Pen
from planner_core.plan_folder.drawing.marks import Labels, draw_stations
from planner_core.plan_folder.drawing.png_canvas import pixels
from planner_core.plan_folder.plan_source import PlanSource
from planner_core.plan_folder.section_view import BELOW_GROUND_M, camera_at, section_lines, solid_cells
from planner_core.plan_folder.sheet import (
    coverage_legend,
    draw_footer,
    draw_header,
    floor_figures,
    floor_subtitle,
    new_sheet,
    picture_box,
)
from planner_core.plan_folder.tripod import foot_m
from planner_core.scene.floors import ground_span_m
from planner_core.scene.patches import patch_triangles

# ----------------------------------------------------------------------------------------------------------- occlusion
# Ambient occlusion: corners, and what stands close to something, are darker than open surfaces. Depths -> brightness.
# One over the depth of a plane is linear across a picture in perspective. So on an open surface a place is as near as
# two places opposite each other beside it are on average. In a corner, or beside something, it lies deeper than that.

RINGS = ((0.06, 4), (0.15, 6), (0.3, 8), (0.5, 12))
"""Radius in metres, and lines through a place along which others are compared with it: the wider, the more."""

WIDEST_PIXELS = 60.0
"""In pictures from nearer all rings are smaller: so few lines would leave streaks."""

FULL, GONE = 0.8, 2.0
"""How much deeper than its neighbours, in radii, a place is in a corner; and where it is another place, far behind."""

DARKEST = 0.55
"""Brightness where everything occludes. A corner of two walls has about half of that darkening: colours of coverage
have to stay what they are."""

_ROWS_AT_ONCE = 64
"""So that all arrays of a step fit the processor's cache."""


def brightness(depth_m: Float32Array, pixels_at_1_m: float) -> Float32Array:
    """(H, W) from `DARKEST` to 1 of depths (H, W) along the looking direction, inf where nothing is.

    pixels_at_1_m : length of a metre at a depth of one.
    """
    there = np.isfinite(depth_m)
    if not there.any():
        return np.ones_like(depth_m)
    pixels_a_metre = pixels_at_1_m / float(np.median(depth_m[there]))
    share = min(1.0, WIDEST_PIXELS / (RINGS[-1][0] * pixels_a_metre))
    pixels = share * pixels_a_metre
    pairs = [
        (*np.rint(radius_m * pixels * np.array([np.cos(turn), np.sin(turn)])).astype(int), share * radius_m, n_lines)
        for number, (radius_m, n_lines) in enumerate(RINGS)
        for turn in np.pi * (np.arange(n_lines) + 0.5 * number) / n_lines
    ]
    near = np.float32(1.0) / depth_m
    squared = np.where(there, depth_m, np.float32(0.0)) ** 2
    margin = int(np.ceil(RINGS[-1][0] * pixels)) + 1
    around = np.pad(near, margin)
    darkness = np.zeros_like(near)
    for first in range(0, len(near), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        here, dark = near[rows], darkness[rows]
        height, width = here.shape
        for right, down, radius_m, n_lines in pairs:
            deeper = (
                around[first + margin + down :, margin + right :][:height, :width]
                + (around[first + margin - down :, margin - right :][:height, :width])
            )
            deeper *= np.float32(0.5)
            deeper -= here
            deeper *= squared[rows]
            deeper *= np.float32(1.0 / radius_m)
            corner = np.minimum(deeper * np.float32(1 / FULL), (GONE - deeper) * np.float32(1 / (GONE - FULL)))
            dark += np.clip(corner, 0.0, 1.0, out=corner) * np.float32(1.0 / n_lines)
    return np.asarray(1 - darkness * ((1 - DARKEST) / len(RINGS)), dtype=np.float32)


# ------------------------------------------------------------------------------------------------------------ pictures
CUT_HEIGHT_M = 1.6
"""Above the ground: most of the walls stays, and one still sees into rooms from half above."""

MARGIN_M = 0.6
"""Around the ground that can be surveyed: outer walls and reveals."""

ELEVATION_RAD = float(np.deg2rad(50.0))
AZIMUTH_RAD = float(np.deg2rad(64.0))
"""Looking direction, from half above over a corner; for floors deeper than wide a right angle less."""

HALF_WIDTH_TAN = 0.24
"""Tangent of half the horizontal angle of view: perspective enough to give depth, little enough to compare sizes."""

OVERSAMPLING = 2
"""Pixels drawn a pixel shown, along each side: smooth edges, the same ones on every driver."""

CAP_CELLS = 1600
"""Cells across the floor in which cut walls are found: about one a pixel."""

N_LEVELS = 51
"""Steps of brightness a channel: no eye sees them, and occlusion in more of them costs twice the bytes."""

WHITE_SHARE = 0.2
"""Mixed into everything but the ground, so that furniture reads against it."""

EDGE_ANGLE_DEG = 25.0
"""Edges at which faces turn by more than this are drawn: corners yes, the facets of round things no."""

POLE_WIDTH_M = 0.036
LINK_WIDTH_M = 0.032
LEG_SPREAD_M = 0.28
LEAST_WIDTH_MM = 0.35
"""Of tripods and links in pictures of large floors."""

HIDDEN_BY_M = 0.03
"""What lies this far in front of a line hides it: legs stand on the ground."""

_HIDDEN_LINK = Pen(0.27, palette.LINK, (0.8, 0.8))
_HIDDEN_POLE = Pen(0.27, palette.STATION, (0.8, 0.8))


@dataclass(frozen=True)
class Eye:
    """Perspective camera. position_m, right, up, forward : (3,) local, the last three unit vectors.

    half_width_tan, half_height_tan : tangents of half the angles of view; their ratio is the picture's.
    """

    position_m: FloatArray
    right: FloatArray
    up: FloatArray
    forward: FloatArray
    half_width_tan: float
    half_height_tan: float

    def project(self, points_m: FloatArray) -> FloatArray:
        """(N, 2) of points (N, 3): -1 to 1 from the left to the right and from the bottom to the top of the picture."""
        away = points_m - self.position_m
        across = np.stack([away @ self.right / self.half_width_tan, away @ self.up / self.half_height_tan], axis=1)
        return across / self.depth_m(points_m)[:, None]

    def depth_m(self, points_m: FloatArray) -> FloatArray:
        """(N,) how far points (N, 3) lie along `forward`."""
        return np.asarray((points_m - self.position_m) @ self.forward)


def eye_on(points_m: FloatArray, *, azimuth_rad: float, elevation_rad: float) -> Eye:
    """Stand where points (N, 3) fill the picture from edge to edge, its height following from them.

    Notes
    -----
    With t the tangent of half the angle of view, x across and z along the direction, a point is in the picture of an
    eye at (cx, cz) where |x - cx| <= t (z - cz). So cx - t cz >= max(x - t z) and cx + t cz <= min(x + t z); the
    nearest eye meets both bounds.
    """
    camera = camera_at(azimuth_rad=azimuth_rad, elevation_rad=elevation_rad)
    x, y, z = (points_m @ axis for axis in (camera.right, camera.up, camera.forward))
    t = HALF_WIDTH_TAN
    low, high = float((x - t * z).max()), float((x + t * z).min())
    eye_x, eye_z = (low + high) / 2, (high - low) / (2 * t)
    depth = z - eye_z
    below, above = float(y.min()), float(y.max())
    for _ in range(60):  # bisection: the eye's height at which as much is seen above the middle as below
        eye_y = (below + above) / 2
        slopes = (y - eye_y) / depth
        below, above = (eye_y, above) if slopes.max() > -slopes.min() else (below, eye_y)
    position_m = eye_x * camera.right + eye_y * camera.up + eye_z * camera.forward
    return Eye(position_m, camera.right, camera.up, camera.forward, t, float(np.abs(slopes).max()))


def picture_cut_m(plan: Plan, floor: Floor) -> float:
    """Height of the cut, local: `CUT_HEIGHT_M` above the ground, lower where the next floor is near."""
    _, ground_m = ground_span_m(plan.survey.scene, floor)
    above = [other.elevation_m for other in plan.survey.floors if other.elevation_m > ground_m + 0.5]
    return min([ground_m + CUT_HEIGHT_M, *(0.4 * ground_m + 0.6 * z for z in above)])


def write_floor_picture(plan: Plan, floor_index: int, path: Path, *, window: Any, source: PlanSource) -> None:
    """Write the coverage picture of one floor, drawn in a window of `offscreen_window`."""
    floor = plan.survey.floors[floor_index]
    stations = stations_of(plan, floor)
    seen = render_floor(plan, floor, window)
    box = picture_box(seen.eye.half_width_tan, seen.eye.half_height_tan)
    canvas = new_sheet(box.height)
    canvas.raster(seen.rgb, box.left, box.bottom)
    with canvas.clip(box):
        number = {station.id: station.number for station in source.stations}
        numbers = [number[station.id] for station in stations]
        _draw_marks(canvas, stations, numbers, strong_links(plan, stations), seen, box)
    draw_header(canvas, floor.name, floor_subtitle(plan, source, floor), floor_figures(source, floor.id))
    draw_footer(canvas, legend=coverage_legend(plan), lines=(("registration link", Pen(0.5, palette.LINK)),))
    canvas.save(path)


def stations_of(plan: Plan, floor: Floor) -> list[Station]:
    """Stations on `floor` in visiting order."""
    return sorted((s for s in plan.stations if s.floor == floor.id), key=lambda station: station.order)


@dataclass(frozen=True, eq=False)
class Seen:
    """The building as an eye sees it: rgb (H, W, 3) sRGB, and depth_m (H, W) along the eye's direction, inf at none."""

    eye: Eye
    rgb: UInt8Array
    depth_m: Float32Array

    def shown(self, ends_m: FloatArray) -> list[FloatArray]:
        """(2, 3) parts of a line with ends (2, 3), local, that nothing hides."""
        height, width = self.depth_m.shape
        across = 0.5 * np.ptp(self.eye.project(ends_m), axis=0) * (width, height)
        share = np.linspace(0.0, 1.0, 2 + int(across.max()))
        points_m = ends_m[0] + share[:, None] * (ends_m[1] - ends_m[0])
        at = 0.5 * (self.eye.project(points_m) * (1, -1) + 1) * (width, height)
        column, row = np.clip(at.astype(np.int64), 0, (width - 1, height - 1)).T
        free = self.eye.depth_m(points_m) <= self.depth_m[row, column] + HIDDEN_BY_M
        turns = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int8)))
        return [points_m[[first, end - 1]] for first, end in turns.reshape(-1, 2) if end - first > 1]


def render_floor(plan: Plan, floor: Floor, window: Any) -> Seen:
    """Draw the building in a window of `offscreen_window`, without tripods and links."""
    box = box_m(plan, floor)
    eye = _eye_on_box(box, stations_of(plan, floor))
    size = picture_box(eye.half_width_tan, eye.half_height_tan)
    return shoot(window, _building(plan, floor, box), eye, (pixels(size.width), pixels(size.height)))


def _eye_on_box(box: FloatArray, stations: list[Station]) -> Eye:
    corners = [(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]]
    wide = np.ptp(box[:, 0]) >= np.ptp(box[:, 1])
    return eye_on(
        np.array([*corners, *(station.position_m for station in stations)]),
        azimuth_rad=AZIMUTH_RAD if wide else AZIMUTH_RAD - np.pi / 2,
        elevation_rad=ELEVATION_RAD,
    )


def box_m(plan: Plan, floor: Floor) -> FloatArray:
    """(2, 3) local: what the picture shows, from a little below the ground up to the cut.

    In plan it holds the ground that can be surveyed, and walls around it: terraces out of reach would make rooms small.
    """
    survey = plan.survey
    ground = np.zeros(survey.scene.n_triangles, dtype=np.bool_)
    ground[floor.ground_triangles] = True
    at = ground[survey.patches.triangle_of_patch]
    reached = _patch_corners(survey, ground)[plan.achievable[at]].reshape(-1, 3)[:, :2]
    low, high = (reached.min(axis=0), reached.max(axis=0)) if len(reached) else floor.bounds_m
    bottom_m, top_m = ground_span_m(survey.scene, floor)[0] - BELOW_GROUND_M, picture_cut_m(plan, floor)
    return np.array([[*(low - MARGIN_M), bottom_m], [*(high + MARGIN_M), top_m]])


def _patch_corners(survey: Survey, used: BoolArray) -> FloatArray:
    """(N, 3, 3) patches of the triangles `used` (T,), in patch order; of all triangles it would be gigabytes."""
    part = replace(survey.scene, triangles=survey.scene.triangles[used])
    return patch_triangles(part, replace(survey.patches, depth=survey.patches.depth[used]))


@dataclass(frozen=True, eq=False)
class Drawn:
    """A PyVista surface or lines. colour : sRGB; None: of each cell by its array `rgb`. width : of lines, pixels."""

    mesh: Any
    colour: Colour | None = None
    width: float = 1.0


def _building(plan: Plan, floor: Floor, box: FloatArray) -> Iterator[Drawn]:
    """What is drawn of the building inside the box (2, 3)."""
    import pyvista

    scene, cut_m = plan.survey.scene, float(box[1, 2])
    used = triangles_in(plan.survey, box)
    yield Drawn(cut_out(coloured_patches(plan, floor, used), box))
    yield Drawn(_caps(plan.survey, floor, box), palette.WALL)
    faces = cut_out(pyvista.PolyData(scene.vertices_m, faces=_faces(scene.triangles[used])), box)
    edges = faces.extract_feature_edges(
        EDGE_ANGLE_DEG, boundary_edges=True, manifold_edges=False, non_manifold_edges=False
    )
    yield Drawn(edges, palette.WALL, 1.5)
    lines_m = section_lines(plan.survey, cut_m)
    inside = (lines_m[:, :, :2] >= box[0, :2]) & (lines_m[:, :, :2] <= box[1, :2])
    yield Drawn(_segments(lines_m[inside.all(axis=(1, 2))]), palette.WALL, 2.0)


def triangles_in(survey: Survey, box: FloatArray) -> BoolArray:
    """(T,) bool: triangles whose bounds meet the box (2, 3)."""
    low_m, high_m = bounds_of(survey.scene.vertices_m[survey.scene.triangles])
    meets: BoolArray = ((low_m < box[1]) & (high_m > box[0])).all(axis=1)
    return meets


def coloured_patches(plan: Plan, floor: Floor, used: BoolArray) -> Any:
    """PyVista surface of the patches of triangles `used` (T,); cell array `rgb`, uint8, one cell a patch."""
    import pyvista

    triangle_of_patch = plan.survey.patches.triangle_of_patch
    at = used[triangle_of_patch]
    corners = _patch_corners(plan.survey, used)
    rgb = palette.colours_of_patches(plan, at)
    ground = np.isin(triangle_of_patch[at], floor.ground_triangles)
    rgb[~ground] = WHITE_SHARE + (1 - WHITE_SHARE) * rgb[~ground]
    rgb *= _shade(corners)[:, None]
    surface = pyvista.PolyData(corners.reshape(-1, 3), faces=_faces(np.arange(3 * len(corners)).reshape(-1, 3)))
    surface.cell_data["rgb"] = np.rint(255 * rgb).astype(np.uint8)
    return surface


def _shade(corners_m: FloatArray) -> FloatArray:
    """(N,) brightness of triangles (N, 3, 3) by their direction: level ones keep their colour, walls get darker."""
    normal = area_normals(corners_m)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    squared = (normal / length[:, None]) ** 2
    shade: FloatArray = squared @ np.array([0.78, 0.89, 1.0])
    return shade


def _caps(survey: Survey, floor: Floor, box: FloatArray) -> Any:
    """Cut faces of walls, as strips along x: the solid cells of the floor seen from above, row by row."""
    import pyvista

    window_m, cut_m = box[:, :2], float(box[1, 2])
    solid, cell_m = solid_cells(survey, floor=floor, cut_m=cut_m, window_m=window_m, width=CAP_CELLS)
    steps = np.diff(np.pad(solid.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, first = np.nonzero(steps == 1)
    _, end = np.nonzero(steps == -1)
    x0, x1 = (window_m[0, 0] + column * cell_m for column in (first, end))
    y1 = window_m[1, 1] - row * cell_m
    y0 = y1 - cell_m
    z = np.full(row.size, cut_m)
    corners = np.stack([np.stack(p, axis=1) for p in ((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))], axis=1)
    return pyvista.PolyData(corners.reshape(-1, 3), faces=_faces(np.arange(4 * row.size).reshape(-1, 4)))


def cut_out(surface: Any, box: FloatArray) -> Any:
    """Keep the part of the surface inside the box (2, 3)."""
    for axis, name in enumerate("xyz"):
        for origin_m, beyond in ((box[0], False), (box[1], True)):
            low, high = surface.bounds[2 * axis : 2 * axis + 2]
            if (surface.n_cells and low < box[0, axis]) or high > box[1, axis]:
                surface = surface.clip(normal=name, origin=origin_m, invert=beyond)
    return surface


def _faces(corners: NDArray[np.integer]) -> NDArray[np.integer]:
    """VTK's flat list of faces (N, K): K, then the K corners, face by face."""
    return np.insert(corners, 0, corners.shape[1], axis=1).ravel()


def _segments(ends_m: FloatArray) -> Any:
    """PyVista lines with ends (N, 2, 3)."""
    import pyvista

    return pyvista.PolyData(ends_m.reshape(-1, 3), lines=_faces(np.arange(2 * len(ends_m)).reshape(-1, 2)))


def tripod_lines(stations: list[Station]) -> FloatArray:
    """(N, 2, 3) local: of each station the pole up to the sensor, and three legs."""
    lines = []
    for station in stations:
        foot, sensor = foot_m(station), station.position_m
        hub = foot + 0.7 * (sensor - foot)
        turn = 2 * np.pi / 3 * np.arange(3) + np.pi / 6
        feet = foot + LEG_SPREAD_M * np.stack([np.cos(turn), np.sin(turn), np.zeros(3)], axis=1)
        if sensor[2] > foot[2]:
            lines += [(foot, sensor), *((hub, leg) for leg in feet)]
    return np.array(lines).reshape(-1, 2, 3)


def strong_links(plan: Plan, stations: list[Station]) -> FloatArray:
    """(N, 2, 3) local: ends of the links among `stations` that count."""
    at = {station.id: station.position_m for station in stations}
    limits = plan.settings.requirements.link_limits
    enough = [link for link in plan.links if link.counts(limits)]
    ends = [(at[link.a], at[link.b]) for link in enough if link.a in at and link.b in at]
    return np.array(ends).reshape(-1, 2, 3)


def shoot(window: Any, things: Iterable[Drawn], eye: Eye, size: tuple[int, int]) -> Seen:
    """Draw things, each pixel the mean of `OVERSAMPLING` by as many, darker in corners.

    window : of `offscreen_window`. size : width and height of what is returned, pixels.
    """
    from vtkmodules.vtkCommonCore import vtkFloatArray, vtkUnsignedCharArray
    from vtkmodules.vtkRenderingCore import vtkRenderer

    renderer = vtkRenderer()
    renderer.SetBackground(*PAPER)
    for thing in things:
        if thing.mesh.n_cells:
            renderer.AddActor(_actor(thing))
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*eye.position_m.tolist())
    camera.SetFocalPoint(*(eye.position_m + eye.forward).tolist())
    camera.SetViewUp(*eye.up.tolist())
    camera.SetViewAngle(2 * float(np.rad2deg(np.arctan(eye.half_height_tan))))
    width, height = (OVERSAMPLING * each for each in size)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    try:
        renderer.ResetCameraClippingRange()
        window.Render()
        depths, colours = vtkFloatArray(), vtkUnsignedCharArray()
        window.GetZbufferData(0, 0, width - 1, height - 1, depths)
        window.GetPixelData(0, 0, width - 1, height - 1, 0, colours, 0)
    finally:
        window.RemoveRenderer(renderer)
    near_m, far_m = camera.GetClippingRange()
    place = slice(OVERSAMPLING // 2, None, OVERSAMPLING)
    share = _rows_from_top(depths, height, width)[place, place, 0]
    depth_m = np.where(share < 1, near_m * far_m / (far_m - share * (far_m - near_m)), np.inf).astype(np.float32)
    light = brightness(depth_m, depth_m.shape[1] / (2 * eye.half_width_tan))
    return Seen(eye, averaged(_rows_from_top(colours, height, width), light), depth_m)


def _actor(thing: Drawn) -> Any:
    """VTK's, without lighting."""
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(thing.mesh)
    actor.SetMapper(mapper)
    actor.GetProperty().LightingOff()
    actor.GetProperty().SetLineWidth(thing.width)
    if thing.colour is None:
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray("rgb")
        mapper.SetColorModeToDirectScalars()
    else:
        mapper.ScalarVisibilityOff()
        actor.GetProperty().SetColor(*thing.colour)
    return actor


def _rows_from_top(array: Any, height: int, width: int) -> Any:
    """(H, W, K) of pixels that VTK has in rows from the bottom."""
    from pyvista import convert_array

    return convert_array(array).reshape(height, width, -1)[::-1]


def averaged(drawn: UInt8Array, light: Float32Array) -> UInt8Array:
    """(H, W, 3) in `N_LEVELS` steps: means of pixels drawn `OVERSAMPLING` times as fine, times `light` (H, W)."""
    n = OVERSAMPLING
    total = np.zeros((*light.shape, 3), dtype=np.uint16)
    for i, j in np.ndindex(n, n):
        total += drawn[i::n, j::n]
    level = np.rint(total * (light * np.float32(N_LEVELS / (255 * n**2)))[:, :, None])
    return np.asarray(level * np.float32(255 / N_LEVELS), dtype=np.uint8)


def _draw_marks(
    canvas: Canvas, stations: list[Station], numbers: list[int], links_m: FloatArray, seen: Seen, box: Box
) -> None:
    """Tripods and links, dashed where something hides them, and numbers of the stations."""

    def on_paper(points_m: FloatArray) -> FloatArray:
        at = 0.5 * (seen.eye.project(points_m) + 1) * (box.width, box.height)
        return np.asarray(at + np.array([box.left, box.bottom]))

    if not stations:
        return
    sensors_m = np.array([station.position_m for station in stations])
    mm_per_m = box.width / (2 * seen.eye.half_width_tan * float(seen.eye.depth_m(sensors_m).mean()))
    poles_m = np.stack([np.array([foot_m(station) for station in stations]), sensors_m], axis=1)
    for lines_m, hidden_m, width_m, hidden in (
        (tripod_lines(stations), poles_m, POLE_WIDTH_M, _HIDDEN_POLE),
        (links_m, links_m, LINK_WIDTH_M, _HIDDEN_LINK),
    ):
        canvas.lines([on_paper(ends_m) for ends_m in hidden_m], hidden)
        shown = [on_paper(part_m) for ends_m in lines_m for part_m in seen.shown(ends_m)]
        canvas.lines(shown, Pen(max(width_m * mm_per_m, LEAST_WIDTH_MM), hidden.colour, round=True))
    draw_stations(Labels(canvas, box, []), on_paper(sensors_m), numbers)

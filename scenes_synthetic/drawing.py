"""Drawing parts of a synthetic scene to a PNG: from outside, cut open and fitted to the picture, or from eye height.

Every part is cut by a plane and closed again, so that walls show their thickness. Frame: the scene's, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista as pv
from PIL import Image, ImageChops

from planner_core.model import FloatArray
from scenes_synthetic.model import Part
from scenes_synthetic.solids import Point, Solid, join

_COLOURS = {
    "IfcWall": "#e9e6df",
    "IfcSlab": "#cbb994",
    "IfcRoof": "#8d8f93",
    "IfcStair": "#b98b5a",
    "IfcRailing": "#5d6470",
    "IfcDoor": "#9c6a46",
    "IfcWindow": "#86b6d8",
    "IfcFurniture": "#d9b48a",
    "IfcSanitaryTerminal": "#f7f9fb",
    "IfcElectricAppliance": "#c3c9d1",
    "IfcColumn": "#d5d2ca",
    "IfcDuctSegment": "#b9c4cc",
    "IfcPipeSegment": "#c0715a",
    "IfcLightFixture": "#fbf3c4",
    "IfcSpaceHeater": "#f3f1ea",
    "IfcTank": "#8fa6b5",
    "IfcBoiler": "#c98a5c",
    "IfcPump": "#5f86a6",
    "IfcUnitaryEquipment": "#a9b4ba",
    "IfcGeographicElement": "#7d9b64",
}
_OTHER_COLOUR = "#c9c9c9"
_BY_MATERIAL = {"glass": ("#7fc4c9", 0.4), "mirror": ("#b4c3d6", 1.0)}
"""Colour and opacity."""
_BY_NAME = (
    ("chair", "#4d6f8c"),
    ("shelf", "#a9744f"),
    ("plant", "#6f9a5b"),
    ("computer", "#3f444b"),
    ("board", "#4b6b57"),
    ("bicycle", "#b5473f"),
    ("cartons", "#c8a26a"),
    ("barrel", "#3f6f99"),
    ("mat", "#7089a8"),
    ("panel", "#aeb6bd"),
    ("screen", "#c9d2cf"),
    ("bed", "#7f9fb0"),
    ("sofa", "#7f9fb0"),
    ("armchair", "#7f9fb0"),
)
"""Colours of what stands in rooms, by the word its name ends with before its number; the last that fits."""
_GROUND = ("Ground", "#c3c6b4")
_FACADE = ("IfcWall", "IfcWindow", "IfcDoor")
_FABRIC = ("IfcWall", "IfcSlab", "IfcRoof", "IfcStair", "IfcDoor", "IfcWindow", "IfcColumn", "IfcDuctSegment")
_CUT_COLOUR = "#4a4f57"
_EDGE_COLOUR = "#33373d"
_BELOW = 0.62
"""Brightness of storeys below the highest one of a cut: what is seen through a void differs from the floor round it."""
_MOST_LIFT_M = 0.05
_UNCUT_M = 99.0
_LIGHTS = (((-1.0, -2.0, 3.0), 0.75), ((2.0, -1.0, 2.0), 0.35), ((0.0, 2.0, 1.0), 0.3))
_LIGHTS_INSIDE = (((-1.0, -2.0, 3.0), 0.5), ((2.0, 1.0, 2.0), 0.4), ((0.3, -0.2, -1.0), 0.7))
"""(where from, strength); rooms get some from below, as floors and tables throw it back."""
_MARGIN_PIXELS = 8
_N_COLOURS = 256
"""Enough for flat colours and shading; a third of the bytes of a full-colour PNG."""


@dataclass(frozen=True)
class View:
    """One picture: the parts of some storeys, cut at a height and in front, seen from a direction or from a spot."""

    file_name: str
    scene: str
    storeys: tuple[int, ...]
    cut_m: float = _UNCUT_M
    seen_from: Point = (-0.4, -1.0, 1.6)
    """Direction from the middle to the eye."""
    front_m: float = -99.0
    """What lies south of this y is cut away."""
    edges: bool = True
    """Draw the edges of everything; without, of the fabric only: furniture of real density would be black with them."""
    size: tuple[int, int] = (1000, 740)
    """Width and height at most; white margins are cut off."""
    inside: tuple[Point, Point] | None = None
    """Eye and what it looks at, in a room; `seen_from` is then unused."""
    shadows: bool = True
    """Darken corners. From hundreds of metres off that is finer than the depths that are known, and makes stripes."""


def draw(parts: Sequence[Part], view: View, path: Path) -> None:
    """Render one view off-screen to a PNG."""
    plotter = pv.Plotter(off_screen=True, window_size=view.size, lighting="none")
    plotter.set_background("white")
    shown = [part for part in parts if part.storey in view.storeys]
    _aim(plotter, shown, view)
    top = max(part.storey for part in shown)
    groups: dict[tuple[str, float, bool, bool], list[Solid]] = {}
    for part in shown:
        below = part.storey < top and view.cut_m < _UNCUT_M and part.kind not in _FACADE
        key = (*_colour(part), view.edges or part.kind in _FABRIC, below)
        groups.setdefault(key, []).append(part.solid)
    for (colour, opacity, edges, below), solids in groups.items():
        shade = _BELOW if below else 1.0
        _add(plotter, join(solids), colour, view, edges=edges, opacity=opacity, brightness=shade)
    _light(plotter, view)
    if view.shadows:
        plotter.enable_ssao(radius=0.8, bias=0.02, kernel_size=64)
    plotter.enable_anti_aliasing("ssaa")
    plotter.reset_camera_clipping_range()
    image = Image.fromarray(plotter.screenshot(return_img=True, window_size=view.size))
    plotter.close()
    image = image if view.inside else _without_margins(image)
    image.quantize(_N_COLOURS).save(path, optimize=True)


def _light(plotter: pv.Plotter, view: View) -> None:
    for direction, strength in _LIGHTS_INSIDE if view.inside else _LIGHTS:
        plotter.add_light(pv.Light(position=direction, light_type="scene light", intensity=strength))


def _colour(part: Part) -> tuple[str, float]:
    """Colour and opacity."""
    if part.material:
        return _BY_MATERIAL[part.material]
    name = part.name.rstrip(" 0123456789")
    if name == _GROUND[0]:
        return _GROUND[1], 1.0
    by_name = [colour for word, colour in _BY_NAME if part.room and name.endswith(word)]
    return (by_name or [_COLOURS.get(part.kind, _OTHER_COLOUR)])[-1], 1.0


def _aim(plotter: pv.Plotter, parts: Sequence[Part], view: View) -> None:
    """Point the camera: from the eye of a view inside; else so far off that what is shown just fills the picture."""
    camera = plotter.camera
    camera.up = (0.0, 0.0, 1.0)
    if view.inside:
        camera.position, camera.focal_point = view.inside
        camera.view_angle = 62.0
        return
    points = np.concatenate([part.solid.bounds_m for part in parts])
    low, high = points.min(axis=0), points.max(axis=0)
    low[1], high[2] = max(low[1], view.front_m), min(high[2], view.cut_m)
    corners = np.array(np.meshgrid(*np.stack([low, high], axis=1))).reshape(3, 8).T
    forward = -np.asarray(view.seen_from) / np.linalg.norm(view.seen_from)
    eye = _fitted_eye(corners, forward, view.size, np.deg2rad(camera.view_angle))
    camera.position, camera.focal_point = eye, eye + forward


def _fitted_eye(points_m: FloatArray, forward: FloatArray, size: tuple[int, int], view_angle_rad: float) -> FloatArray:
    """Eye from which points (N, 3) just fill a picture. In camera axes every side of it is one linear bound."""
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, forward), forward])
    across, up, deep = axes @ points_m.T
    tangent = np.tan(view_angle_rad / 2) * (1 - 2 * _MARGIN_PIXELS / min(size))
    eye = np.empty(3)
    depths = []
    for i, (along, slope) in enumerate(((across, tangent * size[0] / size[1]), (up, tangent))):
        high, low = (along - slope * deep).max(), (-along - slope * deep).max()
        eye[i] = (high - low) / 2
        depths.append(-(high + low) / (2 * slope))
    eye[2] = min(depths)
    found: FloatArray = eye @ axes
    return found


def _without_margins(image: Image.Image) -> Image.Image:
    content = ImageChops.difference(image, Image.new(image.mode, image.size, "white")).getbbox()
    if content is None:
        raise ValueError("nothing of the scene is in the picture: check what the view cuts away")
    left, upper, right, lower = content
    m = _MARGIN_PIXELS
    width, height = image.size
    return image.crop((max(0, left - m), max(0, upper - m), min(width, right + m), min(height, lower + m)))


def _add(
    plotter: pv.Plotter, solid: Solid, colour: str, view: View, *, edges: bool, opacity: float, brightness: float
) -> None:
    """Add closed solids of one colour, cut and closed again at the view's planes."""
    faces = np.column_stack([np.full(len(solid.triangles), 3), solid.triangles])
    mesh = pv.PolyData(solid.vertices_m, faces.ravel())
    for axis, at, sign in ((2, view.cut_m, -1.0), (1, view.front_m, 1.0)):
        low, high = mesh.bounds[2 * axis : 2 * axis + 2]
        if (high <= at) if sign > 0 else (low >= at):
            return
        if (low < at) if sign > 0 else (high > at):
            mesh = _cut(plotter, mesh, axis, at, sign)
    tint = tuple(brightness * v for v in pv.Color(colour).float_rgb)
    plotter.add_mesh(mesh, color=tint, ambient=0.35, diffuse=0.8, opacity=opacity)
    if not edges:
        return
    lines = mesh.extract_feature_edges(25, boundary_edges=False, manifold_edges=False, non_manifold_edges=False)
    if lines.n_cells:
        # A little nearer to the eye than the faces beside them, which would hide every other pixel of them.
        way = np.asarray(plotter.camera.position) - lines.points
        lines.points += way * np.minimum(0.002, _MOST_LIFT_M / np.linalg.norm(way, axis=1, keepdims=True))
        plotter.add_mesh(lines, color=_EDGE_COLOUR, line_width=1, lighting=False)


def _cut(plotter: pv.Plotter, mesh: pv.PolyData, axis: int, at_m: float, sign: float) -> pv.PolyData:
    """Keep what lies on the side `sign` of a plane, show the cut dark, and return the rest."""
    normal, origin = np.zeros(3), np.zeros(3)
    normal[axis], origin[axis] = sign, at_m
    mesh = mesh.clip_closed_surface(normal=normal, origin=origin)
    on_cut = np.abs(mesh.cell_centers().points[:, axis] - at_m) < 1e-6
    cap = mesh.extract_cells(on_cut)
    if cap.n_cells:
        plotter.add_mesh(cap, color=_CUT_COLOUR, lighting=False)
    return mesh.extract_cells(~on_cut).extract_surface(algorithm=None)

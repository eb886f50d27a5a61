"""Loading: scene files of any format -> `Scene`.

The extension chooses the reader, a module a format; `planner_core.scene.build` then brings units, axes and origin into
line and repairs; `planner_core.scene.federation` makes one scene of several files. What was guessed or repaired is in
`Scene.report`.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from planner_core.documents import Number, YesNo, document
from planner_core.errors import SceneError, SceneNotFoundError, grouped
from planner_core.model import Doors, Georeference, Glass, LoadReport, Optics, Scene, SceneSource, UpAxis
from planner_core.model.arrays import lengths
from planner_core.model.choices import one_of
from planner_core.model.values import DoorsWord, GlassWord, UpAxisWord
from planner_core.progress import Progress, ProgressEvent, silent
from planner_core.scene.build import scene_from_arrays
from planner_core.scene.doors import without_door_leaves
from planner_core.scene.element_patterns import without_elements
from planner_core.scene.extent import LONGEST_M, MAX_LENGTH_M, SHORTEST_M, UNITS_M, extent_m, likely_unit, named_few
from planner_core.scene.federation import federated
from planner_core.scene.file_formats import DRAWINGS, FORMAT_OF_EXTENSION, POINT_CLOUDS
from planner_core.scene.gltf_file import names_draco
from planner_core.scene.raw import RawScene, unit_name
from planner_core.scene.rooms import with_rooms
from planner_core.scene.up_axis import UpAxes, UpAxisDoubt, up_axis_doubt

_ANY_UP_AXIS = frozenset({"obj", "ply", "stl", "gltf", "usd"})
"""Formats whose files are found with either axis up: three say nothing of it, and programs write glTF and USD with
the axis of their own. IFC is z up, and its storeys say so again."""

_ROOM_VOLUME = "ifcspace"
"""In names of elements, capitals or not."""

_OPTICS_OF_GLASS = {Glass.PASS: Optics.PASSES, Glass.STOP: Optics.STOPS, Glass.RETURN: Optics.RETURNS}


@document
@dataclass(frozen=True)
class LoadOptions:
    """How a file is read. None: the file's own; where it has none, metres and z up."""

    metres_per_unit: Number | None = None
    up_axis: UpAxisWord | None = None
    skip_bad_faces: YesNo = False
    """Drop faces that name a vertex which does not exist, instead of refusing the file."""
    glass: GlassWord = Glass.PASS
    """What glass does to beams."""
    doors: DoorsWord = Doors.SHUT
    """Which doors (`IfcDoor`) have their leaves left out."""
    doors_open: tuple[str, ...] = ()
    """GlobalIds of doors that have their leaves left out whatever `doors` is."""
    doors_shut: tuple[str, ...] = ()
    """GlobalIds of doors that keep them whatever `doors` is."""
    leave_out: tuple[str, ...] = ()
    """Classes and patterns of names (`IfcFurnishingElement`, `name=*tree*`) whose elements are left out."""

    def __post_init__(self) -> None:
        unit = self.metres_per_unit
        if unit is not None and not (math.isfinite(unit) and unit > 0):
            raise SceneError(f"metres per unit is {unit}, expected a number above 0; 0.001 is a millimetre.")
        if self.up_axis is not None:
            object.__setattr__(self, "up_axis", one_of(UpAxis, self.up_axis, "upward axis", error=SceneError))
        object.__setattr__(self, "glass", one_of(Glass, self.glass, "glass", error=SceneError))
        object.__setattr__(self, "doors", one_of(Doors, self.doors, "doors", error=SceneError))
        if both := set(self.doors_open) & set(self.doors_shut):
            raise SceneError(f"door {min(both)}: got it as open and as shut, expected one of the two; correct it")


def load_scene(
    path: Path | Sequence[Path],
    *,
    options: LoadOptions | Sequence[LoadOptions] = LoadOptions(),
    progress: Progress = silent,
) -> Scene:
    """Load a scene from its file, or from several files that are one building together.

    Parameters
    ----------
    path : IFC, OBJ, PLY, STL, glTF/GLB or USD file, recognised by its extension; or several, see
        `planner_core.scene.federation` for how they are put together.
    options : unit, upward axis and leniency; of several files one for all, or one for each.
    progress : gets events of the stage `load`.

    Raises
    ------
    SceneNotFoundError
        There is no such file, or it can't be read.
    SceneError
        A file can't be used, or not with the others; the message names the reason and the remedy.
    MissingPackageError
        The format's library is not installed.

    Notes
    -----
    `SceneSource.sha256` is of the named file alone, not of files that it refers to. Same files, same scene, bit by bit.
    """
    paths = [Path(path)] if isinstance(path, str | Path) else [Path(each) for each in path]
    each_options = [options] * len(paths) if isinstance(options, LoadOptions) else list(options)
    _check_options(paths, each_options)
    files = [_File(each, _check_file(each), of) for each, of in zip(paths, each_options, strict=True)]
    once, repeated = _once_each(files)
    scenes = [_load_file(file, several=len(once) > 1, progress=progress) for file in once]
    if len(scenes) == 1:
        scene = scenes[0]
    else:
        progress(ProgressEvent("load", 0, 0, "putting the files together"))
        scene = _with_warnings(federated(scenes), _unit_doubts(scenes))
    options = each_options[0]
    if options.leave_out:
        scene = without_elements(scene, options.leave_out)
    if options.doors != Doors.SHUT or options.doors_open or options.doors_shut:
        scene = without_door_leaves(scene, options.doors, opened=options.doors_open, shut=options.doors_shut)
    progress(ProgressEvent("load", 1, 1, "loaded"))
    return _with_warnings(_with_glass(scene, options.glass), repeated)


@dataclass(frozen=True)
class _File:
    """A file to load, checked."""

    path: Path
    format: str
    options: LoadOptions

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal."""
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


def _check_options(paths: list[Path], options: list[LoadOptions]) -> None:
    if not paths:
        raise SceneError("got no scene file, expected one or more; name them.")
    if len(options) != len(paths):
        raise SceneError(
            f"got options for {len(options)} files, expected {len(paths)}; pass one of each, or one for all."
        )
    if len({(each.glass, each.doors, each.doors_open, each.doors_shut, each.leave_out) for each in options}) > 1:
        raise SceneError(
            "got files with different glass, doors or classes to leave out, expected the same for all; they are one "
            "building."
        )


def _once_each(files: list[_File]) -> tuple[list[_File], list[str]]:
    """Return the files that differ from all before them, and a line on each of the others."""
    if len(files) == 1:
        return files, []
    once: dict[str, _File] = {}
    lines = []
    for file in files:
        first = once.setdefault(file.sha256, file)
        if first is not file:
            other = "" if first.path == file.path else f" is the same file as {first.path} and"
            lines.append(f"{file.path}:{other} was given a second time: it is read once.")
    return list(once.values()), lines


def _load_file(file: _File, *, several: bool, progress: Progress) -> Scene:
    """One file with all its contents, doors and glass as modelled. several : messages name it to options."""
    path, options = file.path, file.options
    progress(ProgressEvent("load", 0, 0, f"reading {path.name}"))
    raw = _read(path, file.format, options, progress)
    _check_unit(path, raw, options)
    raw, left_out = (raw, []) if file.format == "ifc" else _without_room_volumes(raw, path.name)
    of_file = f"{path.name}=" if several else ""
    up_axis = options.up_axis or UpAxis(raw.up_axis or UpAxis.Z)
    scene = _built(file, raw, up_axis, progress)
    doubts = [*left_out]
    if options.metres_per_unit is None and raw.assumed_unit:
        doubts.append(raw.assumed_unit)
    size_doubts = _unit_doubts([scene])
    if not several:
        doubts += size_doubts
    is_up_taken = options.up_axis is not None
    if file.format in _ANY_UP_AXIS and extent_m(scene).max() <= MAX_LENGTH_M:
        progress(ProgressEvent("load", 0, 0, "comparing the ground with y up and z up"))
        axes = UpAxes(scene)
        doubt = up_axis_doubt(axes) if options.up_axis is None else None
        if doubt is not None:
            is_up_taken = True
            doubts.append(_up_axis_warning(path.name, raw, up_axis, doubt, of_file))
        if options.metres_per_unit is None and doubt is None and not size_doubts:
            doubts += _headroom_doubt(scene, axes.headroom_m(), of_file)
        if doubt is not None and doubt.is_certain:
            up_axis = UpAxis.Z if up_axis == UpAxis.Y else UpAxis.Y
            scene = _built(file, raw, up_axis, progress)
    if raw.assumed_up and not is_up_taken:
        doubts.append(raw.assumed_up)
    scene = replace(scene, georeference=_georeference(raw, options, up_axis))
    return _with_warnings(scene, doubts)


def _built(file: _File, raw: RawScene, up_axis: UpAxis, progress: Progress) -> Scene:
    """The scene of what a file holds, with its rooms."""
    path, options = file.path, file.options
    metres_per_unit = raw.metres_per_unit if options.metres_per_unit is None else options.metres_per_unit
    source = SceneSource(
        path=path,
        sha256=file.sha256,
        format=file.format,
        unit_name=_unit_name(raw, options),
        metres_per_unit=metres_per_unit,
        up_axis=up_axis,
        schema=raw.schema,
        glass=options.glass,
        doors=options.doors,
        doors_open=options.doors_open,
        doors_shut=options.doors_shut,
        leave_out=options.leave_out,
        given_metres_per_unit=options.metres_per_unit,
        given_up_axis=options.up_axis,
        skip_bad_faces=options.skip_bad_faces,
    )
    progress(ProgressEvent("load", 0, 0, "repairing"))
    vertex_unit_m = metres_per_unit
    if raw.vertex_unit_m is not None:
        vertex_unit_m = raw.vertex_unit_m * (metres_per_unit / raw.metres_per_unit)
    scene = scene_from_arrays(
        raw.vertices,
        raw.triangles,
        element_of_triangle=raw.element_of_triangle,
        elements=raw.elements,
        storeys=[replace(s, elevation_m=s.elevation_m * vertex_unit_m) for s in raw.storeys],
        source=source,
        metres_per_unit=vertex_unit_m,
        up_axis=up_axis,
        face_of_triangle=raw.face_of_triangle,
        optics_of_triangle=raw.optics_of_triangle,
        skip_bad_faces=options.skip_bad_faces,
        prior=raw.report,
    )
    return with_rooms(scene, raw.rooms, raw.storeys, metres_per_unit=vertex_unit_m, up_axis=up_axis)


def _without_room_volumes(raw: RawScene, name: str) -> tuple[RawScene, list[str]]:
    """Leave out the shapes of rooms, which converters of IFC keep under the name of the class, and a line on them.

    They bound spaces and are no surfaces: their tops would be floors, and their sides walls in front of the walls.
    They go before faces are repaired, so that no face is left out as the copy of a room's, and the scene is that of the
    file without them.
    """
    is_room = np.array([_ROOM_VOLUME in element.name.casefold() for element in raw.elements], dtype=np.bool_)
    gone = is_room[raw.element_of_triangle]
    if not gone.any():
        return raw, []
    found = [raw.elements[number].name for number in np.unique(raw.element_of_triangle[gone]).tolist()]
    if gone.all():
        raise SceneError(
            f"{name}: it has only volumes of rooms ({named_few(found)}), expected walls and slabs; export the "
            "building's elements, too."
        )
    noun = "a volume of a room is" if len(found) == 1 else f"{len(found)} volumes of rooms are"
    optics = raw.optics_of_triangle
    left = replace(
        raw,
        triangles=raw.triangles[~gone],
        element_of_triangle=(np.cumsum(~is_room) - 1)[raw.element_of_triangle[~gone]],
        face_of_triangle=raw.face_of_triangle[~gone],
        optics_of_triangle=None if optics is None else optics[~gone],
        elements=tuple(each for each, room in zip(raw.elements, is_room.tolist(), strict=True) if not room),
    )
    return left, [
        f"{name}: {noun} left out, since no beam ends there: {named_few(found)}; rename what is a real surface."
    ]


# ------------------------------------------------------------------------------------------------- file
def _check_file(path: Path) -> str:
    """Format of a readable file with a known extension."""
    known = ", ".join(FORMAT_OF_EXTENSION)
    try:
        if path.is_dir():
            raise SceneError(f"{path}: it is a folder, expected a scene file ({known}); name the file inside it.")
        if not path.exists():
            raise SceneNotFoundError(f"{path}: there is no such file; check the name and the folder.")
        file_format = FORMAT_OF_EXTENSION.get(path.suffix.lower())
        if path.suffix.lower() in DRAWINGS:
            raise SceneError(
                f"{path.name}: it is a drawing, expected a model; tlsplan plan raises it to an IFC file beside the "
                "plan, name that."
            )
        if path.suffix.lower() in POINT_CLOUDS:
            raise SceneError(
                f"{path.name}: it is a point cloud, which has no surfaces that stop beams, expected a model; make a "
                "mesh of it (as CloudCompare or MeshLab do) and save that as PLY, or plan with the building's IFC."
            )
        if file_format is None:
            raise SceneError(
                f"{path.name}: the extension {path.suffix or '(none)'} is not known, expected one of {known}; "
                "export the model in one of these formats."
            )
        if not path.is_file():  # opening a pipe waits for whoever writes into it, and a device may have no end
            raise SceneError(
                f"{path.name}: it is a pipe or a device, expected a file; save the scene to a file and name that."
            )
        with path.open("rb") as file:
            if not file.read(1):
                raise SceneError(f"{path.name}: the file is empty, expected a scene; copy or export it again.")
    except OSError as error:
        if isinstance(error, SceneNotFoundError):
            raise
        raise SceneNotFoundError(
            f"{path}: it can't be read ({error.strerror or error}); check its permissions."
        ) from error
    return file_format


def _check_unit(path: Path, raw: RawScene, options: LoadOptions) -> None:
    """Refuse a file whose unit is no length, unless the user names another and the reader did not use the file's."""
    is_length = math.isfinite(raw.metres_per_unit) and raw.metres_per_unit > 0
    if not is_length and (options.metres_per_unit is None or raw.vertex_unit_m is not None):
        raise SceneError(
            f"{path.name}: its unit is {raw.metres_per_unit:g} m long, expected more than 0; pass its unit, such as "
            "--units m, or export it again."
        )


def _read(path: Path, file_format: str, options: LoadOptions, progress: Progress) -> RawScene:
    """Run the format's reader; its module, and the library behind it, is imported only here."""
    if file_format in ("ifc", "usd") or (file_format == "gltf" and names_draco(path)):
        from planner_core.scene.isolated_readers import read_apart

        return read_apart(
            path,
            file_format,
            skip_bad_faces=options.skip_bad_faces,
            progress=progress,
            user_unit_m=options.metres_per_unit,
        )
    if file_format == "obj":
        from planner_core.scene.obj import read_obj

        return read_obj(path, skip_bad_faces=options.skip_bad_faces)
    if file_format == "ply":
        from planner_core.scene.ply import read_ply

        return read_ply(path, skip_bad_faces=options.skip_bad_faces)
    if file_format == "stl":
        from planner_core.scene.stl import read_stl

        return read_stl(path)
    from planner_core.scene.gltf import read_gltf

    return read_gltf(path, skip_bad_faces=options.skip_bad_faces)


def _with_glass(scene: Scene, glass: Glass) -> Scene:
    """The scene with the user's word on glass, and how much of it there is."""
    optics_before = scene.optics_of_triangle
    if optics_before is None:
        return scene
    a, b, c = (scene.vertices_m[scene.triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    area_m2 = 0.5 * lengths(cross)
    report = replace(
        scene.report,
        glass_area_m2=float(area_m2[optics_before == Optics.PASSES].sum()),
        mirror_area_m2=float(area_m2[optics_before == Optics.STOPS].sum()),
    )
    optics = np.where(optics_before == Optics.PASSES, np.uint8(_OPTICS_OF_GLASS[glass]), optics_before).astype(np.uint8)
    return replace(scene, report=report, optics_of_triangle=optics if optics.any() else None)


def _georeference(raw: RawScene, options: LoadOptions, up_axis: UpAxis) -> Georeference | None:
    """The file's georeference, for the scene in the user's unit; None for one that was turned over."""
    georeference = raw.georeference
    if georeference is None or up_axis != raw.up_axis:
        return None
    if options.metres_per_unit is None or options.metres_per_unit == raw.metres_per_unit:
        return georeference
    size = options.metres_per_unit / raw.metres_per_unit
    to_map, at_m = georeference.to_map, georeference.site_position_m
    return replace(
        georeference,
        to_map=None if to_map is None else tuple((x / size, y / size, z / size, w) for x, y, z, w in to_map),
        site_position_m=None if at_m is None else (at_m[0] * size, at_m[1] * size, at_m[2] * size),
    )


def _unit_name(raw: RawScene, options: LoadOptions) -> str:
    return raw.unit_name or "metre" if options.metres_per_unit is None else unit_name(options.metres_per_unit)


# ----------------------------------------------------------------------------------------------- doubts
_HIGHEST_ROOM_M, _ROOM_M = 50.0, 2.7
"""The highest naves and hangars are not as high; a room."""


def _headroom_doubt(scene: Scene, headroom_m: float, of_file: str) -> list[str]:
    """A warning where rooms are higher than any hall is built, and usual in another unit."""
    if headroom_m <= _HIGHEST_ROOM_M:
        return []
    source = scene.source
    heights = {unit: headroom_m / source.metres_per_unit * size_m for unit, size_m in UNITS_M.items()}
    unit = min(heights, key=lambda unit: abs(math.log(heights[unit] / _ROOM_M)))
    return [
        f"{source.path.name}, read in units of {source.metres_per_unit:g} m, has rooms {headroom_m:.0f} m high: if "
        f"that is wrong, pass its unit, such as --units {of_file}{unit}, in which they are {heights[unit]:.1f} m high."
    ]


def _up_axis_warning(name: str, raw: RawScene, read: UpAxis, doubt: UpAxisDoubt, of_file: str) -> str:
    """Which axis is taken as up, against what, and the option that undoes it."""
    read_up, other_up = read.lower(), "z" if read == UpAxis.Y else "y"
    stated = f"states {read_up} up" if raw.up_axis else "states no up axis"
    if raw.schema.startswith("glTF"):
        stated = "is y up by the rules of glTF"
    ground = (
        f"its largest ground in one piece is {doubt.read_m2:.0f} m2 with {read_up} up and {doubt.other_m2:.0f} m2 with "
        f"{other_up} up"
    )
    if doubt.is_certain:
        return (
            f"{name} {stated}, but {ground}: it is read with {other_up} up; if {read_up} is up, pass --up "
            f"{of_file}{read_up}."
        )
    return (
        f"{name} {stated} and is read with {read_up} up, but {ground}: if {other_up} is up, pass --up "
        f"{of_file}{other_up}."
    )


def _unit_doubts(scenes: Sequence[Scene]) -> list[str]:
    """A line on each file that is hardly a building by its size; files of one unit and kind share a line."""
    alike: dict[tuple[str, bool], list[tuple[str, float]]] = {}
    units_m: dict[str, float] = {}
    for scene in scenes:
        source, longest_m = scene.source, float(extent_m(scene).max())
        if source.given_metres_per_unit is None and not SHORTEST_M <= longest_m <= LONGEST_M:
            is_metre = source.metres_per_unit == 1.0
            read = f"in {source.unit_name}s" if is_metre else f"in units of {source.metres_per_unit:g} m"
            units_m[read] = source.metres_per_unit
            alike.setdefault((read, longest_m < SHORTEST_M), []).append((source.path.name, longest_m))
    lines = []
    for (read, is_short), files in alike.items():
        name, longest_m = files[0]
        length = f"only {longest_m:.3g} m" if is_short else f"{longest_m:.0f} m"
        of_file = f"{name}=" if len(scenes) > 1 else ""
        more = f", and {grouped(len(files) - 1)} more files are alike" if len(files) > 1 else ""
        unit = likely_unit(longest_m, units_m[read])
        remedy = f"if that is wrong, pass {'their' if more else 'its'} unit, such as --units {of_file}{unit}"
        if unit is None:
            remedy = f"in no other unit {'they are' if more else 'it is'} a building; check what it holds"
        lines.append(f"{name}, read {read}, is {length} long{more}: {remedy}.")
    return lines


def _with_warnings(scene: Scene, warnings: list[str]) -> Scene:
    if not warnings:
        return scene
    report: LoadReport = replace(scene.report, warnings=(*scene.report.warnings, *warnings))
    return replace(scene, report=report)

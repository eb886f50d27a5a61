"""Write plans in formats of others, with what all of them share: a free target, files that appear whole, a record.

PlanSource, names of formats, a target and `Options` -> `Written`.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from planner_core.coordinates.request import FrameRequest
from planner_core.errors import CrsNeededError, ExportError, PlannerError, RequirementError, is_of_full_disk
from planner_core.export.formats import ALL, Format, formats_named
from planner_core.export.geographic import geographic_of, needs_crs
from planner_core.export.options import Options
from planner_core.export.targets import (
    check_file,
    check_folder,
    check_is_no_source,
    size_of,
    target_guarded,
    write_record,
)
from planner_core.plan_folder.atomic import staged_file, staged_folder
from planner_core.plan_folder.plan_settings import ScenePaths
from planner_core.plan_folder.plan_source import PlanSource, open_plan
from planner_core.progress import Progress, ProgressEvent, silent

STAGE = "export"


@dataclass(frozen=True)
class Written:
    """What was written, and in which coordinates.

    remarks : doubts, one line each, for the user; notes : what is to be known of the coordinates. failed : of a pack,
    one line for each reason why formats could not be written, which begins with their names.
    """

    path: Path
    n_files: int
    n_bytes: int
    remarks: tuple[str, ...] = ()
    coordinates: str = ""
    notes: tuple[str, ...] = ()
    failed: tuple[str, ...] = ()


def check_export(
    names: Sequence[str], plan: PlanSource, target: Path, options: Options, *, is_pack: bool, overwrite: bool
) -> None:
    """Refuse what can be refused before minutes are spent: a target that is not free, degrees without a CRS.

    is_pack : whether `export_pack` follows, or `export_plan`. Raises as these.
    """
    chosen = formats_named(names)
    with target_guarded(plan, target):
        if is_pack or chosen[0].is_folder:
            check_folder(target, overwrite=overwrite)
        else:
            check_file(target, overwrite=overwrite)
    for each in chosen:
        if ALL not in names and needs_crs(each.name, options):
            geographic_of(plan.frame, each.name)


def export_plan(
    name: str,
    plan: Path | PlanSource,
    target: Path,
    options: Options = Options(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
    scene: ScenePaths = None,
    frame: FrameRequest | None = None,
    progress: Progress = silent,
) -> Written:
    """Write a plan in one format; it appears whole or not at all.

    Parameters
    ----------
    name
        Of `FORMATS`.
    plan
        The plan folder; or the plan, once opened, with `scene` and `frame` as given then.
    target
        The file or the folder to write; folders above are made.
    overwrite
        Replace a file, or a folder that was written here before.

    Raises
    ------
    OutputExistsError
        The target is there, and is not to be replaced.
    ExportError, PlanFolderError, CoordinatesError, SceneError
        What it is written from is not there or does not do; or the target can't be written.
    """
    (chosen,) = formats_named([name])
    opened = plan if isinstance(plan, PlanSource) else open_plan(plan, scene=scene, frame=frame)
    _check_scene(opened, (chosen,))
    with target_guarded(opened, target):
        if chosen.is_folder:
            check_folder(target, overwrite=overwrite)
            with staged_folder(target, replace=overwrite) as staging:
                remarks = _write(chosen, opened, staging, options, progress)
                write_record(opened, _names_of([chosen]), staging, _subtracted_m(opened, [chosen], options))
        else:
            check_file(target, overwrite=overwrite)
            check_is_no_source(opened.planned or opened, target)
            target.parent.mkdir(parents=True, exist_ok=True)
            with staged_file(target) as staging:
                remarks = _write(chosen, opened, staging, options, progress)
                check_file(target, overwrite=overwrite)  # minutes may have gone by
    return _written(opened if chosen.feet else in_metres(opened), target, remarks)


def export_pack(
    names: Sequence[str],
    plan: Path | PlanSource,
    target: Path,
    options: Options = Options(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
    scene: ScenePaths = None,
    frame: FrameRequest | None = None,
    progress: Progress = silent,
) -> Written:
    """Write a plan in several formats into one folder, each under its standard name; as `export_plan`.

    Of all formats, those that need a CRS are left out of a plan without one, those that need the scene file where it
    is not found, with remarks. What is named explicitly, or has a scene file given, is refused.
    A format that fails takes no other with it: `Written.failed` names it. Where all fail, the first error is raised.
    """
    chosen = formats_named(names)
    opened = plan if isinstance(plan, PlanSource) else open_plan(plan, scene=scene, frame=frame)
    chosen, left_out = _without_scene(opened, chosen, names)
    _check_scene(opened, chosen)
    held: list[Format] = []
    remarked: dict[str, list[str]] = {}
    failed: dict[str, list[str]] = {}
    first_error: PlannerError | None = None
    with target_guarded(opened, target):
        check_folder(target, overwrite=overwrite)
        with staged_folder(target, replace=overwrite) as staging:
            # Those without the scene take milliseconds: what they refuse is refused before the minutes of the others.
            for n_done, each in enumerate(sorted(chosen, key=lambda each: each.needs_scene)):
                progress(ProgressEvent(STAGE, n_done, len(chosen), each.name))
                path = staging / each.file_name
                if each.is_folder:
                    path.mkdir()
                try:
                    with target_guarded(opened, target):
                        remarks = _write(each, opened, path, options, progress)
                except PlannerError as error:
                    is_left_out = isinstance(error, CrsNeededError)
                    if is_left_out and ALL in names:
                        left_out.append(f"left out: {error}")
                    elif is_left_out or isinstance(error, RequirementError) or is_of_full_disk(error):
                        raise  # an option that is to be corrected, or the disk: the other formats do not help
                    else:
                        failed.setdefault(str(error), []).append(each.name)
                        first_error = first_error or error
                    _remove(path)
                    continue
                held.append(each)
                for remark in dict.fromkeys(remarks):
                    remarked.setdefault(remark, []).append(each.name)
            if first_error is not None and not held:
                raise first_error
            write_record(opened, _names_of(held), staging, _subtracted_m(opened, held, options))
    # What several formats remark, as on the way to longitude and latitude, is reported once.
    written = _written(opened, target, (*left_out, *_by_format(remarked)))
    return replace(written, failed=_by_format(failed))


def _by_format(remarked: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """One line for each remark, which begins with the names of its formats."""
    return tuple(f"{', '.join(names)}: {remark}" for remark, names in remarked.items())


def _remove(path: Path) -> None:
    """Remove what a format began to write."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _write(chosen: Format, plan: PlanSource, path: Path, options: Options, progress: Progress) -> tuple[str, ...]:
    """Write in the unit of the plan's site coordinates, or in metres where the format has no other.

    What is meant for other formats of a pack, such as coordinates that are reduced, does not reach this one.
    """
    options = options.only(chosen.options)
    if chosen.holds_review and plan.planned is not None:
        plan = plan.planned
    if chosen.feet or not plan.frame.unit.is_feet:
        return chosen.write(plan, path, options, progress)
    remarks = chosen.write(in_metres(plan), path, options, progress)
    return (*remarks, f"in metres, not in {plan.frame.unit.many}: the format has no other unit")


def in_metres(plan: PlanSource) -> PlanSource:
    """Return the plan with site coordinates that are written in metres."""
    return plan.once("in metres", lambda: replace(plan, frame=plan.frame.in_metres()))


def _written(plan: PlanSource, target: Path, remarks: Sequence[str]) -> Written:
    frame = plan.frame
    return Written(target, *size_of(target), (*frame.warnings, *remarks), frame.crs_line, frame.notes)


def _names_of(formats: Sequence[Format]) -> dict[str, str]:
    """Name -> what it is called in a folder."""
    return {each.name: each.file_name for each in formats}


def _subtracted_m(plan: PlanSource, formats: Sequence[Format], options: Options) -> dict[str, list[float]]:
    """File -> E, N, H taken off its coordinates, metres, of formats that take the option; none where nothing is."""
    if not any(options.subtract):
        return {}
    taken_off_m = [float(value) * plan.frame.unit.metres for value in options.subtract]
    return {each.file_name: taken_off_m for each in formats if "subtract" in each.options}


def _without_scene(
    plan: PlanSource, chosen: tuple[Format, ...], names: Sequence[str]
) -> tuple[tuple[Format, ...], list[str]]:
    """Return the formats that can be had, and remarks on those of `all` that need a scene file which is not found."""
    spare = [each for each in chosen if each.needs_scene and each.name not in names]
    if not spare or plan.given_scene:
        return chosen, []
    try:
        plan.scene_paths()
    except ExportError as error:
        remarks = [f"left out: {each.name}: {error}" for each in spare]
        return tuple(each for each in chosen if each not in spare), remarks
    return chosen, []


def _check_scene(plan: PlanSource, formats: Sequence[Format]) -> None:
    """Say at once that the scene is missing, before minutes of work."""
    if any(each.needs_scene for each in formats):
        plan.scene_paths()

"""The summary of a plan that `plan`, `demo` and `evaluate` print; all figures come from plan.json's document."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import output

if TYPE_CHECKING:
    from planner_core.model import IndependentCheck, Plan


#: Less area is nothing to tell of.
_SHOWN_M2 = 0.5


def show(document: dict[str, Any]) -> None:
    """Print the figures of a plan.json document, each with what it is a figure of."""
    from planner_core.coverage.percent import reached_percent
    from planner_core.plan_folder import plan_words as words

    _say("scanner", f"{words.scanner_words(document)}, {words.beams_words(document)}")
    _say("stations", f"{len(document['stations'])}{words.bound_words(document['optimality'])}")
    _say("coverage", words.coverage_words(document))
    if as_set_up := words.set_up_words(document):
        _say("", as_set_up)
    _say("", words.total_words(document))
    for line in words.left_out_lines(document):
        output.alarm(_plain(f"{'':<14}{line}"))
    for line in _scope(document["scope"]):
        output.say(line)
    scene = document["scene"]
    for line in output.materials(scene["glass_area_m2"], scene["mirror_area_m2"], glass=scene["glass"]):
        output.say(line)
    if scene["n_doors_open"]:
        _say("doors", _doors(scene))
    names = {floor["id"]: floor["name"] for floor in document["floors"]}
    for floor in words.planned_floors(document):
        n_stations = sum(station["floor"] == floor for station in document["stations"])
        percent, sign, of_area = words.floor_words(document, floor).partition(" % ")
        seen = f"{percent:>5}{sign}{of_area}" if sign else percent
        output.say(_plain(f"  {floor:<4} {names[floor]:<22} {n_stations:>3} stations  {seen}"))
    for result in document["requirements"]["results"]:
        if not result["met"]:
            reached = reached_percent(result["fraction_of_achievable"], result["required"])
            _say("NOT MET", f"{result['name']}: {reached} %, {100 * result['required']:g} % are required")
    _say("registration", words.registration_words(document))
    if document["route"] is not None:
        _say("route", words.route_words(document["route"]))
    if document["field_time"] is not None:
        _say("field time", words.time_words(document["field_time"], document["route"]))


def _say(name: str, words: str) -> None:
    output.say(_plain(f"{name:<14}{words}"))


def _plain(words: str) -> str:
    """Square metres as every terminal shows them."""
    return words.replace("m²", "m2")


def _doors(scene: dict[str, Any]) -> str:
    """Say how many doors are open, and which option closes them: with `--join outside` it is not --doors."""
    is_open = f"{scene['n_doors_open']} {'door is' if scene['n_doors_open'] == 1 else 'doors are'} open"
    if scene["doors"] == "outside":
        return (
            f"{is_open}, exterior ones too, for stations outdoors "
            "(--join inside, the default, keeps exterior doors closed)"
        )
    return f"{is_open} (--doors closed leaves them as modelled)"


def _scope(scope: dict[str, Any]) -> list[str]:
    """Return lines on what counts, and what does not."""
    lines = []
    if scope["kind"] != "all":
        lines.append(
            f"scope         {scope['kind']}: {scope['in_scope_area_m2']:.0f} m2 of the model; "
            f"{scope['out_of_scope_area_m2']:.0f} m2 are out of scope (--scope all plans them too)"
        )
    lines += [
        f"not covered   {obstacle['name']}: {obstacle['area_m2']:.0f} m2, obstacles only"
        for obstacle in scope["obstacles"]
        if obstacle["area_m2"] >= _SHOWN_M2
    ]
    lines += [f"left out      {each['name']}: {each['area_m2']:.0f} m2" for each in scope["left_out"]]
    return lines


def finish(plan: Plan, folder: Path | None, *, check_in_full: bool, as_json: bool, quiet: bool) -> None:
    """Print what a plan is worth: plan.json's document, or the summary and where the folder is, or nothing.

    check_in_full : all figures of the independent check, not its share of coverage alone.
    """
    from planner_core.plan_folder.plan_json import plan_document

    document = plan_document(plan, folder)
    if as_json:
        output.as_json(document)
    elif not quiet:
        show(document)
        if plan.independent_check is not None:
            _show_check(plan.independent_check, in_full=check_in_full)
        if folder is not None:
            where_to_look(folder)


def _show_check(check: IndependentCheck, *, in_full: bool) -> None:
    """Print the check's figures beside the plan's, and the link that differs most; or its share alone."""
    if not in_full:
        share = check.share
        output.say(
            f"judge         {100 * share.judged:.1f} % +- {100 * share.error:.1f} by {check.n_points} random points"
        )
        return
    output.say(f"judge         {check.n_points} random points, cast by {check.engine}")
    for name, figure in (("covered", check.covered_m2), ("scannable", check.achievable_m2)):
        off = f", {100 * (figure.planned / figure.judged - 1):+.1f} %" if figure.judged else ""
        output.say(f"  {name:<11} {figure.judged:.1f} m2 +- {figure.error:.1f}, the plan has {figure.planned:.1f}{off}")
    lines = [("share", check.share)]
    if check.links:
        worst = max(check.links, key=lambda link: abs(link.overlap.planned - link.overlap.judged))
        lines.append((f"overlap of {worst.a} and {worst.b}, which differs most:", worst.overlap))
    for name, figure in lines:
        output.say(
            f"  {name:<11} {100 * figure.judged:.2f} % +- {100 * figure.error:.2f}, the plan has "
            f"{100 * figure.planned:.2f} %"
        )


def where_to_look(folder: Path) -> None:
    """Print what to open next."""
    output.say()
    output.say(f"plan folder   {folder}")
    output.say(f"view          {_command()} view {_argument(str(folder))}")
    output.say(f"print         {folder / 'report' / 'index.html'}")


def _command() -> str:
    """Return how this user calls the command: its name where the shell finds it, else its path."""
    called = Path(sys.argv[0])
    if called.name != "tlsplan":
        return "tlsplan"
    found = shutil.which("tlsplan")
    return "tlsplan" if found and Path(found).resolve() == called.resolve() else _argument(os.path.relpath(called))


def _argument(path: str) -> str:
    """Return a path as the shell takes it for one argument, and no option."""
    path = f".{os.sep}{path}" if path.startswith("-") else path
    return subprocess.list2cmdline([path]) if os.name == "nt" else shlex.quote(path)

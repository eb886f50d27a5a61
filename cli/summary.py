"""The summary of a plan that `plan`, `demo` and `evaluate` print; all figures come from plan.json's document."""

from __future__ import annotations

import math
import os
import shlex
import shutil
import subprocess
import sys
from decimal import ROUND_CEILING, Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import output

if TYPE_CHECKING:
    from planner_core.model import IndependentCheck, Plan


#: Less area is nothing to tell of.
_SHOWN_M2 = 0.5


def show(document: dict[str, Any]) -> None:
    """Print the figures of a plan.json document, each with what it is a figure of."""
    from planner_core.coverage.percent import not_planned, reached_percent

    coverage, asks = document["coverage"], document["requirements"]
    scanner = document["scanner"]
    optimality = document["optimality"]
    floors = {floor["id"]: floor["name"] for floor in document["floors"]}
    output.say(f"scanner       {scanner['title']}, range {scanner['range_max_m']:g} m{_scan_mode(document)}")
    output.say(f"stations      {len(document['stations'])}{_bound(optimality)}")
    output.say(
        f"coverage      {reached_percent(coverage['fraction_of_achievable'], asks['coverage'])} % of the "
        f"{coverage['achievable_area_m2']:.0f} m2 scannable from valid tripod positions"
    )
    output.say(
        f"              {100 * coverage['fraction_of_total']:.1f} % of all {coverage['total_area_m2']:.0f} m2 "
        f"{_of_what(document['scope'])}"
    )
    for line in not_planned(
        sealed_m2=[room["area_m2"] for room in document["sealed"]],
        scope=document["scope"]["kind"],
        achievable_m2=coverage["achievable_area_m2"],
        total_m2=coverage["total_area_m2"],
        area_by_reason_m2=(document.get("why") or {}).get("area_by_reason_m2", {}),
    ):
        output.alarm(f"              {line}")
    for line in _scope(document["scope"]):
        output.say(line)
    scene = document["scene"]
    for line in output.materials(scene["glass_area_m2"], scene["mirror_area_m2"], glass=scene["glass"]):
        output.say(line)
    if scene["n_doors_open"]:
        doors = "door is" if scene["n_doors_open"] == 1 else "doors are"
        output.say(f"doors         {scene['n_doors_open']} {doors} open (--doors closed leaves them as modelled)")
    wanted = {name.casefold() for name in asks["floors"]}
    planned = [
        figures
        for figures in coverage["floors"]
        if not wanted or wanted & {figures["floor"].casefold(), floors[figures["floor"]].casefold()}
    ]
    of_floors = asks["results"][: len(planned)]  # requirements of the planned floors come first
    for figures, result in zip(planned, of_floors, strict=True):
        n_stations = sum(station["floor"] == figures["floor"] for station in document["stations"])
        seen = "nothing scannable"
        if figures["achievable_area_m2"] > 0:
            reached = reached_percent(figures["fraction_of_achievable"], result["required"])
            seen = f"{reached:>5} % of {figures['achievable_area_m2']:.0f} m2"
        output.say(f"  {figures['floor']:<4} {floors[figures['floor']]:<22} {n_stations:>3} stations  {seen}")
    for result in asks["results"]:
        if not result["met"]:
            output.say(
                f"NOT MET       {result['name']}: "
                f"{reached_percent(result['fraction_of_achievable'], result['required'])} %, "
                f"{100 * result['required']:g} % are required"
            )
    output.say(f"registration  {_registration(document)}")
    for line in _field(document):
        output.say(line)


def _of_what(scope: dict[str, Any]) -> str:
    if scope["kind"] == "all":
        return "in the model, including what no position sees, such as the inside of walls"
    return "in scope"


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


def _registration(document: dict[str, Any]) -> str:
    """Return how the stations hang together, in a line."""
    from planner_core.network.network_report import margin_of
    from planner_core.network.weak_motion import overlap_percent
    from planner_core.requirements.wording import overlap_noun

    registration, asks = document["registration"], document["requirements"]
    overlap = overlap_noun(asks["overlap_measure"], asks["overlap_of"])
    least = registration["min_strength"]
    counted = [
        link
        for link in registration["links"]
        if link.get("as_set_up")
        or (link["overlap"] >= registration["threshold"] and (link["strength"] is None or link["strength"] >= least))
    ]
    links = "link" if len(counted) == 1 else "links"
    n_networks = len(registration["networks"])
    state = "all stations are connected" if n_networks <= 1 else f"{n_networks} unconnected groups"

    def margin(link: dict[str, Any]) -> tuple[float, float]:
        strength = math.nan if link["strength"] is None else link["strength"]
        return margin_of(link["overlap"], strength, registration["threshold"], least), link["overlap"]

    needed = [network["bottleneck"] for network in registration["networks"] if network["bottleneck"] is not None]
    weakest = min(needed, key=margin, default=None)
    hangs = ""
    if weakest is not None:
        hangs = f"; weakest: {weakest['a']} to {weakest['b']}, {overlap_percent(weakest['overlap'])} %"
        if weakest["strength"] is not None:
            hangs += f", strength {weakest['strength']:.3f}"
    low = ", or as set up" if any(link.get("as_set_up") for link in counted) else ""
    return f"{len(counted)} {links} of at least {100 * registration['threshold']:g} % {overlap}{low}; {state}{hangs}"


def _field(document: dict[str, Any]) -> list[str]:
    """Return lines on the day in the field."""
    route, time = document["route"], document["field_time"]
    lines = [] if route is None else [f"route         {route['length_m']:.0f} m"]
    if time is not None and time["total_s"] is not None:
        lines.append(f"field time    {_hours(time['total_s'])}, {_hours(time['scanning_s'])} of it scanning")
    return lines


def _hours(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60:02d} min" if minutes >= 60 else f"{minutes} min"


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
        off = f", {100 * (figure.told / figure.judged - 1):+.1f} %" if figure.judged else ""
        output.say(f"  {name:<11} {figure.judged:.1f} m2 +- {figure.error:.1f}, the plan says {figure.told:.1f}{off}")
    lines = [("share", check.share)]
    if check.links:
        worst = max(check.links, key=lambda link: abs(link.overlap.told - link.overlap.judged))
        lines.append((f"overlap of {worst.a} and {worst.b}, which differs most:", worst.overlap))
    for name, figure in lines:
        output.say(
            f"  {name:<11} {100 * figure.judged:.2f} % +- {100 * figure.error:.2f}, the plan says "
            f"{100 * figure.told:.2f} %"
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


def _scan_mode(document: dict[str, Any]) -> str:
    n_beams = document["scanner"]["n_azimuths"] * document["scanner"]["n_channels"]
    if document["settings"]["scan_mode"] == "patches":
        return f", patches sampled instead of {n_beams:,} beams per scan"
    return f", {n_beams:,} beams per scan"


def _percent_upwards(share: float) -> Decimal:
    """Return a bound from above in percent, to one digit and never lower; exact, as 100 * share is not."""
    return (100 * Decimal(str(share))).quantize(Decimal("0.1"), ROUND_CEILING)


def _bound(optimality: dict[str, Any]) -> str:
    """Return what is known of how good the number of stations is."""
    if optimality["objective"] == "most coverage":
        return f", no plan with so many covers more than {_percent_upwards(optimality['bound'])} %"
    bound = optimality["lower_bound"]
    if bound is None:
        return ""
    stopped = {"interrupted": "; interrupted", "time limit": "; time limit reached"}.get(optimality["why_stopped"], "")
    if bound > optimality["stations"]:
        return f", below the lower bound {bound} on the candidates of the grid{stopped}"
    if bound == optimality["stations"]:
        return ", proven to be the fewest on these candidates"
    return f" (lower bound {bound} on these candidates{stopped})"

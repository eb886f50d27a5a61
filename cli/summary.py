"""The summary of a plan that `plan`, `demo` and `evaluate` print; all figures come from plan.json's document."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import output

if TYPE_CHECKING:
    from planner_core.model import Plan


def show(document: dict[str, Any]) -> None:
    """Print the figures of a plan.json document, each with what it is a figure of."""
    coverage = document["coverage"]
    scanner = document["scanner"]
    optimality = document["optimality"]
    registration = document["registration"]
    floors = {floor["id"]: floor["name"] for floor in document["floors"]}
    output.say(f"scanner       {scanner['title']}, range {scanner['range_max_m']:g} m{_scan_mode(document)}")
    output.say(f"stations      {len(document['stations'])}{_bound(optimality)}")
    output.say(
        f"coverage      {100 * coverage['fraction_of_achievable']:.1f} % of the "
        f"{coverage['achievable_area_m2']:.0f} m2 that this scanner can see from admissible positions"
    )
    output.say(
        f"              {100 * coverage['fraction_of_total']:.1f} % of all {coverage['total_area_m2']:.0f} m2 in "
        "the model, which counts what nobody can see, such as the inside of walls"
    )
    scene = document["scene"]
    for line in output.materials(scene["glass_area_m2"], scene["mirror_area_m2"], glass=scene["glass"]):
        output.say(line)
    asked = {name.casefold() for name in document["requirements"]["floors"]}
    for figures in coverage["floors"]:
        if asked and not asked & {figures["floor"].casefold(), floors[figures["floor"]].casefold()}:
            continue
        n_stations = sum(station["floor"] == figures["floor"] for station in document["stations"])
        output.say(
            f"  {figures['floor']:<4} {floors[figures['floor']]:<22} {n_stations:>3} stations  "
            f"{100 * figures['fraction_of_achievable']:5.1f} % of {figures['achievable_area_m2']:.0f} m2"
        )
    n_linked = sum(link["overlap"] >= registration["threshold"] for link in registration["links"])
    state = "all stations are connected" if registration["connected"] else "NOT all stations are connected"
    links = "link" if n_linked == 1 else "links"
    output.say(
        f"registration  {n_linked} {links} with at least {100 * registration['threshold']:.0f} % overlap; {state}"
    )


def finish(plan: Plan, folder: Path | None, *, as_json: bool, quiet: bool) -> None:
    """Print what a plan is worth: plan.json's document, or the summary and where the folder is, or nothing."""
    from planner_core.export.plan_json import plan_document

    document = plan_document(plan)
    if as_json:
        output.as_json(document)
    elif not quiet:
        show(document)
        if folder is not None:
            where_to_look(folder)


def where_to_look(folder: Path) -> None:
    """Print what to open next."""
    output.say()
    output.say(f"plan folder   {folder}")
    output.say(f"look          {_command()} view {folder}")
    output.say(f"print         {folder / 'report' / 'index.html'}")


def _command() -> str:
    """Return how this user calls the command: its name where the shell finds it, else its path."""
    called = Path(sys.argv[0])
    if called.name != "tlsplan":
        return "tlsplan"
    found = shutil.which("tlsplan")
    return "tlsplan" if found and Path(found).resolve() == called.resolve() else os.path.relpath(called)


def _scan_mode(document: dict[str, Any]) -> str:
    n_beams = document["scanner"]["n_azimuths"] * document["scanner"]["n_channels"]
    if document["settings"]["scan_mode"] == "patches":
        return f", patches sampled instead of {n_beams:,} beams a scan"
    return f", {n_beams:,} beams a scan"


def _bound(optimality: dict[str, Any]) -> str:
    bound = optimality["lower_bound"]
    if bound is None:
        return ""
    if optimality["proven"]:
        return ", proven to be the fewest possible on these candidates"
    return f" (at least {bound} are needed on these candidates)"

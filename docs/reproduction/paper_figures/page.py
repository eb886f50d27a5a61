"""Pages of the reproduction: a Markdown page a figure, its numbers as JSON, and an index."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from .figure import Figure, Outcome

_VERDICT = {
    "yes": "It agrees.",
    "partly": "It agrees in part.",
    "no": "It does not agree.",
    "not comparable": "Not comparable at this size.",
    "not tested": "Not tested.",
}


def write_page(folder: Path, figure: Figure, outcome: Outcome, *, full: bool, seed: int) -> Path:
    """Write `<name>.md` and `<name>.json` beside the pictures; returns the page."""
    command = f"tlsplan reproduce {figure.name} --full" + (f" --seed {seed}" if seed else "")
    size = "" if full else f"\n\nThis run is smaller than the paper's: {figure.small_size}. In full: `{command}`."
    pictures = "\n\n".join(f"![{picture.shows}]({picture.file})" for picture in outcome.pictures)
    page = folder / f"{figure.name}.md"
    text = (
        f"# {figure.title}\n\n{pictures}\n\n**The paper found:** {figure.paper_found}\n\n"
        f"**We found:** {outcome.found}\n\n**{_VERDICT[outcome.agrees]}**{size}\n"
    )
    page.write_text(text, encoding="utf-8")
    numbers = {
        "figure": figure.name,
        "full": full,
        "seed": seed,
        "fingerprint": figure.fingerprint(full=full, seed=seed),
        "agrees": outcome.agrees,
        **outcome.numbers,
    }
    (folder / f"{figure.name}.json").write_text(json.dumps(numbers, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return page


def is_current(folder: Path, figure: Figure, *, full: bool, seed: int) -> bool:
    """Whether the folder has the figure's page, of a run with the same settings."""
    numbers = folder / f"{figure.name}.json"
    if not (numbers.exists() and (folder / f"{figure.name}.md").exists()):
        return False
    had = json.loads(numbers.read_text(encoding="utf-8")).get("fingerprint")
    return bool(had == figure.fingerprint(full=full, seed=seed))


def write_index(folder: Path, figures: Sequence[Figure]) -> Path:
    """Write `index.md` over the pages that lie in the folder; each verdict is read from its numbers."""
    lines = ["| figure | what it is about | agrees |", "|---|---|---|"]
    for figure in figures:
        numbers = folder / f"{figure.name}.json"
        if numbers.exists():
            agrees = json.loads(numbers.read_text(encoding="utf-8"))["agrees"]
            lines.append(f"| [{figure.name}]({figure.name}.md) | {figure.title} | {agrees} |")
    page = folder / "index.md"
    page.write_text(
        "# The paper, reproduced\n\n"
        "López et al. (2023), *Metaheuristics for the optimization of Terrestrial LiDAR set-up*, found what its "
        "figures show in three buildings that can't be had. These are the counterparts in our synthetic buildings; "
        "each page is written by `tlsplan reproduce`, and the numbers beside it are those of its sentences.\n\n"
        + "\n".join(lines)
        + "\n",
        encoding="utf-8",
    )
    return page

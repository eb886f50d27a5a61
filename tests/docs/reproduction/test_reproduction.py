"""The reproduction of the paper's figures: the command, the pages, and that every figure keeps its word."""

import json
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from paper_figures import fig16
from paper_figures import figures as registry
from paper_figures.figure import Bench, Figure, Outcome, Picture
from paper_figures.page import write_index, write_page
from tlsplan.commands import reproduce
from tlsplan.group import cli

from planner_core.device import Device
from planner_core.errors import DeviceError, OutputExistsError, RequirementError
from planner_core.model import Visibility
from planner_core.paper.genetic import search as genetic_search
from planner_core.select.problem import Constraint, cover_problem


def drawn(bench: Bench) -> Outcome:
    (bench.folder / "a.png").write_bytes(b"picture")
    return Outcome("we saw 3 of 4.", "partly", (Picture("a.png", "three"),), {"share": 0.75})


FIGURE = Figure("figA", "A title", "four of four.", drawn, "half the size")


def call(*arguments: str) -> object:
    return CliRunner().invoke(cli, ["reproduce", *arguments], standalone_mode=False, catch_exceptions=False)


def test_page_says_what_both_found_and_how_to_run_it_in_full(tmp_path: Path) -> None:
    outcome = drawn(Bench(tmp_path))
    text = write_page(tmp_path, FIGURE, outcome, full=False, seed=2).read_text()
    for part in ("# A title", "![three](a.png)", "four of four.", "we saw 3 of 4.", "It agrees in part.", "half the"):
        assert part in text
    assert "`tlsplan reproduce figA --full --seed 2`" in text
    assert "--full" not in write_page(tmp_path, FIGURE, outcome, full=True, seed=0).read_text()
    numbers = json.loads((tmp_path / "figA.json").read_text())
    assert len(numbers.pop("fingerprint")) == 16
    assert numbers == {"figure": "figA", "full": True, "seed": 0, "agrees": "partly", "share": 0.75}


def test_index_lists_the_pages_that_are_there(tmp_path: Path) -> None:
    other = Figure("figB", "Another", "", drawn, "")
    write_page(tmp_path, FIGURE, drawn(Bench(tmp_path)), full=True, seed=0)
    text = write_index(tmp_path, (FIGURE, other)).read_text()
    assert "| [figA](figA.md) | A title | partly |" in text
    assert "figB" not in text


def test_an_unknown_figure_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(RequirementError, match=r"^figure 'fig99' is not known; expected all or one of .*eq9"):
        call("fig99", "-o", str(tmp_path))


def test_a_page_that_exists_is_kept_without_overwrite(tmp_path: Path) -> None:
    (tmp_path / "eq9.md").write_text("mine")
    with pytest.raises(OutputExistsError, match="pass --overwrite"):
        call("eq9", "-o", str(tmp_path))
    assert (tmp_path / "eq9.md").read_text() == "mine"


def test_a_figure_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(bench: Bench) -> Outcome:
        (bench.folder / "half.png").write_bytes(b"half")
        raise RequirementError("no")

    monkeypatch.setattr(registry, "FIGURES", (Figure("figA", "", "", fails, ""),))
    with pytest.raises(RequirementError, match="no"):
        call("figA", "-o", str(tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_names_of_figures_are_those_of_the_paper() -> None:
    names = [figure.name for figure in registry.FIGURES]
    assert len(names) == len(set(names))
    for figure in registry.FIGURES:
        assert figure.title and figure.paper_found.endswith(".") and figure.small_size
    assert reproduce.command.name == "reproduce"


@pytest.mark.slow
def test_equation_9_selects_a_single_station(tmp_path: Path) -> None:
    outcome = next(figure for figure in registry.FIGURES if figure.name == "eq9").run(Bench(tmp_path))
    assert set(outcome.numbers["stations_by_seed"]) == {1}
    assert max(outcome.numbers["ratio_to_best_single"]) <= 1.0
    assert all((tmp_path / picture.file).stat().st_size > 1000 for picture in outcome.pictures)


def test_resuming_runs_only_what_is_missing_or_of_other_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[str] = []

    def counted(name: str, size: str = "half", revision: int = 1) -> Figure:
        def run(bench: Bench) -> Outcome:
            ran.append(name)
            if name == "figB" and ran.count("figB") == 1:
                raise KeyboardInterrupt
            return drawn(bench)

        return Figure(name, "A title", "", run, size, revision=revision)

    monkeypatch.setattr(registry, "FIGURES", (counted("figA"), counted("figB")))
    with pytest.raises(click.Abort):
        call("all", "-o", str(tmp_path), "--resume")
    assert "[figA]" in (tmp_path / "index.md").read_text()
    call("all", "-o", str(tmp_path), "--resume")
    assert ran == ["figA", "figB", "figB"]
    call("all", "-o", str(tmp_path), "--resume")
    assert ran == ["figA", "figB", "figB"]
    call("figA", "-o", str(tmp_path), "--resume", "--seed", "1")
    monkeypatch.setattr(registry, "FIGURES", (counted("figA", size="a third"), counted("figB", revision=2)))
    call("all", "-o", str(tmp_path), "--resume", "--seed", "1")
    assert ran[3:] == ["figA", "figA", "figB"]
    (tmp_path / "figA.md").unlink()
    call("all", "-o", str(tmp_path), "--resume", "--seed", "1")
    assert ran[6:] == ["figA"]


def test_a_warning_is_said_once_a_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def warned(bench: Bench) -> Outcome:
        bench.warn(["no device"])
        bench.warn(["no device", "nor anything else"])
        return Outcome("nothing.", "not tested", ())

    names = ("figA", "figB")
    monkeypatch.setattr(registry, "FIGURES", tuple(Figure(name, "A title", "", warned, "") for name in names))
    done = call("all", "-o", str(tmp_path), "-q")
    assert done.stderr.splitlines() == ["warning: no device", "warning: nor anything else"]
    assert "**Not tested.**" in (tmp_path / "figB.md").read_text()


@pytest.mark.slow
def test_fig16_without_a_device_times_the_host_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_device(name: str | None = None) -> Device:
        raise DeviceError("there is none")

    rng = np.random.default_rng(1)
    sees = rng.random((20, 50)) < 0.2
    starts = np.concatenate([[0], np.cumsum(sees.sum(axis=1))]).astype(np.int64)
    visibility = Visibility(starts, np.nonzero(sees)[1].astype(np.int32), 50)
    problem = cover_problem(visibility, np.full(50, 0.04), (Constraint(np.ones(50, dtype=bool), 0.9),))
    monkeypatch.setattr(fig16, "_problem", lambda bench: problem)
    monkeypatch.setattr(fig16, "_REPEATS", 1)
    monkeypatch.setattr(genetic_search, "open_device", no_device)
    outcome = fig16.run(Bench(tmp_path))
    assert outcome.agrees == "not tested"
    assert outcome.found.startswith("no OpenCL device is usable")
    assert [picture.file for picture in outcome.pictures] == ["fig16.png"]

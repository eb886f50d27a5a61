"""Small scenes through the commands `scene` and `plan`, in this process; `make plan-scenes` plans all of them."""

import json
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import small_pictures
from tlsplan.main import main

import scenes_synthetic

pytestmark = pytest.mark.slow

COARSE = (
    "--grid",
    "1",
    "--height",
    "1.2",
    "--patch-area",
    "0.2",
    "--coverage",
    "80",
    "--json",
    "--set",
    "work_limit=0.2",
    "--no-refine",
)


@pytest.fixture
def tlsplan(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Callable[..., tuple[Any, str, str]]]:
    """Run the command line: exit code, standard output, standard error."""

    def run(*arguments: str | Path) -> tuple[Any, str, str]:
        monkeypatch.setattr(sys, "argv", ["tlsplan", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code, *capsys.readouterr()

    small_pictures.draw_small(monkeypatch)
    before = signal.getsignal(signal.SIGINT)  # `main` sets its own
    with warnings.catch_warnings():
        yield run
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    ("name", "file", "options"),
    [
        ("two-rooms", "rooms.glb", ()),
        ("closed-rooms", "rooms.usdc", ()),
        ("broken-faces", "rooms.obj", ("--skip-bad-faces",)),
        ("without-slabs", "rooms.stl", ()),
    ],
)
def test_scene_is_written_and_planned(
    tlsplan: Callable[..., tuple[Any, str, str]], tmp_path: Path, name: str, file: str, options: tuple[str, ...]
) -> None:
    path, folder = tmp_path / file, tmp_path / "plan"
    assert tlsplan("scene", name, "-o", path) == (0, f"wrote {path}\n", "")
    code, out, err = tlsplan("plan", path, "-o", folder, *COARSE, *options)
    assert code == 0, err
    document = json.loads(out)
    truth = scenes_synthetic.build(name).truth
    assert document == json.loads((folder / "plan.json").read_text())
    assert document["coverage"]["fraction_of_achievable"] >= 0.8
    assert (
        1 <= document["optimality"]["lower_bound"] <= len(document["stations"]) <= document["settings"]["n_candidates"]
    )
    repairs = document["scene"]["repairs"]
    wanted = {"duplicate": truth.n_duplicate, "degenerate": truth.n_degenerate}
    if options:
        wanted |= {"non_finite": truth.n_non_finite, "bad_index": truth.n_bad_index}
        assert min(wanted.values()) > 0
    assert {kind: repairs[kind] for kind in wanted} == wanted


@pytest.mark.parametrize(
    ("name", "file", "options", "code", "said"),
    [
        ("broken-faces", "rooms.ply", (), 3, "Repair it or pass --skip-bad-faces."),
        ("box", "rooms.glb", ("--height", "30"), 4, "give a lower instrument height (--height)"),
    ],
)
def test_scene_that_cannot_be_planned_is_refused_in_one_line(
    tlsplan: Callable[..., tuple[Any, str, str]],
    tmp_path: Path,
    name: str,
    file: str,
    options: tuple[str, ...],
    code: int,
    said: str,
) -> None:
    path, folder = tmp_path / file, tmp_path / "plan"
    assert tlsplan("scene", name, "-o", path)[0] == 0
    ended, out, err = tlsplan("plan", path, "-o", folder, *(COARSE if not options else ("--json", *options)))
    assert (ended, out) == (code, "")
    lines = err.splitlines()
    assert lines[-1].startswith("tlsplan: ")
    assert said in lines[-1]
    assert not folder.exists()

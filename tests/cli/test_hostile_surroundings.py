"""Names, locales, homes and pipes that are not as expected, and texts that command terminals: one clear line each."""

import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tlsplan import environment
from tlsplan.output import as_json, say, table
from tlsplan.progress import ProgressReporter
from tlsplan.summary import where_to_look

import scenes_synthetic
from planner_core.errors import LONGEST_LINE, PlannerError, SceneError, SceneNotFoundError, escaped, one_line
from planner_core.progress import ProgressEvent

CLEAR_SCREEN = "\x1b[2J\x9b31m\x07\u202e"
NO_UTF8 = os.fsdecode(b"b\xff\xe9.obj")


def run(*arguments: str | Path, cwd: Path | None = None, **variables: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-m", "tlsplan", *map(str, arguments)],
        capture_output=True, timeout=240, cwd=cwd, env={**os.environ, **variables},
    )  # fmt: skip


@pytest.fixture
def box(tmp_path: Path) -> Path:
    return scenes_synthetic.write(scenes_synthetic.build("box"), tmp_path / "box.obj")


# ------------------------------------------------------------------------------------------------------------ words
@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain, größe 5 m², 日本", "plain, größe 5 m², 日本"),
        (CLEAR_SCREEN, r"\x1b[2J\x9b31m\x07\u202e"),
        (NO_UTF8, r"b\xff\xe9.obj"),
        ("no character: \U0008375b \ufaff \ue000", r"no character: \U0008375b \ufaff \ue000"),
        ("a\u200cb\u00a0c\u200bd", "a\u200cb c" + r"\u200bd"),
        ("half \ud800", r"half \ud800"),
        ("a\r\n\tb\x00", r"a b\x00"),
    ],
)
def test_messages_quote_what_is_no_text_as_codes(text: str, shown: str) -> None:
    assert one_line(text) == shown
    for error in (PlannerError, SceneError, SceneNotFoundError):
        assert str(error(text)) == shown
    shown.encode()


def test_long_messages_lose_their_middle_and_keep_the_remedy() -> None:
    line = str(SceneError("file.ifc: got " + "x" * 100_000 + ", expected less; shorten it"))
    assert len(line) == LONGEST_LINE
    assert line.startswith("file.ifc: got xxx")
    assert line.endswith("xxx, expected less; shorten it")


def test_everything_that_is_printed_is_fit_for_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    say(CLEAR_SCREEN)
    table(("id", "name"), [("F0", f"two\nlines{CLEAR_SCREEN}{NO_UTF8}")])
    as_json({"name": CLEAR_SCREEN + NO_UTF8})
    with ProgressReporter(quiet=False, stream=sys.stderr) as reporter:
        reporter.warn([CLEAR_SCREEN])
        reporter.show(ProgressEvent("load", 1, 1, CLEAR_SCREEN + NO_UTF8))
    printed = "".join(capsys.readouterr())
    assert printed.count(r"[2J") == 5
    assert escaped(printed) == printed
    assert printed.count("\n") == 8  # one, two of the table, three of the document, two of progress


def test_json_with_codes_is_read_as_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    import json

    name = CLEAR_SCREEN + NO_UTF8 + "\U0008375b"
    as_json({"name": name})
    assert json.loads(capsys.readouterr().out) == {"name": name}


@pytest.mark.parametrize(
    "folder",
    ["plan", "my plan", "plans/second floor/plan", "it's", "a;b", "$HOME", "plan (2)", "ä plan", "-x", "-my plan"],
)
def test_the_view_command_that_is_printed_names_the_folder_in_any_shell(
    folder: str, capsys: pytest.CaptureFixture[str]
) -> None:
    where_to_look(Path(folder))
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("view ")]
    *_, view, path = shlex.split(line)
    assert (view, Path(path)) == ("view", Path(folder))
    assert not path.startswith("-")


@pytest.mark.parametrize("is_found", [True, False])
def test_the_view_command_is_a_path_where_the_shell_does_not_find_its_name(
    is_found: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ours, other = tmp_path / "ours" / "tlsplan", tmp_path / "other" / "tlsplan"
    for each in (ours, other):
        each.parent.mkdir()
        each.touch(mode=0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(ours)])
    monkeypatch.setenv("PATH", str((ours if is_found else other).parent))
    where_to_look(Path("plan"))
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("view ")]
    assert line.split() == ["view", "tlsplan" if is_found else "ours/tlsplan", "view", "plan"]


def test_notes_of_bars_are_no_markup(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with ProgressReporter(quiet=False, stream=sys.stderr) as reporter:
        reporter.show(ProgressEvent("load", 0, 1, "Level [/1]"))
    assert "Level [/1]" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["floors", f"no{CLEAR_SCREEN}.obj"], [f"flo{CLEAR_SCREEN}"]])
def test_terminal_codes_in_arguments_are_told_as_codes(arguments: list[str], tlsplan: Callable[..., Any]) -> None:
    done = tlsplan(*arguments)
    assert r"\x1b[2J" in done.stderr
    assert "\x1b" not in done.stderr
    assert done.returncode in (2, 3)


# ------------------------------------------------------------------------------------------------- names and locales
def test_a_name_that_is_no_utf8_is_refused_before_any_work(
    box: Path, tmp_path: Path, tlsplan: Callable[..., Any]
) -> None:
    odd = box.rename(tmp_path / NO_UTF8)
    for arguments in (("plan", odd, "-o", tmp_path / "p"), ("plan", box, "-o", tmp_path / NO_UTF8), ("view", odd)):
        done = tlsplan(*arguments)
        assert done.returncode == 3
        assert done.stderr.count("\n") == 1
        assert r"b\xff\xe9.obj, expected one in UTF-8" in done.stderr


@pytest.mark.slow
def test_a_locale_of_another_encoding_knows_names_all_the_same(box: Path, tmp_path: Path) -> None:
    named = box.rename(tmp_path / "Größe 日本.obj")
    done = run("floors", named, LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")
    assert done.returncode == 0
    assert "reading Größe 日本.obj" in done.stderr.decode()


# ------------------------------------------------------------------------------------------------------ homes, pipes
@pytest.mark.slow
@pytest.mark.parametrize(
    "home",
    [
        pytest.param("/x" * 3000, id="long"),
        pytest.param("/etc/passwd/x", id="file", marks=pytest.mark.slow),
        pytest.param("/nonexistent/x", id="none", marks=pytest.mark.slow),
    ],
)
def test_commands_run_whatever_the_home(home: str) -> None:
    done = run("scanners", HOME=home, XDG_CACHE_HOME="")
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_home_that_may_not_be_entered_sends_caches_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    locked = tmp_path / "home"
    stat = Path.stat

    def refuses(path: Path, **told: bool) -> os.stat_result:
        if locked in path.parents:
            raise PermissionError(13, "Permission denied", str(path))
        return stat(path, **told)

    monkeypatch.setattr(Path, "stat", refuses)  # root may enter every folder
    assert environment._nearest(locked / ".cache" / "x") == locked / ".cache" / "x"  # which can't be written
    monkeypatch.undo()
    assert environment._nearest(locked / ".cache") == tmp_path


def run_unread(stream: str, *arguments: str | Path) -> subprocess.CompletedProcess[bytes]:
    """Run the command where the reader of a stream is gone before the first line: `head -1` goes before the second."""
    reader, writer = os.pipe()
    os.close(reader)
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: writer}
    done = subprocess.run([sys.executable, "-m", "tlsplan", *map(str, arguments)], timeout=240, **both)
    os.close(writer)
    return done


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["scanners", "--json"],
        *(
            pytest.param(each, marks=pytest.mark.slow)
            for each in (["scanners"], ["floors", "BOX"], ["floors", "BOX", "--json"], ["--help"])
        ),
    ],
)
def test_a_reader_that_goes_away_is_no_error(arguments: list[str], box: Path) -> None:
    done = run_unread("stdout", *(box if word == "BOX" else word for word in arguments))
    assert (done.returncode, b"Error" in done.stderr) == (0, False)


@pytest.mark.slow
def test_work_goes_on_where_the_reader_of_progress_goes_away(box: Path) -> None:
    done = run_unread("stderr", "floors", box)
    assert done.returncode == 0
    assert b"Level" in done.stdout


def test_a_command_that_ends_with_a_code_keeps_it(monkeypatch: pytest.MonkeyPatch, tlsplan: Callable[..., Any]) -> None:
    """A library's own way out, such as a server's that can't start, is no reader that went away."""
    monkeypatch.setattr("tlsplan.group.cli.main", lambda **_: sys.exit(3))
    assert tlsplan("scanners").returncode == 3

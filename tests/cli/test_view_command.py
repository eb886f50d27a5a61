"""What `tlsplan view` says at its start and at its end; the plan is looked at only, so it is no whole one."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from oldest_plan import oldest_plan
from tlsplan import environment
from tlsplan.group import cli

from planner_core.plan_folder.drawn_files import read_drawn_file, write_drawn
from tests.drawings.drawn_buildings import draw_two_rooms, room_document
from viewer_web.server import serve
from viewer_web.server.jobs.runs import LeftRun
from viewer_web.server.live_worker import LiveSide

PLAN = oldest_plan()
View = Callable[..., Result]


@pytest.fixture
def plan_folder(tmp_path: Path) -> Path:
    (tmp_path / "plan").mkdir()
    (tmp_path / "plan" / "plan.json").write_text(json.dumps(PLAN))
    return tmp_path / "plan"


@pytest.fixture
def view(plan_folder: Path, monkeypatch: pytest.MonkeyPatch) -> View:
    """Run the command on a server that is ended at once, with these runs still going."""

    def run(*left: LeftRun, options: tuple[str, ...] = ()) -> Result:
        def ended(
            *_: object,
            keep_links: bool,
            port: int | None,
            host: str | None,
            on_ready: Callable[[str], None],
            on_comment_address: Callable[[str], None],
            on_left: Callable[[LeftRun], None],
            on_kept: Callable[[Path], None],
            **__: object,
        ) -> None:
            on_ready("http://127.0.0.1:1/?token=x")
            on_comment_address("http://127.0.0.1:1/?token=y")
            if keep_links:
                on_kept(Path(f"{host}-{port}.json"))
            for each in left:
                on_left(each)
            signal.raise_signal(signal.SIGINT)

        monkeypatch.setattr(serve, "serve", ended)
        return CliRunner().invoke(cli, ["view", str(plan_folder), "--no-browser", *options])

    return run


def test_a_damaged_review_is_told_in_one_line_and_the_plan_is_shown_all_the_same(view: View, plan_folder: Path) -> None:
    (plan_folder / "review.usda").write_text("#usda 1.0\n(\n")
    done = view()
    assert done.exit_code == 0
    [line] = done.stderr.splitlines()
    assert line.startswith(f"warning: {plan_folder / 'review.usda'}: the review is damaged (line 3: it breaks off)")
    assert "rename it" in line and "nothing is deleted" in line
    assert "is shown at http://127.0.0.1:1/" in done.stdout


def test_a_sound_review_is_not_spoken_of(view: View, plan_folder: Path) -> None:
    (plan_folder / "review.usda").write_text("#usda 1.0\n")
    done = view()
    assert done.stderr == ""
    assert done.stdout.splitlines()[2:] == ["stopped"]


def test_the_address_of_commenters_is_printed_beside_the_other(view: View) -> None:
    shown, comments, _ = view().stdout.splitlines()
    assert "is shown at http://127.0.0.1:1/?token=x" in shown
    assert comments == "for comments and verdicts only: http://127.0.0.1:1/?token=y"


def test_where_links_are_kept_is_printed(view: View) -> None:
    _, _, kept, stopped = view(options=("--keep-links",)).stdout.splitlines()
    assert (kept, stopped) == (
        "kept for the next start with --keep-links, until you delete None-None.json", "stopped",
    )  # fmt: skip
    done = view(options=("--keep-links", "--port", "0", "--host", "::1"))
    assert "delete ::1-0.json" in done.stdout  # not as if they were not given


def test_links_are_not_kept_where_caches_go_with_the_process(view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(environment, "_caches_are_kept", False)
    monkeypatch.delenv("TLSPLAN_CACHE", raising=False)
    assert view().stderr == ""
    done = view(options=("--keep-links",))
    [line] = done.stderr.splitlines()
    assert line.startswith("warning: links are not kept: cache folder: got a home folder that can't be written")
    assert "set TLSPLAN_CACHE" in line
    assert "kept for" not in done.stdout and "is shown at" in done.stdout


def test_a_run_that_was_must_end_is_told_with_where_its_plan_will_be(view: View, tmp_path: Path) -> None:
    *_, stopped, said = view(LeftRun("R002", is_ending=True, plan=tmp_path / "R002")).stdout.splitlines()
    assert stopped == "stopped"
    assert said.startswith("run R002 was cancelled") and said.endswith(f"writes it to {tmp_path / 'R002'}")


def test_an_opening_that_outlives_the_server_does_not_spoil_the_end(
    view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    codes: list[int] = []
    monkeypatch.setattr(environment, "leave_at_once", codes.append)
    assert view().stdout.splitlines()[-1] == "stopped"
    assert codes == []
    over = threading.Event()
    side = LiveSide(lambda _: over.wait())  # type: ignore[arg-type, return-value]
    side.start()
    assert view().stdout.splitlines()[-1] == "stopped"
    assert codes == [0]
    over.set()
    side.wait()


def test_a_run_of_another_server_is_told_to_go_on(view: View, tmp_path: Path) -> None:
    *_, said = view(LeftRun("R007", is_ending=False, plan=tmp_path / "R007")).stdout.splitlines()
    assert said.startswith("run R007 continues") and "start `tlsplan view` again" in said


@pytest.mark.slow
def test_a_drawing_is_recognised_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Path] = []
    monkeypatch.setattr(serve, "serve", lambda plan, **_: shown.append(plan))
    monkeypatch.chdir(tmp_path)
    draw_two_rooms(tmp_path / "house.dxf")
    done = CliRunner().invoke(cli, ["view", "house.dxf", "--no-browser", "--room-height", "2.6"])
    assert done.exit_code == 0, done.output
    assert shown == [tmp_path / "house-plan"]
    (storey,) = read_drawn_file(tmp_path / "house-plan.drawing.json").storeys
    assert storey.room_height_m == 2.6
    refused = CliRunner().invoke(cli, ["view", "plan", "--no-browser", "--units", "mm"])
    assert "options of drawings: got them with plan, expected a drawing" in str(refused.exception)


def test_a_drawing_file_is_shown_before_there_is_a_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[tuple[Path, bool]] = []

    def ended(folder: Path, *, live: bool, on_ready: Callable[[str], None], **_: object) -> None:
        served.append((folder, live))
        on_ready("http://127.0.0.1:1/?token=x")
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(serve, "serve", ended)
    document = tmp_path / "floor.drawing.json"
    write_drawn(room_document(), document)
    shown = CliRunner().invoke(cli, ["view", str(document), "--no-browser"])
    assert shown.output.startswith(f"{document} is shown at http://127.0.0.1:1/?token=x")
    assert served == [(tmp_path.resolve() / "floor", False)]
    document.write_text("{")
    refused = CliRunner().invoke(cli, ["view", str(document), "--no-browser"])
    assert "floor.drawing.json: can't be read (it is no JSON)" in str(refused.exception)

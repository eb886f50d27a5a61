"""`--keep-links`: a further start has the same addresses, from a file that nobody else can read."""

from __future__ import annotations

import http.cookiejar
import json
import os
import socket
import stat
import subprocess
import sys
import urllib.parse
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from starlette.applications import Starlette

from planner_core.errors import RequirementError
from viewer_web.server import serve as serving
from viewer_web.server import shared_links
from viewer_web.server.app import create_app
from viewer_web.server.shared_links import SharedLinks, file_of_links, found_links, keep

from .conftest import send

LINKS = SharedLinks("127.0.0.1", 8123, "a" * 43, "b" * 43)


@dataclass(frozen=True)
class Start:
    """What one start of the server gave: its application, its addresses, its lines, and where it keeps its links."""

    app: Starlette
    addresses: list[str]
    warnings: list[str]
    kept: list[Path]

    @property
    def tokens(self) -> list[str]:
        return [address.partition("token=")[2] for address in self.addresses]

    @property
    def port(self) -> int | None:
        return urllib.parse.urlsplit(self.addresses[0]).port


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TLSPLAN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def start(cache: Path, plan_folder: Path, built_app: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Start]:
    """Start the server and stop it again once it listens and has announced itself; with `keep_links`, unless given."""
    made: list[Starlette] = []
    monkeypatch.setattr(serving, "create_app", lambda *a, **k: made.append(create_app(*a, **k)) or made[-1])
    monkeypatch.setattr(serving._AnnouncingServer, "run", lambda self, sockets: self._announce())

    def run(**more: Any) -> Start:
        addresses: list[str] = []
        warnings: list[str] = []
        kept: list[Path] = []
        serving.serve(
            plan_folder,
            built_app=built_app,
            live=False,
            on_ready=addresses.append,
            on_comment_address=addresses.append,
            on_kept=kept.append,
            on_warning=warnings.append,
            **{"keep_links": True, **more},
        )
        return Start(made[-1], addresses, warnings, kept)

    return run


def test_a_further_start_has_the_same_addresses_and_accepts_their_tokens(start: Callable[..., Start]) -> None:
    first, second = start(), start()
    assert second.addresses == first.addresses
    assert [send(second.app, "/api/session", token=token).json()["comment_only"] for token in first.tokens] == [
        False, True,
    ]  # fmt: skip
    assert (first.warnings, second.warnings) == ([], [])
    assert first.kept == second.kept == list(first.kept[0].parent.iterdir())


def test_only_the_user_can_read_what_is_kept(start: Callable[..., Start], cache: Path, plan_folder: Path) -> None:
    [file] = start().kept
    assert file.parent == cache / "links"
    assert [stat.S_IMODE(path.stat().st_mode) for path in (file.parent, file)] == [0o700, 0o600]
    assert json.loads(file.read_text())["plan"] == str(plan_folder)


def test_without_the_option_nothing_is_read_and_nothing_kept(
    start: Callable[..., Start], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(serving, "found_links", lambda *_: pytest.fail("it was read"))
        first = start(keep_links=False)
    assert first.kept == []
    assert not cache.exists()
    kept = start()
    assert not set(start(keep_links=False).tokens) & set(kept.tokens)


def test_another_plan_folder_has_its_own_and_another_spelling_of_the_path_has_not(
    cache: Path, plan_folder: Path, tmp_path: Path
) -> None:
    (tmp_path / "link").symlink_to(plan_folder)
    assert file_of_links(tmp_path / "link") == file_of_links(plan_folder / ".." / "plan") == file_of_links(plan_folder)
    assert file_of_links(tmp_path) != file_of_links(plan_folder)


def test_a_path_that_is_no_text_has_its_links(cache: Path, tmp_path: Path) -> None:
    plan = tmp_path / os.fsdecode(b"plan-\xff")
    keep(plan, LINKS)
    assert found_links(plan, pytest.fail) == LINKS


def test_a_port_that_is_given_wins_and_is_kept(start: Callable[..., Start]) -> None:
    first = start()
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
    moved = start(port=port)
    assert (moved.port, moved.tokens) == (port, first.tokens)
    assert start().addresses == moved.addresses


def test_a_host_that_is_given_wins_and_is_kept_and_one_that_others_reach_is_warned_of(
    start: Callable[..., Start],
) -> None:
    first = start(host="0.0.0.0")
    again = start()
    assert (first.warnings, again.addresses) == ([], first.addresses)
    [line] = again.warnings
    assert line.startswith("listens on 0.0.0.0") and "--host 127.0.0.1" in line
    assert start(host="127.0.0.1").warnings == start().warnings == []


def test_a_kept_port_that_is_taken_is_refused_and_port_0_takes_a_new_one(start: Callable[..., Start]) -> None:
    first = start()
    with socket.create_server(("127.0.0.1", first.port)):
        with pytest.raises(RequirementError, match=f"port {first.port}.*expected a free one.*--port 0 --keep-links`"):
            start()
        moved = start(port=0)
        with pytest.raises(RequirementError, match="Choose another port"):  # given: it is no kept one
            start(port=first.port)
    assert moved.port != first.port
    assert moved.tokens == first.tokens
    assert start().addresses == moved.addresses


def test_a_start_for_comments_only_does_not_accept_the_kept_token_that_allows_more(start: Callable[..., Start]) -> None:
    first = start()
    comments = start(comment_only=True)
    assert comments.tokens == first.tokens[1:]
    assert [send(comments.app, "/api/session", token=token).status_code for token in first.tokens] == [401, 200]
    assert start().addresses == first.addresses


def damaged(file: Path, **changes: Any) -> None:
    file.write_text(json.dumps({**json.loads(file.read_text()), **changes}))


DAMAGED = (
    lambda file: file.write_text("{"),
    lambda file: file.write_text(""),
    lambda file: file.write_text("[" * 60000),
    lambda file: file.write_text("[]"),
    lambda file: file.write_text('{"schema": "tlsplan/links/1"}'),
    lambda file: damaged(file, port=0),
    lambda file: damaged(file, port=65536),
    lambda file: damaged(file, host=None),
    lambda file: damaged(file, token="x" * 43, comment_token="x" * 43),
    lambda file: damaged(file, plan="/elsewhere"),
)


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (lambda file: file.write_bytes(b"\xff\xfe"), "a damaged one"),
        (lambda file: damaged(file, port=True), "a damaged one"),
        (lambda file: damaged(file, token="short"), "a damaged one"),
        *(pytest.param(harm, "a damaged one", marks=pytest.mark.slow) for harm in DAMAGED),
        (lambda file: damaged(file, schema="tlsplan/links/2"), "of another version"),
        (lambda file: file.chmod(0o640), "open to other users"),
        (lambda file: file.chmod(0o604), "open to other users"),
        (lambda file: file.parent.chmod(0o750), "in a folder that is open to other users"),
        (lambda file: file.rename(file.with_name("other")).parent.joinpath(file.name).symlink_to("other"), "no file"),
    ],
)  # fmt: skip
def test_what_can_not_be_trusted_is_not_used_and_replaced(
    start: Callable[..., Start], harm: Callable[[Path], object], reason: str
) -> None:
    first = start()
    [file] = first.kept
    harm(file)
    second = start()
    [line] = second.warnings
    assert reason in line and str(file) in line and "new addresses" in line and "\n" not in line
    assert not any(token in line for token in (*first.tokens, *second.tokens))
    assert not set(first.tokens) & set(second.tokens)
    assert [send(second.app, "/api/session", token=token).status_code for token in first.tokens] == [401, 401]
    third = start()
    assert (third.addresses, third.warnings) == (second.addresses, [])
    assert [stat.S_IMODE(path.lstat().st_mode) for path in (file.parent, file)] == [0o700, 0o600]


@pytest.mark.parametrize(
    ("of", "reason"), [(stat.S_ISREG, "one of another user"), (stat.S_ISDIR, "belongs to another user")]
)
def test_what_belongs_to_somebody_else_is_not_used(
    start: Callable[..., Start], monkeypatch: pytest.MonkeyPatch, of: Callable[[int], bool], reason: str
) -> None:
    first = start()
    monkeypatch.setattr(shared_links, "is_own", lambda status: not of(status.st_mode))
    second = start()
    assert reason in second.warnings[0]
    assert not set(first.tokens) & set(second.tokens)
    assert bool(second.kept) is (of is stat.S_ISREG)  # into somebody else's folder nothing is written
    assert len(second.warnings) == (1 if second.kept else 2)


def test_where_a_file_system_keeps_no_permissions_no_token_is_written(
    cache: Path, plan_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shared_links, "is_open_to_others", lambda status: stat.S_ISREG(status.st_mode))
    with pytest.raises(PermissionError, match="keeps no permissions"):
        keep(plan_folder, LINKS)
    assert list((cache / "links").iterdir()) == []


@pytest.mark.parametrize("cache_folder", ["{tmp_path}/file/cache", "/proc/self/cache"])
def test_where_nothing_can_be_written_the_server_starts_with_one_line(
    start: Callable[..., Start], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, cache_folder: str
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("TLSPLAN_CACHE", cache_folder.format(tmp_path=tmp_path))
    first, second = start(), start()
    assert not set(first.tokens) & set(second.tokens)
    [line] = first.warnings
    assert line.startswith("links are not kept in ") and "TLSPLAN_CACHE" in line and "\n" not in line
    assert first.kept == []


def test_without_a_home_the_server_starts_with_one_line(
    start: Callable[..., Start], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("TLSPLAN_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    first = start()
    [line] = first.warnings
    assert line.startswith("links are not kept: cache folder: got none") and "TLSPLAN_CACHE" in line
    assert (len(first.addresses), first.kept) == (2, [])


def test_links_that_are_the_same_are_not_written_again(start: Callable[..., Start]) -> None:
    [file] = start().kept
    written = file.stat()
    assert os.path.samestat(start().kept[0].stat(), written)


def test_tokens_are_in_no_representation() -> None:
    assert repr(LINKS) == "SharedLinks(host='127.0.0.1', port=8123)"


SERVE = """
import sys
from pathlib import Path
from viewer_web.server.serve import serve
try:
    serve(
        Path(sys.argv[1]),
        built_app=Path(sys.argv[2]),
        live=False,
        keep_links=True,
        on_ready=lambda address: print(address, flush=True),
    )
except KeyboardInterrupt:
    pass
"""


@pytest.mark.slow
@pytest.mark.usefixtures("cache")
def test_a_browser_that_was_in_is_in_after_a_restart(plan_folder: Path, built_app: Path) -> None:
    """Its cookie, named by the port, is that of the next start too, which listens there at once."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(http.cookiejar.CookieJar()))
    command = [sys.executable, "-c", SERVE, str(plan_folder), str(built_app)]
    pages: list[str] = []
    for _ in range(2):
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                address = process.stdout.readline().strip()
                if not pages:
                    with browser.open(address, timeout=120) as answer:
                        pages.append(answer.geturl())
                with browser.open(f"{pages[0]}plan/plan.json", timeout=120) as answer:
                    assert b"tlsplan/plan/1" in answer.read()
                with browser.open(f"{pages[0]}api/events", timeout=120) as events:
                    assert events.readline() == b"retry: 1000\n"
                    process.send_signal(2)
                    assert events.read() == b"\n"
            finally:
                process.kill()

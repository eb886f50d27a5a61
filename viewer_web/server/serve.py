"""Runs the viewer's application until it is interrupted."""

import errno
import socket
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import uvicorn
from fastapi import APIRouter

from planner_core.cache import CACHE_VARIABLE
from planner_core.errors import RequirementError
from planner_core.plan_folder.plan_settings import ScenePaths
from planner_core.progress import Progress
from viewer_web.server.app import BUILT_APP, create_app
from viewer_web.server.connections import ACCEPTED_AT_ONCE, MOST_WAITING, Connection, close_overdue
from viewer_web.server.guard import LOOPBACK_NAMES
from viewer_web.server.session import Session
from viewer_web.server.shared_links import SharedLinks, file_of_links, found_links, keep
from viewer_web.server.token import QUERY, new_token

if TYPE_CHECKING:
    from planner_core.planning.live.live_plan import LivePlan
    from viewer_web.server.jobs.runs import LeftRun

WILDCARD_HOSTS = frozenset({"", "0.0.0.0", "::"})
LARGEST_REQUEST_HEAD_BYTES = 16 * 1024
HEARD_WITHIN_S = 60
_LOOK_EVERY_TICKS = 5  # of uvicorn's, a tenth of a second each


def serve(
    plan_folder: Path,
    *,
    host: str | None = None,
    port: int | None = None,
    on_ready: Callable[[str], None],
    allowed_hosts: Iterable[str] = (),
    built_app: Path = BUILT_APP,
    scene: ScenePaths = None,
    read_only: bool = False,
    comment_only: bool = False,
    live: bool = True,
    keep_links: bool = False,
    on_comment_address: Callable[[str], None] = lambda _: None,
    on_left: Callable[["LeftRun"], None] = lambda _: None,
    on_kept: Callable[[Path], None] = lambda _: None,
    on_warning: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve `plan_folder` on `host` and `port` until interrupted (Ctrl-C raises KeyboardInterrupt here).

    Parameters
    ----------
    plan_folder, built_app : Path
        As in `create_app`.
    host, port : str, int
        Address to listen on; port 0 lets the system choose a free one. None: those kept, else the loopback address and
        any free port.
    on_ready : callable
        Gets the address to open, with a token in it, once requests are answered.
    allowed_hosts : iterable of str
        Names besides the loopback ones, `host` and this machine's own addresses under which browsers reach it. Where
        `host` is a wildcard, this machine's own name is allowed too.
    scene
        The scene file or files, for the live side; None: searched for at the plan's paths, and beside the folder.
    read_only : bool
        Whether the review may not be changed, and no run started.
    comment_only : bool
        Whether the address to open is that of those who may comment and give verdicts, and no more.
    on_comment_address : callable
        Gets the address of those, where `on_ready` got another one and there is something to comment on: not
        `read_only`. Called after `on_ready`.
    live : bool
        Whether the live side is opened, in the background, once requests are answered.
    keep_links : bool
        Whether tokens, host and port are those of the last start with `keep_links`, and kept for the next one, see
        `viewer_web.server.shared_links`. With `comment_only`, the kept token of those who may do more is not accepted.
    on_left : callable
        Gets the run that goes on when the server stops, if there is one.
    on_kept : callable
        Gets the file in which the links are kept, after `on_ready`; not called where they are not.
    on_warning : callable
        Gets lines for the user, before requests are answered (links that can't be kept) and meanwhile, from any thread:
        a fallback of the live side, for example.

    Notes
    -----
    The opening of the live side may outlive this call, see `viewer_web.server.live_worker.opening_goes_on`: then
    Python's own end of the process aborts, as the compiler's library is taken down under it.

    Raises
    ------
    PlanFolderError, MissingPackageError
        As in `create_app`.
    RequirementError
        The address can't be listened on.
    """
    kept, keep_links = _kept(plan_folder, on_warning) if keep_links else (None, False)
    token, comment_token = (kept.token, kept.comment_token) if kept else (new_token(), new_token())
    is_kept_port = kept is not None and port is None
    if kept is not None and host is None and kept.host not in LOOPBACK_NAMES:
        on_warning(
            f"listens on {kept.host or 'all addresses'} as at the start whose links were kept, so that others on the "
            "network can reach it; --host 127.0.0.1 ends that"
        )
    host = host if host is not None else kept.host if kept else "127.0.0.1"
    port = port if port is not None else kept.port if kept else 0
    named = own_names() if host in WILDCARD_HOSTS else (host,)
    session = Session(plan_folder, read_only=read_only)
    sides = [
        runs_side(session, scene, on_left=on_left),
        exports_side(session, scene),
        drawing_side(session),
        *([live_side(session, scene, on_warning=on_warning)] if live else []),
    ]
    app = create_app(
        plan_folder,
        token=new_token() if comment_only else token,  # a kept one, which others have, allows more
        comment_token=comment_token,
        session=session,
        routers=[side.router for side in sides],
        allowed_hosts=(*allowed_hosts, *named),
        built_app=built_app,
    )
    with _listen(host, port, is_kept_port=is_kept_port) as listener:
        port = listener.getsockname()[1]
        shown_host = "127.0.0.1" if host in WILDCARD_HOSTS else host
        address = f"http://{f'[{shown_host}]' if ':' in shown_host else shown_host}:{port}/"
        if keep_links:
            links = SharedLinks(host, port, token, comment_token)
            keep_links = links == kept or _keep(plan_folder, links, on_warning)

        def ready() -> None:
            for side in sides:
                side.start()
            of_commenters = f"{address}?{QUERY}={comment_token}"
            on_ready(of_commenters if comment_only else f"{address}?{QUERY}={token}")
            if not (comment_only or read_only):
                on_comment_address(of_commenters)
            if keep_links:
                on_kept(file_of_links(plan_folder))

        def stopping() -> None:
            session.events.close()  # streams end only when they are closed, and the server waits for them
            for side in sides:
                side.stop()

        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="off",
            ws="none",
            h11_max_incomplete_event_size=LARGEST_REQUEST_HEAD_BYTES,
            http=Connection,
            backlog=ACCEPTED_AT_ONCE,
            timeout_graceful_shutdown=2,
        )
        _AnnouncingServer(config, ready, stopping).run(sockets=[listener])


@dataclass(frozen=True)
class Side:
    """A part of the server that works beside the answering of requests: its routes, what starts it, what ends it."""

    router: APIRouter
    start: Callable[[], None]
    stop: Callable[[], None]


def live_side(
    session: Session, scene: ScenePaths = None, *, on_warning: Callable[[str], None] = lambda _: None
) -> Side:
    """Return the live side of a session, not yet started; `on_warning` as in `serve`."""
    from viewer_web.server.live_api import create_live_router
    from viewer_web.server.live_worker import LiveSide

    def open_plan(progress: Progress) -> "LivePlan":
        from planner_core.planning.live.opening import open_live

        plan = open_live(session.plan_folder, scene=scene, progress=progress)
        for line in plan.engine.warnings:
            on_warning(line)
        return plan

    side = LiveSide(open_plan, tell=lambda state: session.events.publish("live", state))
    session.live_state = side.state
    return Side(create_live_router(side, session.review, session.plan), side.start, side.stop)


def runs_side(
    session: Session, scene: ScenePaths = None, *, on_left: Callable[["LeftRun"], None] = lambda _: None
) -> Side:
    """Return the runs of a session, not yet watched; `on_left` as in `serve`."""
    from viewer_web.server.jobs.api import create_runs_router
    from viewer_web.server.jobs.runs import Runs

    runs = Runs(
        session.plan_folder,
        scene=scene,
        read_only=session.read_only,
        tell=lambda run: session.events.publish("run", run),
        tell_deleted=lambda run: session.events.publish("run_deleted", {"id": run}),
    )

    def stop() -> None:
        if (left := runs.stop()) is not None:
            on_left(left)

    return Side(create_runs_router(runs, read_only=session.read_only), runs.watch, stop)


def exports_side(session: Session, scene: ScenePaths = None) -> Side:
    """Return the exports of a session."""
    from viewer_web.server.exports import Exports
    from viewer_web.server.exports_api import create_exports_router

    exports = Exports(session, scene)
    return Side(create_exports_router(exports), lambda: None, exports.stop)


def drawing_side(session: Session) -> Side:
    """Return the drawing of a session's plan, and its corrections."""
    from viewer_web.server.drawing_api import create_drawing_router

    return Side(create_drawing_router(session), lambda: None, lambda: None)


def own_names() -> tuple[str, ...]:
    """Names under which others may reach this machine: what it calls itself, short and as local networks spell it.

    Asks no name server: where there is none, that would hold up the start. Other names are `allowed_hosts`.
    """
    name = socket.gethostname()
    short = name.split(".", 1)[0]
    return tuple(sorted({name, short, f"{short}.local"} if short else ()))


def _kept(plan_folder: Path, on_warning: Callable[[str], None]) -> tuple[SharedLinks | None, bool]:
    """Return the links that were kept, if there are any, and whether there is a place to keep links."""
    try:
        return found_links(plan_folder, on_warning), True
    except RequirementError as error:
        on_warning(f"links are not kept: {error}")
        return None, False


def _keep(plan_folder: Path, links: SharedLinks, on_warning: Callable[[str], None]) -> bool:
    """Keep links for the next start, and return whether they are kept: a server without is better than none."""
    try:
        keep(plan_folder, links)
    except OSError as error:
        on_warning(
            f"links are not kept in {file_of_links(plan_folder).parent}: {error.strerror or error}, expected a folder "
            f"of yours that can be written; the next start has other addresses. Set {CACHE_VARIABLE} to such a folder"
        )
        return False
    return True


def _listen(host: str, port: int, *, is_kept_port: bool = False) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except (OSError, OverflowError) as error:
        words: str = getattr(error, "strerror", None) or str(error)
        reason = words.partition(" (while ")[0]  # Python adds the address, which is there already
        if is_kept_port and isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise RequirementError(
                f"{host} port {port}, of the kept links: got a port in use, expected a free one; stop what listens "
                "there, such as another `tlsplan view` of this plan, or take a new port with `--port 0 --keep-links`"
            ) from error
        raise RequirementError(
            f"can't listen on {host} port {port}: {reason}. Choose another port, or 0 for any free one."
        ) from error
    if (option := getattr(socket, "TCP_USER_TIMEOUT", None)) is not None:
        # Of pages that went without a word, as tablets do out of reach: systems else wait a quarter of an hour.
        listener.setsockopt(socket.IPPROTO_TCP, option, HEARD_WITHIN_S * 1000)
    return listener


class _AnnouncingServer(uvicorn.Server):
    """A server that prints when it answers, and when it stops: uvicorn itself only logs it."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[], None], stopping: Callable[[], None]) -> None:
        super().__init__(config)
        self._announce = announce
        self._stopping = stopping

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        for listener in sockets or []:
            listener.listen(MOST_WAITING)  # asyncio has one number for this and for how many it accepts at once
        if self.started:
            self._announce()

    async def on_tick(self, counter: int) -> bool:
        if counter % _LOOK_EVERY_TICKS == 0:
            close_overdue(self.server_state.connections)
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._stopping()
        await super().shutdown(sockets=sockets)

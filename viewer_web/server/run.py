"""Runs the viewer's application until it is interrupted."""

import socket
from collections.abc import Callable, Iterable
from pathlib import Path

import uvicorn

from planner_core.errors import RequirementError
from viewer_web.server.app import BUILT_APP, create_app

WILDCARD_HOSTS = frozenset({"", "0.0.0.0", "::"})
LARGEST_REQUEST_HEAD_BYTES = 16 * 1024
MOST_CONNECTIONS = 64


def serve(
    plan_folder: Path,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    on_ready: Callable[[str], None],
    allowed_hosts: Iterable[str] = (),
    built_app: Path = BUILT_APP,
) -> None:
    """Serve `plan_folder` on `host` and `port` until interrupted (Ctrl-C raises KeyboardInterrupt here).

    Parameters
    ----------
    plan_folder, built_app : Path
        As in `create_app`.
    host, port : str, int
        Address to listen on; port 0 lets the system choose a free one.
    on_ready : callable
        Gets the address to open, once requests are answered.
    allowed_hosts : iterable of str
        Names besides the loopback ones, `host` and this machine's own addresses under which browsers reach it. Where
        `host` is a wildcard, this machine's own name is allowed too.

    Raises
    ------
    PlanFolderError, MissingPackageError
        As in `create_app`.
    RequirementError
        The address can't be listened on.
    """
    named = own_names() if host in WILDCARD_HOSTS else (host,)
    app = create_app(plan_folder, allowed_hosts=(*allowed_hosts, *named), built_app=built_app)
    with _listen(host, port) as listener:
        shown_host = "127.0.0.1" if host in WILDCARD_HOSTS else host
        address = f"http://{f'[{shown_host}]' if ':' in shown_host else shown_host}:{listener.getsockname()[1]}/"
        config = uvicorn.Config(
            app,
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="off",
            ws="none",
            h11_max_incomplete_event_size=LARGEST_REQUEST_HEAD_BYTES,
            http="h11",
            limit_concurrency=MOST_CONNECTIONS,
            timeout_graceful_shutdown=2,
        )
        _AnnouncingServer(config, lambda: on_ready(address)).run(sockets=[listener])


def own_names() -> tuple[str, ...]:
    """Names under which others may reach this machine: what it calls itself, short and as local networks spell it.

    Asks no name server: where there is none, that would hold up the start. Other names are `allowed_hosts`.
    """
    name = socket.gethostname()
    short = name.split(".", 1)[0]
    return tuple(sorted({name, short, f"{short}.local"} if short else ()))


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise RequirementError(
            f"can't listen on {host} port {port}: {reason}. Choose another port, or 0 for any free one."
        ) from error


class _AnnouncingServer(uvicorn.Server):
    """A server that says when it answers: uvicorn itself only logs it."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[], None]) -> None:
        super().__init__(config)
        self._announce = announce

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        if self.started:
            self._announce()

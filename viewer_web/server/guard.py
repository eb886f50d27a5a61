"""Which requests the viewer answers at all, and the security headers of every answer.

The server has no login: it trusts whoever runs it. So a page of another site that the user has open must not be able
to read the plan through the user's browser. Three checks see to that: the Host header must name us (else a name that
was re-bound to 127.0.0.1 would pass as same-origin), Origin must be our own where it is sent, port and all, and
Sec-Fetch-Site must not say that another site asks, except when the user follows a link to here.

Host names us where it is a loopback name, a name that was allowed, or the very address the connection came in at: an
address, unlike a name, can't be re-bound. Its port does not matter: through a tunnel it is the other end's.
"""

from collections.abc import Iterable
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
LONGEST_PATH = 1024

COMMON_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}
APP_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "worker-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# The report is one self-contained page: styles and pictures inside it, and never a script.
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)


class RequestGuard:
    """ASGI middleware: refuses what is not a plain read by our own page, and adds the security headers."""

    def __init__(self, app: ASGIApp, *, allowed_hosts: Iterable[str] = ()) -> None:
        self._app = app
        self._allowed_hosts = LOOPBACK_NAMES | {host.strip("[]").lower() for host in allowed_hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, itself where it must be refused."""
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                is_report = scope["path"].startswith("/plan/report/")
                headers.update(
                    {**COMMON_HEADERS, "content-security-policy": REPORT_POLICY if is_report else APP_POLICY}
                )
            await send(message)

        refusal = self._refusal(scope)
        await (refusal or self._app)(scope, receive, send_guarded)

    def _refusal(self, scope: Scope) -> PlainTextResponse | None:
        headers = Headers(scope=scope)
        if not self._is_ours(headers.get("host", ""), scope):
            return _refuse(
                421,
                "this host name is not served here; open the address that `tlsplan view` printed, or start it with "
                "--allow-host and this name",
            )
        if not _same_origin(headers):
            return _refuse(403, "another site may not read the plan")
        if scope["method"] not in ("GET", "HEAD"):
            return _refuse(405, "only GET and HEAD are answered", {"allow": "GET, HEAD"})
        if headers.get("content-length", "0") != "0" or "transfer-encoding" in headers:
            return _refuse(413, "a request body is not expected")
        if len(scope.get("raw_path") or scope["path"]) > LONGEST_PATH:
            return _refuse(414, "the path is too long")
        return None

    def _is_ours(self, host: str, scope: Scope) -> bool:
        try:
            asked = urlsplit(f"//{host}")
            name, _ = asked.hostname, asked.port  # reading the port refuses what is none
        except ValueError:
            return False
        if asked.netloc != host or "@" in host or not name:
            return False
        server = scope.get("server")
        return name in self._allowed_hosts or (server is not None and _is_same_address(name, server[0]))


def _is_same_address(name: str, local: str) -> bool:
    try:
        return ip_address(name) == ip_address(local.partition("%")[0])
    except ValueError:  # one of them is a name
        return False


def _same_origin(headers: Headers) -> bool:
    origin = headers.get("origin")
    if origin is not None and origin != f"http://{headers.get('host', '')}":
        return False
    if headers.get("sec-fetch-site", "same-origin") in ("same-origin", "none"):
        return True
    return headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"


def _refuse(status: int, reason: str, headers: dict[str, str] | None = None) -> PlainTextResponse:
    return PlainTextResponse(reason + "\n", status_code=status, headers=headers)

"""Which requests the viewer answers at all, and the security headers of every answer.

The server has no users: it trusts whoever has the token that it printed when it was started. A page of another site
that such a user has open must not be able to read the plan through their browser, or change its review. Besides the
token, three checks see to that: the Host header must name us (else a name that was re-bound to 127.0.0.1 would pass as
same-origin), Origin must be our own where it is sent, port and all, and Sec-Fetch-Site must not say that another site
asks, except when the user follows a link to here. None of them may be there twice. Bodies must be JSON, or
JPEG where a photo is expected: no other site's form can send either.

Host names us where it is a loopback name, a name that was allowed, or the very address the connection came in at: an
address, unlike a name, can't be re-bound. Its port does not matter: through a tunnel it is the other end's.
"""

import re
from collections.abc import Iterable
from ipaddress import ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from viewer_web.server.connections import is_admitted, note_admitted
from viewer_web.server.roles import MAY_ONLY_COMMENT, note_commenter
from viewer_web.server.token import cookie_of, handed_in, has_token, is_token

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
LONGEST_PATH = 1024
LONGEST_QUERY = 1024
LARGEST_BODY_BYTES = 1024 * 1024
LARGEST_OF_PATH = {"/api/drawing": 16 * 1024 * 1024}
"""Where more is needed: a drawing is sent as a whole, 50 000 walls and doors of which have 8 MB."""
PHOTOS = "/api/review/photos"
MOST_STRANGERS = 32
"""Requests without the token that are answered with a file at once. Each waits for threads, in one row with those that
have it, and goes on waiting when its connection is gone."""

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
#: Each is judged, here or by h11: of two of them, another program on the way may take the other one.
_ONCE = (
    "host", "origin", "sec-fetch-site", "sec-fetch-mode", "sec-fetch-dest", "content-length", "content-type",
)  # fmt: skip
_REPORT = re.compile(r"/plan/(runs/[^/]+/plan/)?report/")
#: What commenters may send: routes that come later are not theirs until they are named here.
_OF_COMMENTERS = frozenset({"/api/review/changes", PHOTOS})
_BUSY = "too many ask without the token at once; ask again, or open the address that `tlsplan view` printed"
_NO_TOKEN = "this browser has no token for this server; open the address that `tlsplan view` printed, with its token"


class RequestGuard:
    """ASGI middleware: refuses what our own page does not ask, and adds the security headers.

    Parameters
    ----------
    token
        What a request must bring along, see `viewer_web.server.token`.
    comment_token
        The same of those who may comment and no more, see `viewer_web.server.roles`; empty: there are none.
    """

    def __init__(self, app: ASGIApp, *, token: str, comment_token: str = "", allowed_hosts: Iterable[str] = ()) -> None:
        self._app = app
        self._token, self._comment_token = token, comment_token
        self._given_hosts = {host.strip("[]").lower() for host in allowed_hosts} - LOOPBACK_NAMES
        self._allowed_hosts = LOOPBACK_NAMES | self._given_hosts
        self._n_strangers = 0

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
                policy = REPORT_POLICY if _REPORT.match(scope["path"]) else APP_POLICY
                headers.update({**COMMON_HEADERS, "content-security-policy": policy})
            await send(message)

        answer = self._refusal(scope) or self._admission(scope)
        if answer is not None:
            await answer(scope, receive, send_guarded)
        elif is_admitted(scope):
            await self._app(scope, receive, send_guarded)
        elif self._n_strangers >= MOST_STRANGERS:
            await _refuse(scope, 503, _BUSY)(scope, receive, send_guarded)
        else:
            self._n_strangers += 1
            try:
                await self._app(scope, receive, send_guarded)
            finally:
                self._n_strangers -= 1

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        twice = next((name for name in _ONCE if len(headers.getlist(name)) > 1), None)
        if twice is not None:
            return _refuse(scope, 403, f"got the header {twice} more than once, expected it once; send one")
        if not self._is_ours(headers.get("host", ""), scope):
            return _refuse(
                scope,
                421,
                "this host name is not served here; open the address that `tlsplan view` printed, or start it with "
                "--allow-host and this name",
            )
        if not (self._is_own_page(headers) and _is_same_site(headers)):
            return _refuse(scope, 403, "got a request from another site; open the address that `tlsplan view` printed")
        methods = ("GET", "POST", "DELETE") if _is_api(scope) else ("GET", "HEAD")
        if scope["method"] not in methods:
            allowed = ", ".join(methods)
            return _refuse(scope, 405, f"only {allowed} are accepted here", {"allow": allowed})
        if refusal := _body_refusal(scope, headers):
            return refusal
        if len(scope.get("raw_path") or scope["path"]) > LONGEST_PATH or len(scope["query_string"]) > LONGEST_QUERY:
            return _refuse(scope, 414, "the path is too long")
        return None

    def _admission(self, scope: Scope) -> Response | None:
        """Take the token out of the first page's address; refuse whoever has none."""
        headers = Headers(scope=scope)
        handed = handed_in(scope["query_string"]) if scope["path"] == "/" else None
        if handed is not None:
            token = next((token for token in self._tokens() if is_token(handed, token)), None)
            if token is None:
                return _refuse(scope, 401, _NO_TOKEN)
            # Where the page is: what follows # in the address is kept by the browser.
            cookie = {"set-cookie": cookie_of(headers, token), "cache-control": "no-store"}
            return RedirectResponse("/", status_code=303, headers=cookie)
        if has_token(headers, self._token):
            note_admitted(scope)
        elif self._comment_token and has_token(headers, self._comment_token):
            note_admitted(scope)
            note_commenter(scope)
            if scope["method"] not in ("GET", "HEAD") and scope["path"] not in _OF_COMMENTERS:
                return _refuse(scope, 403, MAY_ONLY_COMMENT)
        elif _needs_token(scope):
            return _refuse(scope, 401, _NO_TOKEN)
        return None

    def _tokens(self) -> tuple[str, ...]:
        return (self._token, self._comment_token) if self._comment_token else (self._token,)

    def _is_ours(self, host: str, scope: Scope) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            name, _ = parts.hostname, parts.port  # reading the port refuses what is none
        except ValueError:
            return False
        if parts.netloc != host or "@" in host or not name:
            return False
        server = scope.get("server")
        return name in self._allowed_hosts or (server is not None and _is_same_address(name, server[0]))

    def _is_own_page(self, headers: Headers) -> bool:
        """Whether Origin is ours, where it is sent; for names given also by TLS, which a proxy ends."""
        origin, host = headers.get("origin"), headers.get("host", "")
        if origin is None or origin == f"http://{host}":
            return True
        return origin == f"https://{host}" and urlsplit(f"//{host}").hostname in self._given_hosts


def _is_same_address(name: str, local: str) -> bool:
    try:
        return ip_address(name) == ip_address(local.partition("%")[0])
    except ValueError:  # one of them is a name
        return False


def _is_same_site(headers: Headers) -> bool:
    if headers.get("sec-fetch-site", "same-origin") in ("same-origin", "none"):
        return True
    return headers.get("sec-fetch-mode") == "navigate" and headers.get("sec-fetch-dest") == "document"


def _is_api(scope: Scope) -> bool:
    return bool(scope["path"].startswith("/api/"))


def _needs_token(scope: Scope) -> bool:
    """All but the application itself, which is the same for everybody."""
    return scope["path"].split("/")[1:2] in (["plan"], ["api"])


def _body_refusal(scope: Scope, headers: Headers) -> Response | None:
    """Go by the length stated: h11 hands on no more than that."""
    if "transfer-encoding" in headers:
        return _refuse(scope, 413, "body of unknown length; send content-length")
    length = headers.get("content-length", "0")
    if length == "0":
        return None
    if scope["method"] != "POST":
        return _refuse(scope, 413, "got a request body, expected none")
    most = LARGEST_OF_PATH.get(scope["path"], LARGEST_BODY_BYTES)
    if not (length.isascii() and length.isdecimal()) or int(length[:20]) > most:
        return _refuse(scope, 413, f"the body has {length[:20]} bytes, expected at most {most}")
    expected = "image/jpeg" if scope["path"] == PHOTOS else "application/json"
    if headers.get("content-type", "").partition(";")[0].strip().lower() != expected:
        return _refuse(scope, 415, f"content type of the body: expected {expected}")
    return None


def _refuse(scope: Scope, status: int, reason: str, headers: dict[str, str] | None = None) -> Response:
    if _is_api(scope):
        return JSONResponse({"message": reason}, status_code=status, headers=headers)
    return PlainTextResponse(reason + "\n", status_code=status, headers=headers)

"""The token of one start of the server: who opens the address that was printed may read the plan, and nobody else.

There may be a second one, of those who may comment and no more (`viewer_web.server.roles`). Both may be kept for
further starts (`viewer_web.server.shared_links`).

The first page gets it in its address, hands it in, and gets a cookie instead, so that it stays in no history and in no
link that somebody shares. Programs send it as a header.
"""

import hmac
import secrets
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers

HEADER = "x-tlsplan-token"
QUERY = "token"


def new_token() -> str:
    """Return a token that nobody guesses: 256 random bits."""
    return secrets.token_urlsafe(32)


def has_token(headers: Headers, token: str) -> bool:
    """Whether a request has the token, in its header or in our cookie."""
    return _same(headers.get(HEADER, ""), token) or _same(_cookie(headers), token)


def handed_in(query_string: bytes) -> str | None:
    """Return the token in an address; None where there is none."""
    try:
        values = parse_qs(query_string.decode("ascii"), max_num_fields=8).get(QUERY)
    except ValueError:
        return None
    return values[0] if values else None


def is_token(text: str, token: str) -> bool:
    """Whether `text` is the token; takes as long where it nearly is."""
    return _same(text, token)


def cookie_of(headers: Headers, token: str) -> str:
    """Return the `Set-Cookie` header that keeps the token in the browser until it is closed."""
    return f"{_cookie_name(headers)}={token}; Path=/; HttpOnly; SameSite=Strict"


def _cookie(headers: Headers) -> str:
    name = _cookie_name(headers)
    for line in headers.getlist("cookie"):
        for part in line.split(";"):
            try:
                found = SimpleCookie(part.strip()).get(name)
            except CookieError:  # somebody else's
                continue
            if found is not None:
                return found.value
    return ""


def _cookie_name(headers: Headers) -> str:
    """Browsers share cookies among the ports of a host: two servers on one machine need two names."""
    port = headers.get("host", "").rpartition(":")[2]
    return f"tlsplan-{port if port.isdecimal() else 'token'}"


def _same(text: str, token: str) -> bool:
    return hmac.compare_digest(text.encode(), token.encode())

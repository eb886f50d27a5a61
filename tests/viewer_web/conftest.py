"""A small plan folder, a built application beside it, and a client that sends paths exactly as they are written."""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from oldest_plan import link, oldest_plan, station
from starlette.applications import Starlette

from viewer_web.server.app import create_app

Ask = Callable[..., httpx.Response]
TOKEN = "the-token-of-these-tests"

PLAN = oldest_plan(
    site={"settled": [
        {"id": "S003", "role": "locked", "position": [500003.0, 4000002.0, 101.5], "floor": "F0",
         "instrument_height_m": 1.5, "radius_m": None}
    ]},
    stations=[
        station(name, "F0", x, [500000.0 + x, 4000002.0, 101.5], fixed=name == "S002")
        for x, name in enumerate(("S001", "S002", "S003"), start=1)
    ],
    registration={"threshold": 0.3, "connected": True, "links": [link("S001", "S002"), link("S002", "S003")]},
)  # fmt: skip


def write_app(root: Path) -> Path:
    folder = root / "dist"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><title>viewer</title>")
    (folder / "assets" / "index-abc123.js").write_text("export const x = 1;\n" * 200)
    return folder


def write_plan(root: Path) -> Path:
    folder = root / "plan"
    for name in ("viewer/clouds", "report", "stage"):
        (folder / name).mkdir(parents=True)
    (folder / "plan.json").write_text(json.dumps(PLAN))
    (folder / "viewer" / "clouds" / "S001.u16").write_bytes(bytes(range(256)))
    (folder / "viewer" / ".draft").write_text("hidden")
    (folder / "report" / "index.html").write_text("<style>b{color:red}</style><b>report</b>")
    (folder / "stage" / "building.usdc").write_text("not for the browser")
    (root / "secret.txt").write_text("secret")
    return folder


@pytest.fixture
def built_app(tmp_path: Path) -> Path:
    return write_app(tmp_path)


@pytest.fixture
def plan_folder(tmp_path: Path) -> Path:
    return write_plan(tmp_path)


@pytest.fixture
def app(plan_folder: Path, built_app: Path) -> Starlette:
    return create_app(plan_folder, token=TOKEN, built_app=built_app)


@pytest.fixture
def ask(app: Starlette) -> Ask:
    """Return a function (path, method, headers, **more) -> response of the application at 127.0.0.1:8000."""
    return lambda *arguments, **named: send(app, *arguments, **named)


def send(
    app: Starlette,
    path: str,
    method: str = "GET",
    headers: dict[str, str] | None = None,
    content: bytes | None = None,
    *,
    token: str | None = TOKEN,
    body: Any = None,
) -> httpx.Response:
    """One request, its path as it is written; `body` is sent as JSON."""
    told = {} if token is None else {"x-tlsplan-token": token}
    if body is not None:
        content, told = json.dumps(body).encode(), {**told, "content-type": "application/json"}

    async def exchange() -> httpx.Response:
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8000") as client:
            request = client.build_request(method, "/", headers={**told, **(headers or {})}, content=content)
            request.url = request.url.copy_with(raw_path=path.encode())
            return await client.send(request)

    return asyncio.run(exchange())

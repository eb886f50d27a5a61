"""A small plan folder, a built application beside it, and a client that sends paths exactly as they are written."""

import asyncio
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from viewer_web.server import create_app

Ask = Callable[..., httpx.Response]


@pytest.fixture
def built_app(tmp_path: Path) -> Path:
    folder = tmp_path / "dist"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><title>viewer</title>")
    (folder / "assets" / "index-abc123.js").write_text("export const x = 1;\n" * 200)
    return folder


@pytest.fixture
def plan_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "plan"
    for name in ("viewer/clouds", "report", "stage"):
        (folder / name).mkdir(parents=True)
    (folder / "plan.json").write_text('{"schema": "tlsplan/plan/1"}')
    (folder / "viewer" / "clouds" / "S001.u16").write_bytes(bytes(range(256)))
    (folder / "viewer" / ".draft").write_text("hidden")
    (folder / "report" / "index.html").write_text("<style>b{color:red}</style><b>report</b>")
    (folder / "stage" / "building.usdc").write_text("not for the browser")
    (tmp_path / "secret.txt").write_text("secret")
    return folder


@pytest.fixture
def ask(plan_folder: Path, built_app: Path) -> Ask:
    """Return a function (path, method, headers, **more) -> response of the application at 127.0.0.1:8000."""
    app = create_app(plan_folder, built_app=built_app)

    def send(
        path: str, method: str = "GET", headers: dict[str, str] | None = None, content: bytes | None = None
    ) -> httpx.Response:
        async def exchange() -> httpx.Response:
            transport = httpx.ASGITransport(app=app)
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8000") as client:
                request = client.build_request(method, "/", headers=headers, content=content)
                request.url = request.url.copy_with(raw_path=path.encode())
                return await client.send(request)

        return asyncio.run(exchange())

    return send

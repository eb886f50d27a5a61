"""Serves the built viewer and one plan folder, read-only, to a browser on the same machine."""

from viewer_web.server.app import create_app
from viewer_web.server.run import serve

__all__ = ["create_app", "serve"]

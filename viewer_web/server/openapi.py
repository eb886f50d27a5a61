"""The document that describes the interface, as a file: `python -m viewer_web.server.openapi FILE`.

viewer_web/src/api/openapi.json is that file: the viewer's types are generated from it, and a test keeps it in step.
"""

import json
import sys
from pathlib import Path

from viewer_web.server.app import create_api
from viewer_web.server.serve import drawing_side, exports_side, live_side, runs_side
from viewer_web.server.session import Session


def openapi_text() -> str:
    """Return the document of all routes, as text of a file."""
    session = Session(Path())
    document = create_api(
        session, [side(session).router for side in (live_side, runs_side, exports_side, drawing_side)]
    ).openapi()
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(openapi_text(), encoding="utf-8")

"""Lets the tests of this folder import the module that lies beside them."""

import sys
from pathlib import Path

_FOLDER = str(Path(__file__).parent)
sys.path.insert(0, _FOLDER)
try:
    import tiny_instances  # noqa: F401 - from here on it is known by its name
finally:
    sys.path.remove(_FOLDER)

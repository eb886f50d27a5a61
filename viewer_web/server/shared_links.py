"""Where `tlsplan view --keep-links` answers: kept from start to start, so that links that were shared still work.

One small JSON file per plan folder, in the folder `links` of the user's cache folder, named by a hash of the plan
folder's path. It holds the two tokens (`viewer_web.server.token`): who can read it has all that these allow. It is
written with no permission for others, in a folder without any, and what others could have read or written is not used.
Delete the file, and the next start makes new addresses.
"""

import errno
import json
import os
import re
import stat
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner_core.cache import kept_file, no_folder
from planner_core.operating_system import NO_FOLLOW, is_open_to_others, is_own, sync
from planner_core.plan_folder.atomic import staged_file

SCHEMA = "tlsplan/links/1"
FOLDER = "links"
_TOKEN = re.compile(r"[A-Za-z0-9_-]{43,128}")
_LARGEST_BYTES = 64 * 1024
_KEYS = {"schema", "plan", "host", "port", "token", "comment_token"}


@dataclass(frozen=True)
class SharedLinks:
    """What the addresses of a plan are made of. Tokens are left out of its `repr`, which may end up in a log.

    host : as given to `serve`, which a wildcard is too. port : 1 to 65535.
    """

    host: str
    port: int
    token: str = field(repr=False)
    comment_token: str = field(repr=False)


def file_of_links(plan_folder: Path) -> Path:
    """Return where the links of a plan folder are kept, whether they are there or not.

    Raises
    ------
    RequirementError
        The environment names no cache folder.
    """
    file = kept_file("view", {"plan": os.fsencode(plan_folder.resolve()).hex()})  # a path may be no text
    if file is None:
        raise no_folder()
    return file.parent / FOLDER / file.name


def found_links(plan_folder: Path, on_warning: Callable[[str], None]) -> SharedLinks | None:
    """Return the links that were kept for a plan folder; None where there are none, or they can't be trusted.

    on_warning : gets one line where they are there and can't be trusted.

    Raises
    ------
    RequirementError
        As `file_of_links`.
    """
    file = file_of_links(plan_folder)
    try:
        return _read(file, plan_folder)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        reason = f"one that can't be read ({error.strerror})"
    except ValueError as error:
        reason = str(error)
    on_warning(
        f"kept links {file}: got {reason}, expected a file as tlsplan writes it, that only you can read; it is not "
        "used: this start has new addresses, send those to whom you sent the old ones"
    )
    return None


def keep(plan_folder: Path, links: SharedLinks) -> None:
    """Write the links of a plan folder, whole or not at all, for nobody but the user to read.

    Raises
    ------
    OSError
        The folder can't be made or written, belongs to somebody else, or is on a file system without permissions.
    RequirementError
        As `file_of_links`.
    """
    file = file_of_links(plan_folder)
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = file.parent.lstat()
    if not stat.S_ISDIR(status.st_mode) or not is_own(status):
        raise PermissionError(errno.EPERM, "its folder is a link, or belongs to another user", str(file.parent))
    if is_open_to_others(status):
        file.parent.chmod(0o700)
    document = {
        "schema": SCHEMA,
        "plan": str(plan_folder.resolve()),  # for people: which file is whose
        "host": links.host,
        "port": links.port,
        "token": links.token,
        "comment_token": links.comment_token,
    }
    with staged_file(file) as staging:
        handle = os.open(staging, os.O_WRONLY | os.O_CREAT | os.O_EXCL | NO_FOLLOW, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            if is_open_to_others(os.fstat(handle)):  # before there is a token in it
                raise PermissionError(errno.EPERM, "its file system keeps no permissions", str(file))
            stream.write(json.dumps(document, indent=2) + "\n")
        sync(staging)


def _read(file: Path, plan_folder: Path) -> SharedLinks:
    """Return the links in a file; raises OSError, or ValueError with what the file is instead."""
    folder = file.parent.lstat()
    if not stat.S_ISDIR(folder.st_mode) or not is_own(folder):
        raise ValueError("one in a folder that is a link, or belongs to another user")
    if is_open_to_others(folder):
        raise ValueError("one in a folder that is open to other users")
    if not stat.S_ISREG(file.lstat().st_mode):
        raise ValueError("what is no file")
    with os.fdopen(os.open(file, os.O_RDONLY | NO_FOLLOW), "rb") as stream:
        status = os.fstat(stream.fileno())
        if not is_own(status):
            raise ValueError("one of another user")
        if is_open_to_others(status):
            raise ValueError("one that is open to other users")
        text = stream.read(_LARGEST_BYTES)
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError):
        document = None
    schema = document.get("schema") if isinstance(document, dict) else None
    if isinstance(schema, str) and schema != SCHEMA:
        raise ValueError("one of another version of tlsplan")
    if schema is None or not _is_sound(document) or document["plan"] != str(plan_folder.resolve()):
        raise ValueError("a damaged one")
    return SharedLinks(document["host"], document["port"], document["token"], document["comment_token"])


def _is_sound(document: dict[str, Any]) -> bool:
    if set(document) != _KEYS or not isinstance(document["host"], str) or type(document["port"]) is not int:
        return False
    tokens = (document["token"], document["comment_token"])
    if not all(isinstance(token, str) and _TOKEN.fullmatch(token) for token in tokens):
        return False
    return 0 < document["port"] <= 65535 and tokens[0] != tokens[1]

"""Results of an earlier fix whose runs are those of today's to the last bit.

The folder of the results says in a file that they are; a validation test compares dumps of both.
"""

from __future__ import annotations

import tomllib
from collections.abc import Container
from pathlib import Path

from .errors import WorkflowError
from .provenance import code

FILE = "same_runs.toml"


def as_good_as_todays(results: Path) -> Container[str]:
    """Return the hashes of the sources of fixes whose results in a folder are those of today's fix.

    Parameters
    ----------
    results : folder with a file `same_runs.toml`, whose `made_by` is the hash of the sources of the
        fix that made its results, and whose `same` holds the hashes of fixes with the same runs;
        without the file there are none

    Raises WorkflowError with one line if the file is not as it must be.
    """
    file = results / FILE
    if not file.is_file():
        return ()
    try:
        content = tomllib.loads(file.read_text())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise WorkflowError(f"{file}: cannot be read: {error}") from None
    made_by, same = content.get("made_by"), content.get("same")
    if not isinstance(made_by, str) or not isinstance(same, list):
        raise WorkflowError(f"{file}: made_by must be a hash of sources, and same a list of hashes")
    return (made_by,) if code()["sources"] in same else ()

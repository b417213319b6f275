"""The version of the code with the commit that it is of: 0.2.0+g1a2b3c4d5e, or ....modified.

scikit-build-core asks `dynamic_metadata` for it when the package is built, and the program asks
`version_now` where it runs from a clone of the repository, whose files may have changed since.
Nothing but the standard library is imported: at the time of a build there is nothing else.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PROJECT = "pyproject.toml"
# So many digits of a commit tell it from all others of a repository [git's own default is 7].
DIGITS = 10
UNKNOWN, MODIFIED = "unknown", "modified"


def commit_of(root: Path) -> str | None:
    """Return the commit of a clone, with .modified where a tracked file differs from it.

    Parameters
    ----------
    root : folder of the repository

    The result is None where the folder is no clone, or only lies inside of one.
    """
    top = _git(root, "rev-parse", "--show-toplevel")
    commit = _git(root, "rev-parse", f"--short={DIGITS}", "HEAD")
    if top is None or commit is None or Path(top).resolve() != root.resolve():
        return None
    changed = _git(root, "status", "--porcelain", "--untracked-files=no")
    return commit if changed == "" else f"{commit}.{MODIFIED}"


def version_of(root: Path, release: str) -> str:
    """Return the version of a source tree.

    Parameters
    ----------
    root : folder of the source tree
    release : version of the release that it will be, or is
    """
    # An unpacked source distribution has no commits; its version was written when it was made.
    unpacked = root / "PKG-INFO"
    if unpacked.is_file():
        for line in unpacked.read_text(encoding="utf-8").splitlines():
            if line.startswith("Version:"):
                return line.partition(":")[2].strip()
    commit = commit_of(root)
    return f"{release}+{UNKNOWN if commit is None else f'g{commit}'}"


def version_now(installed: str) -> str:
    """Return the version of the code that runs.

    Parameters
    ----------
    installed : version of the installed package

    In a development environment the package is linked to a clone, whose present commit counts.
    """
    root = Path(__file__).resolve().parents[2]
    if not (root / PROJECT).is_file():
        return installed
    return version_of(root, installed.partition("+")[0])


def dynamic_metadata(settings: Mapping[str, Any], project: Mapping[str, Any]) -> dict[str, str]:
    """Return the version to scikit-build-core, which asks for it in the folder of the sources."""
    return {"version": version_of(Path.cwd(), str(settings["release"]))}


def _git(root: Path, *arguments: str) -> str | None:
    """Return what git prints; None where there is no git, no repository, or it fails."""
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=root, capture_output=True, text=True, check=False, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None

"""What the commands of README.md leave in a clone is no change of it: .gitignore knows it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import OUT, find_deck
from lammps_inelastic.workflow.shipped import DECKS

ROOT = Path(__file__).parents[2]
# An unpacked archive is no repository, and git knows nothing of it.
of_a_clone = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no clone: nothing is ignored")


def left_by_commands() -> list[str]:
    """Return the folders that README.md and the decks name, and files in the clone itself."""
    folders = re.findall(r"(?:--out|-var out) ([\w-]+)", (ROOT / "README.md").read_text())
    folders += [str(find_deck(name, Path()).variables[OUT]) for name in DECKS]
    folders += re.findall(r"shell mkdir (\w+)", (ROOT / "inputs" / "minimal.in").read_text())
    files = ["log.lammps", "report.html", "my-study.toml", "mine.in"]
    return [*sorted({f"{folder}/" for folder in folders}), *files]


def test_the_commands_leave_something() -> None:
    assert {"out/", "minimal/", "gluey/", "response/", "settling/"} <= {*left_by_commands()}


@of_a_clone
@pytest.mark.parametrize("name", left_by_commands())
def test_git_ignores_what_a_command_leaves(name: str) -> None:
    found = subprocess.run(["git", "check-ignore", "--quiet", name], cwd=ROOT)
    assert found.returncode == 0


@of_a_clone
def test_git_ignores_no_file_that_belongs_to_the_repository() -> None:
    command = ["git", "ls-files", "--cached", "--ignored", "--exclude-standard"]
    assert subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout == b""

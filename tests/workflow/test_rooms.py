"""Imports of Python and includes of C++: they close no circle, and analysis stands alone."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = "lammps_inelastic"
ROOMS = ("analysis", "workflow")


def name_of(path: Path) -> str:
    """Return the name of a module, without that of the package around both rooms."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))}


def imports_in(text: str, module: str, *, is_package: bool = False) -> Iterator[str]:
    """Return the modules of both rooms that a module imports, anywhere in it.

    An import inside a function, or for type checking alone, is an arrow like any other.
    """
    inside = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            wanted = [alias.name.removeprefix(f"{PACKAGE}.") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = (node.module or "").removeprefix(f"{PACKAGE}.").split(".")
            if node.level:
                above = inside[: len(inside) - node.level + 1]
                base = [*above, *(base if node.module else [])]
            start = ".".join(base)
            # What is imported from a package may be a module of it.
            inner = [f"{start}.{alias.name}" for alias in node.names]
            wanted = [name if name in MODULES else start for name in inner]
        else:
            continue
        yield from (name for name in wanted if name in MODULES and name != module)


def circle_in(arrows: Mapping[str, set[str]]) -> list[str]:
    """Return the modules of a circle of imports, the first one again at the end; [] if none is."""
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def includes() -> dict[str, set[str]]:
    """Return what each C++ room (a header with the source of that name) includes of other rooms."""
    paths = [path for ending in ("h", "cpp") for path in (ROOT / "src_fix").rglob(f"*.{ending}")]
    rooms: dict[str, set[str]] = {path.stem: set() for path in paths}
    for path in paths:
        named = re.findall(r'^#include "(\w+)\.h"', path.read_text(), re.M)
        rooms[path.stem].update(name for name in named if name in rooms and name != path.stem)
    return rooms


def folder_of(module: str) -> str:
    """Return the folder of a module that is in a folder of the workflow; else the module itself."""
    outer = ".".join(module.split(".")[:2])
    is_folder = outer.startswith("workflow.") and (ROOT / outer.replace(".", "/")).is_dir()
    return outer if is_folder else module


@pytest.fixture(scope="module")
def arrows() -> dict[str, set[str]]:
    return {
        name: set(imports_in(path.read_text(), name, is_package=path.name == "__init__.py"))
        for name, path in MODULES.items()
    }


def test_no_circle_of_imports(arrows: dict[str, set[str]]) -> None:
    assert {"workflow.main", "workflow.cli.look", "analysis.packing"} <= arrows.keys()
    assert "workflow.cli.command_line" in arrows["workflow.main"]
    assert "workflow.cli.look" in arrows["workflow.cli.command_line"]
    assert "analysis" in arrows["workflow.results.measure"]
    circle = circle_in(arrows)
    assert not circle, f"a circle of imports: {' -> '.join(circle)}"


def test_no_circle_of_folders(arrows: dict[str, set[str]]) -> None:
    """A folder of the workflow knows nothing of those that know it."""
    folders: dict[str, set[str]] = {}
    for name, to in arrows.items():
        folders.setdefault(folder_of(name), set()).update(map(folder_of, to))
    for name, to in folders.items():
        to.discard(name)
    assert {"workflow.running", "workflow.results", "workflow.provenance"} <= folders.keys()
    assert "workflow.results" in folders["workflow.running"]
    circle = circle_in(folders)
    assert not circle, f"a circle of folders: {' -> '.join(circle)}"


def test_analysis_imports_nothing_of_the_workflow(arrows: dict[str, set[str]]) -> None:
    wrong = {
        name: sorted(one for one in to if one.split(".")[0] == "workflow")
        for name, to in arrows.items()
        if name.split(".")[0] == "analysis"
    }
    assert {name: to for name, to in wrong.items() if to} == {}


def test_no_subcommand_is_imported_but_by_the_command_line(arrows: dict[str, set[str]]) -> None:
    rooms = {"workflow.cli.arguments", "workflow.cli.command_line", "workflow.cli"}
    subcommands = {name for name in arrows if name.startswith("workflow.cli.")} - rooms
    assert len(subcommands) >= 10
    importing = {name: sorted(to & subcommands) for name, to in arrows.items() if to & subcommands}
    assert importing == {"workflow.cli.command_line": sorted(subcommands)}


def private_names_in(text: str) -> list[str]:
    """Return the names with an underscore that a module imports from another one."""
    return [
        alias.name
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name.startswith("_") and not alias.name.startswith("__")
    ]


def test_no_module_imports_private_names_of_another() -> None:
    assert private_names_in("from ._core import a, _b\nfrom c import __version__") == ["_b"]
    found = {name: private_names_in(path.read_text()) for name, path in MODULES.items()}
    assert {name: private for name, private in found.items() if private} == {}


def test_both_ways_to_run_cases_share_one_module(arrows: dict[str, set[str]]) -> None:
    ways = "workflow.running.launch", "workflow.running.mpi_route"
    assert all("workflow.running.one_case" in arrows[way] for way in ways)
    assert not any(other in arrows[way] for way in ways for other in ways)


def test_a_command_starts_without_what_only_some_need() -> None:
    """Each of these takes a fifth of a second to import; SciPy loads its parts when used."""
    heavy = (
        "MDAnalysis",
        "matplotlib",
        "networkx",
        "freud",
        "scipy.spatial",
        "scipy.stats",
        "jinja2",
    )
    script = f"import sys, {PACKAGE}.workflow.main; print(*(set({heavy}) & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from .store import Result", ["workflow.results.store"]),
        ("from . import store, schema", ["workflow.results.store", "workflow.results.schema"]),
        ("from ...analysis.packing import Cover", ["analysis.packing"]),
        ("from ..files import whole", ["workflow.files"]),
        ("def f():\n    from lammps_inelastic.workflow import files", ["workflow.files"]),
        ("if TYPE_CHECKING:\n    import lammps_inelastic.analysis.bodies", ["analysis.bodies"]),
        ("from lammps_inelastic.analysis import packing_fraction", ["analysis"]),
        ("import numpy\nfrom pathlib import Path", []),
    ],
)
def test_imports_are_seen_in_every_form(text: str, found: list[str]) -> None:
    assert list(imports_in(text, "workflow.results.measure")) == found


def test_a_circle_is_seen() -> None:
    circle = circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})
    assert len(circle) == 4
    assert circle[0] == circle[-1]


def test_no_circle_of_includes() -> None:
    rooms = includes()
    assert len(rooms) > 60
    assert sum(map(len, rooms.values())) > 2 * len(rooms)
    circle = circle_in(rooms)
    assert not circle, f"a circle of includes: {' -> '.join(circle)}"

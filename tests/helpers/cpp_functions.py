"""Finds the functions of C++ sources by their names, and gives them other bodies.

In which file and line a function stands, how it is laid out and in which namespace it is makes no
difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path

import tree_sitter_cpp
from tree_sitter import Language, Node, Parser

_CLASSES = ("class_specifier", "struct_specifier")


def functions(source: bytes) -> Iterator[tuple[str, slice]]:
    """Yield each function that a source defines, and the place of its body, braces included.

    The name of a member is `Class::name`, inside of the class and outside.
    """
    tree = Parser(Language(tree_sitter_cpp.language())).parse(source)
    nodes = [tree.root_node]
    while nodes:
        node = nodes.pop()
        nodes += node.children
        body = node.child_by_field_name("body")
        if node.type == "function_definition" and body is not None:
            yield _name(node), slice(body.start_byte, body.end_byte)


def _name(definition: Node) -> str:
    # What a function returns may wrap its declarator: `double *Class::name() const`.
    node = definition
    while True:
        inner = node.child_by_field_name("declarator")
        inner = inner or next((c for c in node.children if c.type.endswith("_declarator")), None)
        if inner is None:
            break
        node = inner
    own = _text(node).split("::")
    return "::".join([*islice(_classes_around(definition), 1 if len(own) == 1 else 0), *own[-2:]])


def _classes_around(node: Node) -> Iterator[str]:
    while (parent := node.parent) is not None:
        name = parent.child_by_field_name("name")
        if parent.type in _CLASSES and name is not None:
            yield _text(name)
        node = parent


def _text(node: Node) -> str:
    return (node.text or b"").decode()


def give_bodies(folder: Path, bodies: Mapping[str, str]) -> None:
    """Give functions in the C++ files of a folder other bodies.

    Parameters
    ----------
    folder : its files, at any depth, are written anew
    bodies : statements for each function; all that have its name get them

    Raises LookupError: no function has the name.
    """
    missing = set(bodies)
    for path in [*folder.rglob("*.h"), *folder.rglob("*.cpp")]:
        source = path.read_bytes()
        found = [(place, name) for name, place in functions(source) if name in bodies]
        # From the end, so that the places before stay.
        for place, name in sorted(found, key=lambda one: one[0].start, reverse=True):
            body = f"{{ {bodies[name]} }}".encode()
            source = source[: place.start] + body + source[place.stop :]
        if found:
            path.write_bytes(source)
        missing -= {name for _, name in found}
    if missing:
        names = ", ".join(sorted(missing))
        raise LookupError(f"{folder.name} defines no function {names}: what is its name now?")

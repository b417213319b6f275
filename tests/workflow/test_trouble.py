"""The page on messages has them as the sources say them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from tests.workflow.test_links import ROOT

PAGE = ROOT / "docs" / "trouble.md"
LITERAL = r'"(?:[^"\\\n]|\\.)*"'
ADJACENT = re.compile(rf"{LITERAL}(?:\s*{LITERAL})*")


def texts_of_cpp() -> Iterator[str]:
    """Return the string literals of the C++ sources, those that follow one another as one."""
    for path in sorted((ROOT / "src_fix").rglob("*.cpp")):
        for match in ADJACENT.finditer(path.read_text()):
            yield "".join(literal[1:-1] for literal in re.findall(LITERAL, match[0]))


def texts_of_python() -> Iterator[str]:
    """Return the strings of the Python sources, with {} for what is put into them."""
    for room in ("analysis", "workflow"):
        for path in sorted((ROOT / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.JoinedStr):
                    yield "".join(
                        str(part.value) if isinstance(part, ast.Constant) else "{}"
                        for part in node.values
                    )
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield node.value


def messages() -> list[str]:
    """Return the messages of the page: the pieces of code in the first column of its tables."""
    rows = re.findall(r"^\| (`.*?) \| ", PAGE.read_text(), re.M)
    return [message for row in rows for message in re.findall(r"`([^`]+)`", row)]


@pytest.fixture(scope="module")
def texts() -> list[str]:
    return [*texts_of_cpp(), *texts_of_python()]


def test_every_message_is_one_of_the_sources(texts: list[str]) -> None:
    found = messages()
    assert len(found) > 80
    placeholder = r"(?:\{[^{}]*\}|\S+)"
    unknown = []
    for message in found:
        words = re.escape(message).replace(r"\.\.\.", placeholder).replace(r"\ ", " ")
        if not any(re.search(words, text) for text in texts):
            unknown.append(message)
    assert unknown == []

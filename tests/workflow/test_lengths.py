"""No function is longer than a screen: 60 lines, with its head, its docstring and its comments."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST = 60
# These list what there is, one entry after the other: the arguments of a subcommand, the names that
# a compiled module gives to Python.
LISTS = {"add_parser", "NB_MODULE"}
# Whatever braces in here mean, they end no function.
NO_CODE = re.compile(
    r"//[^\n]*|/\*.*?\*/|R\"(\w*)\(.*?\)\1\"|\"(?:\\.|[^\"\\\n])*\"|(?<!\w)'(?:\\.|[^'\\])+'", re.S
)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
LABEL = re.compile(r"\b(?:public|private|protected)\s*:")
ATTRIBUTE = re.compile(r"__attribute__\s*\(\([^()]*(?:\([^()]*\))*[^()]*\)\)")
SCOPE = re.compile(r"\b(?:namespace|class|struct|enum|union|extern)\b[^(]*$")


def python_functions(text: str) -> Iterator[tuple[str, int]]:
    """Return the names of all functions, inner ones too, and how many lines they have."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno:
            yield node.name, node.end_lineno - node.lineno + 1


def cpp_functions(text: str) -> Iterator[tuple[str, int]]:
    """Return the names of functions and how many lines they have, by their braces.

    Functions are what has a body and parentheses before it, outside of other functions.
    """
    code = text
    for skipped in (NO_CODE, DIRECTIVE, LABEL):
        code = skipped.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), code)
    start = at = 0
    while match := re.compile(r"[{};]").search(code, at):
        at = match.end()
        head = code[start : match.start()].strip()
        if match[0] == "{" and not SCOPE.search(head):
            at = end_of_block(code, at)
            if "(" in head:
                first = at - len(code[start:at].lstrip())
                name = re.search(r"([\w:~]+)\s*\(", ATTRIBUTE.sub("", head))
                yield name[1] if name else head, code.count("\n", first, at) + 1
        start = at


def end_of_block(code: str, at: int) -> int:
    """Return where a block ends whose opening brace is before a place."""
    depth = 1
    for match in re.compile(r"[{}]").finditer(code, at):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            return match.end()
    return len(code)


def too_long(paths: Sequence[Path]) -> list[str]:
    """Return a line about each function that is longer than it may be."""
    found = []
    for path in paths:
        functions = python_functions if path.suffix == ".py" else cpp_functions
        found += [
            f"{path.relative_to(ROOT)}: {name}: {lines} lines"
            for name, lines in functions(path.read_text())
            if lines > MOST and name not in LISTS
        ]
    return found


def test_python_functions() -> None:
    paths = [path for room in ("analysis", "workflow") for path in (ROOT / room).rglob("*.py")]
    assert len(paths) > 150
    assert too_long(paths) == []


def test_cpp_functions() -> None:
    paths = [path for ending in ("cpp", "h") for path in (ROOT / "src_fix").rglob(f"*.{ending}")]
    assert len(paths) > 100
    assert too_long(paths) == []


def test_lines_are_counted_by_braces() -> None:
    """Of functions in classes and namespaces, of templates, with braces in words and in lists."""
    text = """
namespace n {
struct Point { double x = 0; };
const int LIST[] = {1, 2};
template <typename T>
__attribute__((always_inline)) inline T twice(T x)  // {
{
  if (x > 0) { return 2 * x; }
  return LIST[0];
}
class Room {
 public:
  Room(int a) : a_(a) {}
  const char *text() const
  { return "}{ \\" '"; /* } */ }
#define HALF(x) \\
  { (x) / 2 }
  char brace() { return '{'; }
};
}
int main() {

}
"""
    found = [("twice", 6), ("Room", 1), ("text", 2), ("brace", 1), ("main", 3)]
    assert list(cpp_functions(text)) == found


def test_lines_of_python_are_counted() -> None:
    text = "class A:\n    def f(\n        self,\n    ):\n        def g(): ...\n\n        return g\n"
    assert dict(python_functions(text)) == {"f": 6, "g": 1}

"""Links between the documents: each leads to a file that is there, and to a heading in it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Hidden folders and these hold what was installed or built.
BUILT = {"build", "dist"}
# A target in round brackets after a text in square ones, which may go on in the next line.
LINK = re.compile(
    r"\[(?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*\]\(\s*([^()\s]+(?:\([^()\s]*\)[^()\s]*)*)\s*\)"
)
FENCED = re.compile(r"^(```+|~~~+).*?^\1\s*$", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*\s*$", re.MULTILINE)


def documents() -> Iterator[Path]:
    """Return the Markdown files of the repository, seen from its root."""
    yield from (path.relative_to(ROOT) for path in sorted(ROOT.glob("*.md")))
    for folder in sorted(ROOT.iterdir()):
        if folder.is_dir() and not folder.name.startswith(".") and folder.name not in BUILT:
            yield from (path.relative_to(ROOT) for path in sorted(folder.rglob("*.md")))


def links_of(text: str) -> list[str]:
    """Return the targets of all links and images outside blocks and pieces of code."""
    prose = re.sub(r"(`+)(?!`).+?(?<!`)\1(?!`)", "code", FENCED.sub("", text))
    return LINK.findall(prose)


def anchors_of(text: str) -> set[str]:
    """Return the anchors of all headings, as GitHub makes them of the words."""
    anchors: set[str] = set()
    for heading in HEADING.findall(FENCED.sub("", text)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        count = 0
        while (unique := f"{anchor}-{count}" if count else anchor) in anchors:
            count += 1
        anchors.add(unique)
    return anchors


def broken_links(document: Path) -> list[str]:
    """Return the links of a document that lead to no file of the repository, or to no heading."""
    broken = []
    for link in links_of(document.read_text()):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = document.parent / name if name else document
        inside = target.resolve().is_relative_to(ROOT.resolve())
        if not (inside and target.exists()) or (
            anchor and anchor not in anchors_of(target.read_text())
        ):
            broken.append(link)
    return broken


@pytest.mark.parametrize("document", list(documents()), ids=str)
def test_links_lead_somewhere(document: Path) -> None:
    assert broken_links(ROOT / document) == []


def test_all_documents_are_looked_at() -> None:
    names = {str(path) for path in documents()}
    assert {"README.md", "results/README.md", "docs/reference/fix-inelastic.md"} <= names
    assert "results/README.md" in links_of((ROOT / "README.md").read_text())


def test_links_are_seen_in_every_form() -> None:
    text = (
        "[one](a.md), [two\nlines](b.md#c), ![image](d.png), [`code`](e.md), `[no](f.md)`\n"
        "```\n[no](g.md)\n```\n[none]"
    )
    assert links_of(text) == ["a.md", "b.md#c", "d.png", "e.md"]


def test_anchors_are_those_of_headings() -> None:
    text = (
        "# The HDF5 file\n## `spheres.in`\n```\n# no heading\n```\n"
        "## run start/stop, info\n## Run\n## Run\n"
    )
    assert anchors_of(text) == {
        "the-hdf5-file",
        "spheresin",
        "run-startstop-info",
        "run",
        "run-1",
    }


def test_a_broken_link_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    (tmp_path / "there.md").write_text("# Here\n")
    document = tmp_path / "links.md"
    document.write_text("[a](there.md#here) [b](there.md#not) [c](gone.md) [d](#e) [f](../g.md)")
    assert broken_links(document) == ["there.md#not", "gone.md", "#e", "../g.md"]

"""For the site: links that leave this folder lead to copies of what they name.

The pages link to files of the repository by relative paths, which serve wherever the repository is
read. MkDocs knows the files below docs alone. Each file that a page links to outside of docs gets a
copy in the folder `repository` of the site, as a page if it is one, and the links lead there.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
COPIES = "repository"
FENCED = r"^(?P<fence>```+|~~~+).*?^(?P=fence)\s*?$"
LINK = r"(?P<before>\]\(\s*)(?![a-z]+:|#)(?P<path>[^()\s#]+)(?P<after>(?:#[^()\s]*)?\s*\))"
FENCED_OR_LINK = re.compile(f"{FENCED}|{LINK}", re.MULTILINE | re.DOTALL)


def _place_in_site(path: Path) -> str:
    """Return where a file of the repository is in the site, seen from the site's sources."""
    if path.is_relative_to(DOCS):
        return path.relative_to(DOCS).as_posix()
    return f"{COPIES}/{path.relative_to(ROOT).as_posix()}"


def _targets(page: Path) -> list[Path]:
    """Return the files of the repository to which a page links."""
    found = FENCED_OR_LINK.finditer(page.read_text(encoding="utf-8"))
    paths = [(page.parent / match["path"]).resolve() for match in found if match["path"]]
    return [path for path in paths if path.is_file() and path.is_relative_to(ROOT)]


def _existing(entries: list[Any]) -> list[Any]:
    """Return the entries of a navigation whose pages are there."""
    kept: list[Any] = []
    for entry in entries:
        if isinstance(entry, dict):
            ((title, inside),) = entry.items()
            if isinstance(inside, list):
                inside = _existing(inside)
            elif not (DOCS / inside).is_file():
                inside = None
            if inside:
                kept.append({title: inside})
        elif (DOCS / entry).is_file():
            kept.append(entry)
    return kept


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Leave out of the navigation what is not written yet."""
    config.nav = _existing(config.nav or [])
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the copies, and those to which pages among them link."""
    seen: set[Path] = set()
    open_pages = [Path(str(file.abs_src_path)) for file in files.documentation_pages()]
    while open_pages:
        for target in _targets(open_pages.pop()):
            if target in seen or target.is_relative_to(DOCS):
                continue
            seen.add(target)
            files.append(File.generated(config, _place_in_site(target), abs_src_path=str(target)))
            if target.suffix == ".md":
                open_pages.append(target)
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Take each link to the place of its target in the site."""
    source = Path(str(page.file.abs_src_path)).resolve()
    here = Path(page.file.src_uri).parent.as_posix()

    def moved(match: re.Match[str]) -> str:
        if match["path"] is None:
            return match[0]
        target = (source.parent / match["path"]).resolve()
        if not target.is_relative_to(ROOT):
            return match[0]
        return match["before"] + os.path.relpath(_place_in_site(target), here) + match["after"]

    return FENCED_OR_LINK.sub(moved, markdown)

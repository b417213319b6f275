"""The site that `make docs` builds: every page is in it, and its links lead somewhere."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.workflow.test_links import ROOT

DOCS = ROOT / "docs"


def test_every_page_is_in_the_navigation() -> None:
    """Entries for pages that are not written yet are left out when the site is built."""
    named = re.findall(r"^ +- (?:[^:\n]+: )?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.M)
    assert len(set(named)) == len(named)
    pages = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")}
    assert len(pages) > 30
    assert pages - set(named) == set()


def build(folder: Path, site: Path) -> subprocess.CompletedProcess[str]:
    # An optional dependency: `make docs` installs it, and CI does so before the tests.
    pytest.importorskip("mkdocs")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(site)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_the_site_is_built(tmp_path: Path) -> None:
    """Without a warning, with the files outside of docs that pages link to; it needs no network."""
    done = build(ROOT, tmp_path / "site")
    assert done.returncode == 0, done.stdout + done.stderr
    site = tmp_path / "site"
    for page in DOCS.rglob("*.md"):
        assert (site / page.relative_to(DOCS)).with_suffix(".html").is_file(), page
    deck = site / "repository" / "inputs" / "spheres.in"
    assert deck.read_bytes() == (ROOT / "inputs" / "spheres.in").read_bytes()
    text = (site / "reference" / "fix-inelastic.html").read_text()
    assert 'href="../repository/inputs/spheres.in"' in text
    loaded = re.findall(r'<(?:script|img)[^>]*\bsrc="([^"]+)"', text)
    loaded += re.findall(r'<link[^>]*rel="(?:stylesheet|preload|icon)"[^>]*href="([^"]+)"', text)
    assert len(loaded) > 2
    assert [address for address in loaded if re.match(r"(?:https?:)?//", address)] == []


def test_a_broken_link_ends_the_build(tmp_path: Path) -> None:
    shutil.copytree(DOCS, tmp_path / "docs")
    shutil.copy(ROOT / "mkdocs.yml", tmp_path)
    (tmp_path / "docs" / "broken.md").write_text("# Broken\n\n[a](gone.md) [b](#gone)\n")
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode != 0
    assert "'broken.md' contains a link 'gone.md'" in done.stderr
    assert "'broken.md' contains a link '#gone'" in done.stderr

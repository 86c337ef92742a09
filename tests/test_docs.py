"""The Python blocks of README and docs run as they stand."""

import re
import warnings
from pathlib import Path

import pytest

import napari_issis as ni

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for number, code in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL)):
            marks = [pytest.mark.needs_gl] if "show(" in code else []
            yield pytest.param(code, id=f"{page.name}-{number}", marks=marks)


def test_there_are_blocks():
    assert len(list(blocks())) >= 3


@pytest.mark.parametrize("code", list(blocks()))
def test_block_runs(code, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    if "show(" in code:
        make = request.getfixturevalue("make_napari_viewer")
        show = ni.show
        monkeypatch.setattr(ni, "show", lambda *args: show(*args, viewer=make(show=True)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ni.CountRateWarning)
        exec(compile(code, "<documentation>", "exec"), {})


def test_links_and_pictures_exist():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"

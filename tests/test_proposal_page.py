"""The tables of docs/proposal.md are those that the program makes today."""

import importlib
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture
def module(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    yield importlib.import_module("proposal_tables")
    for name in ("proposal_tables", "instrument_tables"):
        sys.modules.pop(name, None)


def test_tables_are_not_stale(module):
    """If this fails: python docs/proposal_tables.py."""
    page = module.PAGE.read_text(encoding="utf-8")
    assert page.count("<!-- table: ") == len(module.TABLES)
    for name in module.TABLES:
        assert f"<!-- table: {name} -->\n| " in page
    assert module.filled(page, module.TABLES) == page

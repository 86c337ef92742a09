"""The tables of docs/instrument.md are those that the program makes today."""

import importlib.util
from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"


def tables():
    spec = importlib.util.spec_from_file_location(
        "instrument_tables", DOCS / "instrument_tables.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_tables_are_not_stale():
    """If this fails: python docs/instrument_tables.py."""
    module = tables()
    page = module.PAGE.read_text(encoding="utf-8")
    assert page.count("<!-- table: ") == len(module.TABLES)
    for name in module.TABLES:
        assert f"<!-- table: {name} -->\n| " in page
    assert module.filled(page) == page


def test_a_changed_number_is_noticed():
    module = tables()
    page = module.PAGE.read_text(encoding="utf-8")
    assert "0.0049" in page
    assert module.filled(page.replace("0.0049", "0.0050")) == module.filled(page)
    assert module.filled(page.replace("0.0049", "0.0050")) != page.replace("0.0049", "0.0050")

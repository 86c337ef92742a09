"""The tables of docs/instrument.md are those that the program makes today."""

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest

import napari_issis as ni

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


@pytest.mark.parametrize("name", ni.INSTRUMENTS)
def test_every_number_of_a_camera_is_on_the_page(name):
    """From the file as it stands, without our reader: value, status and source in one row."""
    page = tables().PAGE.read_text(encoding="utf-8").splitlines()
    file = Path(ni.__file__).parent / "instruments" / ni.INSTRUMENTS[name]
    content = tomllib.loads(file.read_text(encoding="utf-8"))
    groups = [content.get("all_channels", {}), *content["channels"].values()]
    groups += content.get("filters", {}).values()
    numbers = [(key, number) for group in groups for key, number in group.items()]
    assert len(numbers) >= 8
    for key, number in numbers:
        values = number["value"] if isinstance(number["value"], list) else [number["value"]]
        text = ", ".join(f"{value:.12g}" for value in values)
        told = f"| `{key}` | {text} | {number.get('unit', '')} | {number['status']} | "
        assert any(told in line and number["source"] in line for line in page), told


def test_the_camera_of_the_page_works(tmp_path, monkeypatch):
    """The file that users are shown, and what they are told to do with it."""
    page = tables().PAGE.read_text(encoding="utf-8")
    (camera,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (code,) = re.findall(r"```python balloon.toml\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    Path("balloon.toml").write_text(camera, encoding="utf-8")
    names = {}
    exec(compile(code, "<documentation>", "exec"), names)
    observation = names["exposure"].observation
    assert (observation.instrument.name, observation.pixel_scale) == ("Balloon", 0.5)
    assert observation.background_rate == pytest.approx(1e-3 * observation.transmittance)
    assert names["exposure"].expected.sum() > 0

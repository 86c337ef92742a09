from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path

from napari._app_model.constants import MenuId
from npe2 import PluginManifest

ROOT = Path(__file__).parents[2]


def manifest() -> PluginManifest:
    return PluginManifest.from_file(ROOT / "napari.yaml")


def test_every_command_is_declared_and_every_function_exists():
    """Catches references that npe2 accepts and napari drops silently."""
    contributions = manifest().contributions
    declared = {command.id for command in contributions.commands}
    used = [widget.command for widget in contributions.widgets]
    used += [sample.command for sample in contributions.sample_data]
    used += [writer.command for writer in contributions.writers]
    used += [reader.command for reader in contributions.readers]
    used += [item.command for items in contributions.menus.values() for item in items]
    assert set(used) == declared
    manifest().validate_imports()


def test_menus_are_ones_that_napari_shows():
    assert set(manifest().contributions.menus) <= set(MenuId.contributables())


def test_the_installed_manifest_is_this_one():
    """Catches an editable install that is older than napari.yaml: pip install -e . again."""
    installed = PluginManifest.from_distribution("napari-issis")
    assert installed.contributions == manifest().contributions
    assert installed.display_name == manifest().display_name


def test_the_entry_point_imports_nothing():
    """Catches a manifest inside the package, for which napari would import it at start."""
    (entry,) = entry_points(group="napari.manifest", name="napari-issis")
    assert entry.value == "napari_issis_manifest:napari.yaml"

"""The list of sources: sorting, selecting, editing, copying, pasting, files."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from napari.utils.colormaps.standardize_color import transform_color
from napari.utils.notifications import notification_manager
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QLineEdit
from small_scene import SMALL, few_sources
from test_scene_edit import assert_consistent

from napari_issis import image_source, random_sources, simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin.layer_styles import kind_color
from napari_issis.plugin.source_columns import COLUMNS, TEXTS, from_text, shown_values, to_text
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
PLACE = {column.name: place for place, column in enumerate(COLUMNS)}


@pytest.fixture
def listed(scene, qtbot):
    widget = SourceList(scene.viewer)
    qtbot.addWidget(widget)
    widget.show()
    qtbot.waitExposed(widget)
    notification_manager.records.clear()
    yield widget
    widget.hide()


def cell(listed, row, name):
    return listed.model.index(row, PLACE[name]).data()


def typed(listed, row, name, text):
    """Type into a cell as a user does, with the cell's own editor."""
    index = listed.model.index(row, PLACE[name])
    listed.view.setCurrentIndex(index)
    listed.view.edit(index)
    editor = listed.view.findChildren(QLineEdit)[-1]
    editor.selectAll()
    QTest.keyClicks(editor, text)
    QTest.keyClick(editor, Qt.Key.Key_Return)
    QApplication.processEvents()
    listed.refresh()


def test_it_shows_the_sources(listed):
    """Catches exchanged columns, and structure shown of a star."""
    shown = [listed.model.index(3, column).data() for column in range(8)]
    assert shown == ["sersic", "61.50", "20.25", "5e-15", "5", "0.200", "100.0", "2.5"]
    assert [cell(listed, 0, name) for name in ("r_half", "pa", "n")] == ["–", "–", "–"]
    # 4e-15 x 1.14e17 x 50
    assert float(cell(listed, 0, "counts")) == pytest.approx(2.28e4, rel=1e-3)
    assert listed.count.text() == "4 sources"


@pytest.mark.parametrize("name", [column.name for column in COLUMNS])
@pytest.mark.parametrize("order", [Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder])
def test_sorting(listed, name, order):
    """Catches text sorted in place of numbers, and missing values that come first."""
    listed.view.sortByColumn(PLACE[name], order)
    shown = [
        listed.model.index(row, PLACE[name]).data(Qt.ItemDataRole.EditRole) for row in range(4)
    ]
    values = shown if name in TEXTS else [float(value) for value in shown if value]
    assert values == sorted(values, reverse=order == Qt.SortOrder.DescendingOrder)
    assert all(value == "" for value in shown[len(values) :])
    assert sorted(listed.model.order) == [0, 1, 2, 3]


def test_the_column_of_images_is_there_with_an_image(scene, listed):
    """Catches an empty column beside the others, and one that stays hidden."""
    assert listed.view.isColumnHidden(PLACE["image"])
    assert not listed.view.isColumnHidden(PLACE["spectrum"])
    scene.add(image_source(np.ones((4, 5)), 20.0, 40.0, 2e-14, pixel_scale=0.036))
    listed.refresh()
    assert not listed.view.isColumnHidden(PLACE["image"])
    scene.undo()
    listed.refresh()
    assert listed.view.isColumnHidden(PLACE["image"])


def test_a_flux_typed_redraws_no_marks(scene, listed):
    """Catches positions written anew, a lost selection, features that lag behind."""
    points = scene.editor.points.layer
    drawn = []
    points.events.set_data.connect(lambda event: drawn.append(event))
    typed(listed, 0, "flux", "7e-15")
    assert drawn == []
    assert scene.sources["flux"][0].value == 7e-15
    assert points.features["flux"][0] == 7e-15
    assert points.selected_data == {0}
    typed(listed, 0, "x", "21")
    assert drawn
    assert_consistent(scene)


def test_a_kind_chosen_recolors_an_ellipse_that_stays(scene, listed):
    """Catches an ellipse in the colour of the kind that it was, as its outline is the same."""
    ellipses = scene.editor.ellipses.layer
    before = ellipses.edge_color.copy()
    corners = [corner.copy() for corner in ellipses.data]
    listed.model.setData(listed.model.index(2, 0), "uniform")
    assert np.array_equal(ellipses.data, corners)
    assert ellipses.edge_color[0] == pytest.approx(transform_color(kind_color("uniform"))[0])
    assert not np.allclose(ellipses.edge_color[0], before[0])
    assert np.array_equal(ellipses.edge_color[1], before[1])
    assert_consistent(scene)


def test_a_spectrum_typed_into_the_list(scene, listed):
    """Catches text cut to the width of the old one, lost by undo, drag and copies, or lightless."""
    long = "powerlaw(-1.5, z=0.5, at=2512.5)"
    typed(listed, 0, "spectrum", "blackbody(9000)")
    assert list(scene.sources["spectrum"]) == ["blackbody(9000)", "flat", "flat", "flat"]
    typed(listed, 1, "spectrum", long)
    assert cell(listed, 1, "spectrum") == long
    before = float(listed.model.values["counts"][0])
    table = scene.sources
    table["x"][0] += 1
    scene.change(table)
    listed.view.selectAll()
    listed.copy()
    listed.paste()
    assert list(scene.sources["spectrum"]) == 2 * ["blackbody(9000)", long, "flat", "flat"]
    scene.undo()
    scene.undo()
    scene.undo()
    assert list(scene.sources["spectrum"]) == ["blackbody(9000)", "flat", "flat", "flat"]
    scene.undo()
    assert "spectrum" not in scene.sources.colnames
    scene.redo()
    listed.refresh()
    # normalised over the band: as many counts until a filter comes in
    assert before == pytest.approx(2.28e4, rel=1e-3)
    typed(listed, 2, "spectrum", "powerlow(1)")
    assert "'powerlow(1)' is unknown" in notification_manager.records[-1].message
    assert cell(listed, 2, "spectrum") == "flat"
    assert_consistent(scene)


def test_a_spectrum_is_kept_by_the_layers(scene, listed, mouse):
    """Catches a drag or an edited feature of a layer that loses or cuts spectra."""
    typed(listed, 0, "spectrum", "line(2500 A, 10 A)")
    x, y = scene.sources["x"][0], scene.sources["y"][0]
    mouse.drag((x, y), (x + 3, y))
    assert scene.sources["x"][0] == pytest.approx(x + 3, abs=0.1)
    assert scene.sources["spectrum"][0] == "line(2500 A, 10 A)"
    layer = scene.editor.points.layer
    features = layer.features.copy()
    assert list(features["spectrum"]) == ["line(2500 A, 10 A)", "flat"]
    features.loc[1, "spectrum"] = "powerlaw(-2.25, z=0.5, at=2512.5)"
    layer.features = features
    assert scene.sources["spectrum"][1] == "powerlaw(-2.25, z=0.5, at=2512.5)"
    assert_consistent(scene)


def test_a_channel_without_light_is_refused(scene, listed, tmp_path):
    """Catches a scene that takes a channel in which it cannot be simulated."""
    path = tmp_path / "star.csv"
    path.write_text("wavelength_A,flux\n2000,1\n3000,1\n")
    typed(listed, 0, "spectrum", f"table({path})")
    with pytest.raises(ValueError, match=r"row 0, spectrum: table.* has no light in FUV, 1150 to"):
        scene.observation = scene.observation.replace(channel="FUV")
    assert scene.observation.channel == "NUV"


def test_selecting_here_and_there(scene, listed, mouse):
    """Catches rows of the sorted list taken for rows of the table, and loops of signals."""
    listed.view.sortByColumn(PLACE["y"], Qt.SortOrder.DescendingOrder)
    # by y: 50, 30, 20.25, 12.5, that is rows 1, 2, 3, 0
    listed.view.selectRow(0)
    assert scene.editor.points.layer.selected_data == {1}
    assert scene.editor.ellipses.layer.selected_data == set()
    listed.view.selectRow(2)
    assert scene.editor.points.layer.selected_data == set()
    assert scene.editor.ellipses.layer.selected_data == {1}
    mouse.drag((20.25, 12.5), (20.25, 12.5))
    assert listed.selected_ids() == [1]
    assert [index.row() for index in listed.view.selectionModel().selectedRows()] == [3]
    assert listed.count.text() == "4 sources, 1 selected"


def test_a_press_selects_on_both_layers(scene, listed, mouse):
    """Catches a selection on the other layer that stays: two layers act as one."""
    mouse.drag((60.0, 50.0), (60.0, 50.0))
    mouse.drag((40.0, 30.0), (40.0, 30.0))
    assert listed.selected_ids() == [3]


@pytest.mark.parametrize(
    ("row", "name", "text", "value"),
    [
        (0, "x", "33.25", 33.25),
        (2, "y", "1e1", 10.0),
        (1, "flux", "3e-15", 3e-15),
        (2, "r_half", "7.5", 7.5),
        (2, "ellipticity", "0", 0.0),
        (3, "pa", "-12", -12.0),
        (3, "n", "4", 4.0),
    ],
)
def test_editing_a_cell(scene, listed, row, name, text, value):
    """Catches an edit that misses the table, the layers or the image, and one that is no step."""
    typed(listed, row, name, text)
    expected = few_sources()
    unit = getattr(expected[name], "unit", None)
    expected[name][row] = value if unit is None else value * unit
    assert_consistent(scene)
    assert same_table(scene.sources, expected)
    assert np.array_equal(
        scene.counts.layer.data, simulate(expected, scene.observation, seed=scene.seed).counts
    )
    scene.undo()
    assert same_table(scene.sources, few_sources())


def test_editing_in_magnitudes_and_arcsec(scene, listed):
    """Catches a number taken in the wrong unit."""
    scene.units.flux, scene.units.length = "AB mag", "arcsec"
    listed.refresh()
    assert listed.model.headerData(PLACE["flux"], Qt.Orientation.Horizontal) == "F (AB mag)"
    typed(listed, 2, "flux", "20")
    typed(listed, 2, "r_half", "0.36")
    pivot = scene.observation.channel_data.pivot
    flux = 10 ** (-0.4 * (20 + 48.6)) * 2.99792458e18 / pivot**2
    assert scene.sources["flux"][2].value == pytest.approx(flux, rel=1e-12, abs=0)
    assert scene.sources["r_half"][2].value == pytest.approx(10.0, rel=1e-12, abs=0)
    assert cell(listed, 2, "flux") == "20"


@pytest.mark.parametrize(
    ("row", "name", "text", "reason"),
    [
        (0, "x", "nan", "must be a number"),
        (0, "x", "1,5", "without commas"),
        (0, "flux", "-1e-15", "must be in"),
        (2, "r_half", "0", "above 0"),
        (2, "ellipticity", "1", "in [0, 1)"),
        (3, "n", "9", "in [0.5, 8"),
    ],
)
def test_wrong_values_are_refused_in_the_cell(scene, listed, row, name, text, reason):
    """Catches a wrong value that is clipped or taken, and a refusal without a reason."""
    before = cell(listed, row, name)
    typed(listed, row, name, text)
    assert cell(listed, row, name) == before
    assert same_table(scene.sources, few_sources())
    assert reason in notification_manager.records[-1].message


def test_cells_that_do_not_apply_cannot_be_edited(listed):
    """Catches a radius typed for a star, and typed counts."""
    editable = Qt.ItemFlag.ItemIsEditable
    flags = [
        [bool(listed.model.flags(listed.model.index(row, place)) & editable) for place in range(10)]
        for row in (0, 2, 3)
    ]
    assert flags[0] == [True] * 4 + [False] * 6
    assert flags[1] == [True] * 7 + [False] * 3
    assert flags[2] == [True] * 8 + [False] * 2


def test_a_kind_is_changed_in_place(scene, listed):
    """Catches a source that is lost between the layers, or loses flux, place or identity."""
    ids = scene.editor.source_id.copy()
    for kind in ("uniform", "sersic", "point", "devaucouleurs"):
        assert listed.model.setData(listed.model.index(0, 0), kind)
        listed.refresh()
        assert_consistent(scene)
        table = scene.sources
        assert table["kind"][0] == kind
        assert (table["x"][0], table["y"][0], table["flux"][0].value) == (20.25, 12.5, 4e-15)
        assert np.array_equal(scene.editor.source_id, ids)
    assert same_table(scene.sources[1:], few_sources()[1:])


def test_editing_a_sorted_list_while_layers_change(scene, listed, mouse):
    """Catches an edit that goes to the row that was there before."""
    listed.view.sortByColumn(PLACE["x"], Qt.SortOrder.DescendingOrder)
    first = listed.model.ids_of([0])
    mouse.drag((20.25, 12.5), (25, 12.5), (75, 12.5))
    scene.wait()
    listed.refresh()
    assert listed.model.ids_of([0]) == [1] != first
    typed(listed, 0, "y", "5")
    assert scene.sources["y"][0] == 5.0


def test_copy_and_paste(scene, listed):
    """Catches digits lost on the way, and derived values taken for parameters."""
    scene.editor.select(scene.editor.source_id.tolist())
    listed.copy()
    text = QApplication.clipboard().text()
    assert text.splitlines()[0].startswith("kind\tx (px)\ty (px)\tF (erg/s/cm²/Å)\tR½ (px)")
    listed.paste()
    assert_consistent(scene)
    assert len(scene.sources) == 8
    copied, original = scene.sources[4:], few_sources()
    for name in ("kind", "x", "y", "flux", "n"):
        assert same_table(copied[[name]], original[[name]])
    assert len(listed.selected_ids()) == 4
    scene.undo()
    assert len(scene.sources) == 4


@pytest.mark.parametrize("flux", ["flux", "AB mag"])
@pytest.mark.parametrize("length", ["px", "arcsec"])
def test_text_carries_its_units(flux, length):
    """Catches text that is read in the units shown now in place of its own."""
    table = random_sources("sersic", 30, seed=4)
    units = Units(flux, length)
    text = to_text(shown_values(table, SMALL, units), range(30), units)
    back = from_text(text, SMALL, Units())
    for name in ("x", "y", "flux", "r_half", "ellipticity", "pa", "n"):
        a, b = (np.asarray(getattr(t[name], "value", t[name])) for t in (table, back))
        np.testing.assert_allclose(a, b, rtol=1e-13)


def test_text_of_a_spreadsheet():
    """Catches a heading taken for a source, order of columns that must be ours."""
    table = from_text("y;x;F (AB mag)\n3;4;21\n5;6;22\n", SMALL, Units())
    assert list(table["kind"]) == ["point", "point"]
    assert list(table["x"]) == [4.0, 6.0]
    ratio = (table["flux"][0] / table["flux"][1]).value
    assert ratio == pytest.approx(10**0.4)
    plain = from_text("exponential\t1\t2\t1e-15\t10\t0.3\t45\n", SMALL, Units())
    assert same_table(plain[["x", "y"]], source("exponential", 1, 2)[["x", "y"]])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no text to paste"),
        ("kind\tx\ty\n", "headings only"),
        ("kind\tx\ty\npoint\t1\t2\npoint\t1\tabc\n", "line 3 of the text: y is 'abc'"),
        ("point\t1\t2\t-1\n", "line 1 of the text, flux: -1 is not allowed"),
        ("quasar\t1\t2\t1e-15\n", "line 1 of the text, kind: 'quasar' is unknown"),
        ("point\t1\n", "line 1 of the text: y is missing"),
    ],
)
def test_text_that_is_no_list(scene, listed, text, reason):
    """Catches half of a wrong text pasted, and an error that does not say where."""
    QApplication.clipboard().setText(text)
    listed.paste()
    assert reason in notification_manager.records[-1].message
    assert same_table(scene.sources, few_sources())


def test_delete_key(scene, listed):
    listed.view.selectRow(1)
    listed.view.setFocus()
    listed.delete()
    assert same_table(scene.sources, few_sources()[[0, 2, 3]])
    assert_consistent(scene)


def test_files(scene, listed, tmp_path, monkeypatch):
    """Catches a file that is not what the list shows, and an import that is no step."""
    from qtpy.QtWidgets import QFileDialog

    path = tmp_path / "sources.ecsv"
    monkeypatch.setattr(QFileDialog, "exec", lambda self: True)
    monkeypatch.setattr(QFileDialog, "selectedFiles", lambda self: [str(path)])
    listed.save()
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *a: (str(path), ""))
    listed.load()
    assert len(scene.sources) == 8
    assert same_table(scene.sources[4:], few_sources())
    scene.undo()
    path.write_text("nonsense")
    listed.load()
    assert str(path) in notification_manager.records[-1].message
    assert same_table(scene.sources, few_sources())


def test_hidden_it_costs_nothing(scene, listed, monkeypatch):
    """Catches a closed list that goes on computing."""
    listed.hide()
    calls = []
    monkeypatch.setattr(listed.model, "refresh", lambda: calls.append(1))
    scene.add(source("point", 3, 3))
    scene.wait()
    QTest.qWait(150)
    assert not calls
    monkeypatch.undo()
    listed.show()
    assert listed.model.rowCount() == 5


def test_it_follows_a_drag(scene, listed, mouse, qtbot):
    """Catches a list that is stale while the mouse moves."""
    mouse.press(20.25, 12.5)
    mouse.move(25.0, 12.5)
    mouse.move(30.0, 14.5)
    qtbot.waitUntil(lambda: cell(listed, 0, "y") == "14.50", timeout=2000)
    mouse.release(30.0, 14.5)


def test_ten_thousand_rows(scene, listed):
    """Catches a selection that is made row by row, and cells that are made before they are seen."""
    many = vstack([random_sources("point", 10_000, shape=(64, 80), seed=1)])
    scene.sources = many
    listed.refresh()
    asked = []
    real = type(listed.model).data
    type(listed.model).data = lambda self, *args: asked.append(1) or real(self, *args)
    try:
        listed.view.sortByColumn(PLACE["flux"], Qt.SortOrder.DescendingOrder)
        listed.view.selectAll()
        QApplication.processEvents()
    finally:
        type(listed.model).data = real
    assert len(listed.selected_ids()) == 10_000
    assert len(scene.editor.points.layer.selected_data) == 10_000
    # only what is in view
    assert len(asked) < 20_000


def test_a_pasted_spectrum_that_is_none_is_named_by_its_line():
    """Catches a message that names no column, or a row of an inner table."""
    with pytest.raises(ValueError, match=r"^line 3 of the text: spectrum: 'gold\(3\)' is unknown"):
        from_text("x\ty\tspectrum\n1\t2\tflat\n3\t4\tgold(3)", SMALL, Units())

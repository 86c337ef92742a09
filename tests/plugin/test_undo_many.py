"""Fifty steps and more of every kind of edit, by mouse, key, form, list and file, and back."""

from __future__ import annotations

import numpy as np
import pytest
from napari.utils.interactions import mouse_double_click_callbacks
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QFileDialog, QLineEdit
from small_scene import SMALL, few_sources
from test_scene_edit import assert_consistent
from typed import enter

from napari_issis import source, write_sources
from napari_issis.exposure import same_table
from napari_issis.plugin.instrument_form import InstrumentForm
from napari_issis.plugin.source_columns import COLUMNS
from napari_issis.plugin.source_form import SourceForm
from napari_issis.plugin.source_list import SourceList

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
PLACE = {column.name: place for place, column in enumerate(COLUMNS)}


class User:
    """Does each kind of edit once in a round, a little otherwise in the next."""

    def __init__(self, scene, mouse, form, listed, path) -> None:
        self.scene, self.mouse, self.form, self.listed, self.path = scene, mouse, form, listed, path
        self.round = 0

    @property
    def edits(self):
        names = sorted(name for name in dir(self) if name.startswith("do_"))
        return [getattr(self, name) for name in names]

    def place(self, row):
        table = self.scene.sources
        return float(table["x"][row]), float(table["y"][row])

    def row(self, *, point: bool) -> int:
        """The last star or galaxy that lies alone, well within the frame."""
        table = self.scene.sources
        where = np.column_stack([table["x"], table["y"]])
        apart = np.hypot(*(where[:, None] - where[None]).T) + 1e3 * np.eye(len(table))
        good = (table["kind"] == "point") == point
        good &= (table["x"] > 0) & (table["x"] < 80) & (table["y"] > 0) & (table["y"] < 64)
        rows = np.flatnonzero(good)
        return int(rows[np.argmax(apart.min(axis=1)[rows])])

    def do_move_a_star(self):
        x, y = self.place(self.row(point=True))
        self.mouse.drag((x, y), (x + 1, y), (x + 2.5 + self.round, y + 1))

    def do_move_a_galaxy(self):
        x, y = self.place(self.row(point=False))
        self.mouse.drag((x, y), (x + 1, y), (x - 2.5, y + 1 + self.round))

    def do_resize(self):
        ellipses = self.scene.editor.ellipses.layer
        self.scene.viewer.layers.selection.active = ellipses
        ellipses.mode = "select"
        ellipses.selected_data = {0}
        box = ellipses._selected_box
        corner, middle = box[4].astype(float), box[8].astype(float)
        target = corner + 0.3 * (corner - middle)
        self.mouse.drag(tuple(corner[::-1]), tuple((corner + 0.1)[::-1]), tuple(target[::-1]))
        ellipses.selected_data = set()

    def do_draw_a_star(self):
        points = self.scene.editor.points.layer
        self.scene.viewer.layers.selection.active = points
        points.mode = "add"
        self.mouse.drag((3.0 + self.round, 60.0), (3.0 + self.round, 60.0))
        points.mode = "select"

    def do_delete(self):
        row = self.row(point=True)
        self.scene.editor.select(self.scene.editor.source_id[[row]].tolist())
        layer = self.scene.editor.points.layer
        keys = {str(key): action for key, action in layer.keymap.items()}
        keys["Delete"](layer)

    def do_double_click(self):
        x, y = self.place(self.row(point=True))
        self.mouse.drag((x, y), (x, y))
        self.mouse._send(mouse_double_click_callbacks, "mouse_double_click", x, y)

    def do_paste(self):
        points = self.scene.editor.points.layer
        self.scene.viewer.layers.selection.active = points
        points.selected_data = {0}
        points._copy_data()
        points._paste_data()

    def do_paste_text(self):
        QApplication.clipboard().setText(f"point\t{4 + self.round}\t50\t1e-15")
        self.listed.paste()

    def do_population(self):
        self.form.mode.value = "random"
        self.form.button.native.click()

    def do_lensed_quasar(self):
        self.form.mode.value = "lens"
        self.form.lens.system.value = "HE0435-1223"
        for field, text in (
            (self.form.x, "30"),
            (self.form.y, f"{20 + self.round}"),
            (self.form.lens.flux, "3e-16"),
            (self.form.lens.ratios, "1, 0.5 0.25 2"),
        ):
            enter(field, text)
        self.form.button.native.click()

    def do_type_into_the_list(self):
        self.type_into("flux", f"{7 + self.round}e-15")

    def do_change_a_kind(self):
        kinds = ("uniform", "gaussian", "devaucouleurs", "point", "exponential")
        row = int(np.flatnonzero(self.scene.sources["kind"] != "point")[0])
        kind = kinds[self.round % len(kinds)]
        if kind == self.scene.sources["kind"][row]:
            kind = "sersic"
        self.listed.refresh()
        place = int(np.flatnonzero(self.listed.model.order == row)[0])
        self.listed.model.setData(self.listed.model.index(place, PLACE["kind"]), kind)

    def do_load_a_catalogue(self):
        self.listed.load()

    def type_into(self, name, text):
        self.listed.refresh()
        index = self.listed.model.index(0, PLACE[name])
        self.listed.view.setCurrentIndex(index)
        self.listed.view.edit(index)
        editor = self.listed.view.findChildren(QLineEdit)[-1]
        editor.selectAll()
        QTest.keyClicks(editor, text)
        QTest.keyClick(editor, Qt.Key.Key_Return)
        # Qt commits what was typed in a later turn
        QApplication.processEvents()


@pytest.fixture
def user(scene, mouse, qtbot, tmp_path, monkeypatch):
    form, listed = SourceForm(scene), SourceList(scene.viewer)
    for widget in (form, listed):
        qtbot.addWidget(widget)
    form.resume()
    listed.show()
    qtbot.waitExposed(listed)
    path = tmp_path / "more.ecsv"
    write_sources(source("gaussian", 70.0, 6.0, r_half=2.0), path)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *a: (str(path), ""))
    yield User(scene, mouse, form, listed, path)
    form.pause()
    listed.hide()


@pytest.mark.slow
def test_fifty_steps_of_every_kind(user, scene):
    """Catches an edit that is no step or two, and a way back that ends elsewhere."""
    history = scene.editor.history
    states = [(scene.sources, scene.editor.source_id.copy())]
    while len(states) <= 55:
        for edit in user.edits:
            steps = len(history._past)
            edit()
            scene.wait()
            assert len(history._past) == steps + 1, edit.__name__
            states.append((scene.sources, scene.editor.source_id.copy()))
        assert_consistent(scene)
        user.round += 1
    back = states[-2::-1]
    for number, (table, ids) in enumerate(back):
        scene.undo()
        assert same_table(scene.sources, table)
        assert np.array_equal(scene.editor.source_id, ids)
        if number % 12 == 0:
            assert_consistent(scene)
    assert same_table(scene.sources, few_sources())
    assert_consistent(scene)
    for table, ids in states[1:]:
        scene.redo()
        assert same_table(scene.sources, table)
        assert np.array_equal(scene.editor.source_id, ids)
    assert_consistent(scene)


def test_undo_of_a_change_of_the_frame(scene, mouse, qtbot):
    """Catches a frame that stays, sources lost with a smaller one, other controls set back."""
    form = InstrumentForm(scene)
    qtbot.addWidget(form)
    form.resume()
    mouse.drag((60.0, 50.0), (61.0, 50.0), (70.0, 60.0))
    scene.wait()
    moved, history = scene.sources, scene.editor.history
    box = form.frame.native
    QTest.keyClick(box, Qt.Key.Key_Home)
    larger = scene.observation.shape
    assert larger != SMALL.shape
    assert history.last_step == "change the frame"
    scene.observation = scene.observation.replace(shape=(32, 40))
    scene.observation = scene.observation.replace(exposure=77.0)
    layer = scene.editor.points.layer
    keys = {str(key): action for key, action in layer.keymap.items()}
    undo, redo = keys["Ctrl+Z"], keys["Ctrl+Shift+Z"]
    # backwards: to the larger frame, the first one, and the place before the drag
    for shape, table in ((larger, moved), (SMALL.shape, moved), (SMALL.shape, few_sources())):
        undo(layer)
        scene.wait()
        assert scene.observation.shape == scene.counts.layer.data.shape == shape
        assert same_table(scene.sources, table)
        assert form.frame.value == shape
        assert_consistent(scene)
    assert not history.last_step
    assert scene.observation.exposure == 77.0
    for shape in (SMALL.shape, larger, (32, 40)):
        redo(layer)
        scene.wait()
        assert scene.counts.layer.data.shape == shape
        assert same_table(scene.sources, moved)
    assert_consistent(scene)

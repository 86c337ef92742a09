"""A monkey at the mouse: random user actions, each followed by a look at everything.

After each action the image is that of a fresh simulation of the table, the layers show the
table, and the list does; at the end of each round undo gives the start back and redo the end.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from napari.utils.interactions import mouse_double_click_callbacks
from napari.utils.notifications import notification_manager
from qtpy.QtWidgets import QApplication
from small_scene import few_sources
from test_scene_edit import assert_consistent

from napari_issis import GaussianPSF, Observation, random_sources, source
from napari_issis.exposure import same_table
from napari_issis.plugin.brightness import SCALES
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.source_columns import COLUMNS
from napari_issis.plugin.source_list import SourceList
from napari_issis.sources import KINDS

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")

ROUNDS = int(os.environ.get("MONKEY_ROUNDS", "14"))
ACTIONS = 150
FRAME = Observation(shape=(48, 56), psf=GaussianPSF(0.12), background=0.01)
MOST = 12  # sources, beyond which some are removed


class Monkey:
    """Does something that a user could do, chosen at random."""

    def __init__(self, scene, mouse, listed, seed: int) -> None:
        self.scene, self.mouse, self.listed = scene, mouse, listed
        self.rng = np.random.default_rng(seed)
        self.own = None

    @property
    def points(self):
        return self.scene.editor.points.layer

    @property
    def ellipses(self):
        return self.scene.editor.ellipses.layer

    def place(self):
        return float(self.rng.uniform(-4, 60)), float(self.rng.uniform(-4, 52))

    def near_a_source(self):
        table = self.scene.sources
        if not len(table):
            return self.place()
        row = int(self.rng.integers(len(table)))
        return float(table["x"][row]) + 0.123, float(table["y"][row]) + 0.077

    def act(self) -> str:
        names = sorted(name for name in dir(self) if name.startswith("do_"))
        if len(self.scene.sources) > MOST:
            names = ["do_delete_half"]
        name = str(self.rng.choice(names))
        getattr(self, name)()
        return name

    # ------------------------------------------------------------ mouse

    def do_drag(self):
        x, y = self.near_a_source()
        stops = [self.place() for _ in range(3)]
        self.mouse.drag((x, y), (x + 1, y + 1), *stops)

    def do_drag_and_come_back(self):
        x, y = self.near_a_source()
        self.mouse.drag((x, y), (x + 3, y + 1), (x + 5, y), (x, y))

    def do_pull_a_handle(self):
        """Resize, mirror, shear or rotate what is selected."""
        layer = self.ellipses
        if layer is None or not len(layer.data):
            return
        count = min(len(layer.data), int(self.rng.integers(1, 3)))
        chosen = self.rng.choice(len(layer.data), count, replace=False)
        self.scene.viewer.layers.selection.active = layer
        layer.mode = "select"
        layer.selected_data = {int(row) for row in chosen}
        box = layer._selected_box
        if box is None:
            return
        y, x = box[int(self.rng.choice([0, 1, 2, 4, 6, 9]))]
        stops = [
            (float(x + a), float(y + b))
            for a, b in np.cumsum(self.rng.normal(0, 4, (3, 2)), axis=0)
        ]
        self.mouse.drag((float(x), float(y)), *stops)

    def do_double_click(self):
        x, y = self.near_a_source()
        self.mouse.drag((x, y), (x, y))
        self.mouse._send(mouse_double_click_callbacks, "mouse_double_click", x, y)

    def do_draw_a_star(self):
        if self.points is not None:
            self.scene.viewer.layers.selection.active = self.points
            self.points.mode = "add"
            place = self.place()
            self.mouse.drag(place, place)
            self.points.mode = str(self.rng.choice(["select", "pan_zoom"]))

    def do_draw_an_ellipse(self):
        if self.ellipses is not None:
            self.scene.viewer.layers.selection.active = self.ellipses
            self.ellipses.mode = "add_ellipse"
            x, y = self.place()
            self.mouse.drag((x, y), (x + 2, y + 2), (x + 5, y + 9))
            self.ellipses.mode = "select"

    def do_click_nowhere(self):
        self.mouse.drag((1.0, 1.0), (1.0, 1.0))

    # ------------------------------------------------------------ keys

    def do_delete(self):
        for layer in self.scene.editor.layers:
            if len(layer.data):
                layer.selected_data = {int(self.rng.integers(len(layer.data)))}
                layer.remove_selected()
                return

    def do_delete_half(self):
        ids = self.scene.editor.source_id
        if len(ids):
            gone = self.rng.choice(ids, max(len(ids) // 2, 1), replace=False)
            self.scene.remove(gone.tolist())

    def do_copy_and_paste(self):
        layers = [layer for layer in self.scene.editor.layers if len(layer.data)]
        if layers:
            layer = layers[int(self.rng.integers(len(layers)))]
            layer.selected_data = {int(self.rng.integers(len(layer.data)))}
            layer._copy_data()
            layer._paste_data()

    def do_undo(self):
        self.scene.undo()

    def do_undo_many(self):
        for _ in range(int(self.rng.integers(2, 7))):
            self.scene.undo()

    def do_redo(self):
        self.scene.redo()

    # ------------------------------------------------------------ forms and list

    def do_add_a_population(self):
        kind = str(self.rng.choice(KINDS))
        count = int(self.rng.integers(1, 4))
        seed = int(self.rng.integers(1000))
        self.scene.add(random_sources(kind, count, shape=(48, 56), r_half=(1, 9), seed=seed))

    def do_add_one_far_away(self):
        self.scene.add(source("point", 1e4, -300.0, 1e-12))

    def do_type_into_the_list(self):
        rows = self.listed.model.rowCount()
        if rows:
            row, column = int(self.rng.integers(rows)), int(self.rng.integers(len(COLUMNS)))
            index = self.listed.model.index(row, column)
            texts = ["1e-15", "7.5", "0.3", "33", "-1", "nan", "abc", "20"]
            if COLUMNS[column].name == "flux":
                # 0.3 erg s-1 cm-2 A-1 is valid, and more light than counts can be drawn of
                texts.remove("0.3")
            text = str(self.rng.choice([*KINDS, "comet"] if column == 0 else texts))
            if self.listed.model.flags(index) & self.listed.model.flags(index).ItemIsEditable:
                self.listed.model.setData(index, text)

    def do_select_in_the_list(self):
        if self.listed.model.rowCount():
            self.listed.view.selectRow(int(self.rng.integers(self.listed.model.rowCount())))

    def do_sort_the_list(self):
        self.listed.view.sortByColumn(
            int(self.rng.integers(len(COLUMNS))),
            self.listed.view.horizontalHeader().sortIndicatorOrder(),
        )

    def do_paste_text(self):
        text = ["point\t3\t4\t1e-15", "x\ty\n5\t6\n7\t8\n", "gaussian\t9\t9\t2e-15\t3\t0.1\t5", "?"]
        QApplication.clipboard().setText(str(self.rng.choice(text)))
        self.listed.paste()

    def do_change_units(self):
        units = self.scene.units
        units.flux = str(self.rng.choice(["flux", "AB mag"]))
        units.length = str(self.rng.choice(["px", "arcsec"]))

    # ------------------------------------------------------------ instrument and looks

    def do_change_the_instrument(self):
        change = [
            {"channel": str(self.rng.choice(["NUV", "FUV"]))},
            {"exposure": float(self.rng.choice([1.0, 100.0, 5e4]))},
            {"filters": ("open", str(self.rng.choice(["open", "NF1"])))},
            {"shape": (48, int(self.rng.choice([48, 56, 64])))},
            {"background": float(self.rng.choice([0.0, 0.01, 2.0]))},
        ][int(self.rng.integers(5))]
        self.scene.observation = self.scene.observation.replace(**change)

    def do_new_noise(self):
        self.scene.new_noise()

    def do_change_the_scale(self):
        self.scene.counts.scale = str(self.rng.choice(list(SCALES)))

    def do_style_a_layer(self):
        if self.points is not None:
            self.points.size = float(self.rng.uniform(1, 20))
        if self.ellipses is not None:
            self.ellipses.edge_width = float(self.rng.uniform(0.2, 3))
        self.scene.viewer.scene.camera.zoom = float(self.rng.uniform(50, 500))

    def do_hide_and_show(self):
        for layer in self.scene.layers:
            layer.visible = bool(self.rng.integers(4))

    def do_rename_and_reorder(self):
        layers = self.scene.viewer.layers
        layers[int(self.rng.integers(len(layers)))].name = f"layer {self.rng.integers(100)}"
        layers.move(int(self.rng.integers(len(layers))), int(self.rng.integers(len(layers))))

    def do_a_layer_of_mine(self):
        layers = self.scene.viewer.layers
        if self.own in layers:
            layers.remove(self.own)
            self.own = None
        else:
            self.own = self.scene.viewer.add_points(self.rng.uniform(0, 1, (3, 2)))
            layers.selection.active = self.scene.layers[-1]

    def do_delete_a_layer(self):
        if self.rng.integers(3) == 0:
            layers = self.scene.layers
            self.scene.viewer.layers.remove(layers[int(self.rng.integers(len(layers)))])

    def do_restore(self):
        self.scene.restore()

    def do_edit_features(self):
        if self.ellipses is not None and len(self.ellipses.data):
            features = self.ellipses.features.copy()
            features.loc[int(self.rng.integers(len(features))), "flux"] = 3e-15
            self.ellipses.features = features


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(ROUNDS))
def test_whatever_the_monkey_does(viewer, mouse, qtbot, seed):
    """Catches edits lost, doubled or undone wrongly, and pictures that are not of the scene."""
    scene = open_scene(few_sources(), FRAME, viewer=viewer, dock=False, seed=seed)
    listed = SourceList(viewer)
    qtbot.addWidget(listed)
    listed.show()
    scene.wait()
    notification_manager.records.clear()
    monkey = Monkey(scene, mouse, listed, seed)
    start = scene.sources, scene.editor.source_id.copy()
    done = []
    for _ in range(ACTIONS):
        done.append(monkey.act())
        try:
            assert_consistent(scene)
            listed.refresh()
            assert np.array_equal(np.sort(listed.model.source_id), np.sort(scene.editor.source_id))
            assert set(listed.selected_ids()) == scene.editor.selected_ids
        except AssertionError as error:
            raise AssertionError(f"after {done[-6:]}") from error
    history = scene.editor.history
    end = scene.sources, scene.editor.source_id.copy()
    steps = 0
    while history.last_step:
        scene.undo()
        steps += 1
    assert_consistent(scene)
    assert same_table(scene.sources, start[0])
    assert np.array_equal(scene.editor.source_id, start[1])
    for _ in range(steps):
        scene.redo()
    assert_consistent(scene)
    assert same_table(scene.sources, end[0])
    assert np.array_equal(scene.editor.source_id, end[1])
    errors = [str(note.message) for note in notification_manager.records]
    assert not [text for text in errors if "Traceback" in text or "could not be sim" in text]
    listed.hide()
    scene.viewer.layers.clear()
    while scene._live._jobs.busy:
        QApplication.processEvents()

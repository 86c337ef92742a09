"""Each control of each of our docks says what it is for, and is reached by keyboard."""

from __future__ import annotations

import pytest
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QScrollBar,
    QTabBar,
    QTextEdit,
    QWidget,
)
from small_scene import SMALL, few_sources

from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.trace_docks import show_traces, trace_widgets

pytestmark = [
    pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning"),
    pytest.mark.needs_gl,
]
CONTROLS = (
    QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox,
    QComboBox, QLineEdit, QPlainTextEdit, QTabBar, QTextEdit,
)  # fmt: skip


def controls(dock: QWidget) -> list[QWidget]:
    """All controls in a dock, also on pages and in rows that are hidden; no parts of others."""
    found = []
    for child in dock.findChildren(QWidget):
        if not isinstance(child, CONTROLS) or isinstance(child, QScrollBar | QHeaderView):
            continue
        above = child.parentWidget()
        while above is not dock and not isinstance(above, CONTROLS):
            above = above.parentWidget()
        if above is dock:
            found.append(child)
    return found


def name_of(control: QWidget) -> str:
    text = getattr(control, "text", lambda: "")()
    return f"{type(control).__name__} {text!r} in {type(control.parentWidget()).__name__}"


@pytest.fixture
def docks(make_napari_viewer):
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1300, 900)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    panel, listed = SimulatorWidget(viewer), SourceList(viewer)
    viewer.window.add_dock_widget(panel, name="panel")
    viewer.window.add_dock_widget(listed, name="list", area="bottom")
    show_traces(viewer)
    scene.wait()
    QTest.qWait(50)
    return {"panel": panel, "list": listed, "traces": trace_widgets(viewer)}


def test_every_control_has_a_tooltip_and_takes_the_focus(docks):
    """Catches a button without a word on what it does, and one that needs a mouse."""
    everything = [docks["panel"], docks["list"], *docks["traces"]]
    found = [control for dock in everything for control in controls(dock)]
    # the table and its buttons, four of the traces, the forms of the panel
    assert len(found) > 8 + 4 + 50
    untold = [
        name_of(control)
        for control in found
        if not (control.toolTip() or (isinstance(control, QTabBar) and control.tabToolTip(0)))
    ]
    assert untold == []
    mute = [
        name_of(control)
        for control in found
        if control.focusPolicy() in (Qt.FocusPolicy.NoFocus, Qt.FocusPolicy.ClickFocus)
    ]
    assert mute == []


def test_rows_of_the_forms_say_what_they_are_for(docks):
    """Catches a label without a tooltip beside a field that has one, and units left out."""
    panel = docks["panel"]
    labels = [
        label
        for form in (panel.instrument, panel.sources, panel.display, panel.view)
        for label in form.findChildren(QLabel)
        if label.buddy() is not None
    ]
    assert len(labels) > 20
    assert [label.text() for label in labels if not label.toolTip()] == []


def test_every_entry_of_the_menu_of_pictures_says_what_it_writes(docks):
    panel = docks["panel"]
    actions = [action for action in panel.png.menu().actions() if not action.isSeparator()]
    assert len(actions) >= 3
    assert all(action.text() and action.isEnabled() for action in actions)

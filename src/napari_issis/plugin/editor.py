"""The source table and the two layers in which it is edited."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from astropy.table import QTable
from napari.utils.notifications import show_error, show_warning
from numpy.typing import NDArray

from ..exposure import same_table
from ..observation import Observation
from ..psf_blurs import psf_choice, with_psf_choice
from ..source_rates import flux_pivots
from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    empty_sources,
    source,
)
from .history import History, SourceState
from .picture import HeldSources
from .source_layers import EllipsesLayer, Ids, PointsLayer, SourceLayer
from .table import join, master_table, put

# An ellipse whose semi-axes are shorter (pixels) was clicked, not drawn.
CLICKED = 1.0


class SourceEditor:
    """Keeps the master source table and the layers that show it in step.

    Parameters
    ----------
    changed : callable
        Called, without arguments and often, when a layer may have been edited; `take_over`
        then finds out.
    selected : callable
        Called, without arguments, when the user has selected other sources in a layer.

    Attributes
    ----------
    sources : astropy.table.QTable
        The master table; never changed in place.
    source_id : ndarray of int
        A number for each row that stays with it.
    version : int
        Goes up with each change of the table.
    held : HeldSources or None
        What a drag (or drawing) in progress holds.
    new_source : dict
        Arguments of `napari_issis.source` for sources that are drawn by hand.
    history : History
        The states of the table at rest, for undo and redo.
    """

    def __init__(self, changed: Callable[[], None], selected: Callable[[], None]) -> None:
        self._changed = changed
        self._selected = selected
        self.points = PointsLayer()
        self.ellipses = EllipsesLayer()
        self.sources = master_table(empty_sources())
        self.source_id: Ids = np.empty(0, dtype=np.int64)
        self.version = 0
        self.held: HeldSources | None = None
        self.observation = Observation()
        self.new_source: dict[str, Any] = {
            "kind": "exponential",
            "flux": DEFAULT_FLUX,
            "r_half": DEFAULT_R_HALF,
            "ellipticity": DEFAULT_ELLIPTICITY,
            "pa": DEFAULT_PA,
            "n": None,
        }
        self._last_id = 0
        # By id, the table and row of each deleted source: these can come back by paste.
        self._deleted: dict[int, tuple[QTable, int]] = {}
        self._adding = False
        self._untidy = False
        self._born: set[int] = set()
        self._writing = False
        self._nudging = False
        # The source that a drag moves, and those on the other layer that go with it.
        self._along: tuple[int, set[int]] | None = None
        self.history = History(self._state())

    @property
    def views(self) -> tuple[SourceLayer, SourceLayer]:
        """Ellipses and points, from the bottom up."""
        return self.ellipses, self.points

    @property
    def layers(self) -> list[Any]:
        """The layers that are there."""
        return [view.layer for view in self.views if view.layer is not None]

    # ---------------------------------------------------------------- table to layers

    def replace(self, table: QTable) -> None:
        """Put a master table in the place of all sources; `write` shows it."""
        self._set(table, self._new_ids(len(table)))

    def append(self, table: QTable) -> None:
        """Append the rows of a master table; `write` shows them."""
        joined = join(self.sources, table, pivot=flux_pivots(table, self.observation))
        self._set(joined, np.concatenate([self.source_id, self._new_ids(len(table))]))

    def remove(self, ids: Iterable[int]) -> None:
        """Remove the rows with these ids; `write` takes them from the layers."""
        gone = np.isin(self.source_id, list(ids))
        if gone.any():
            self._bury(gone)
            self._set(self.sources[~gone], self.source_id[~gone])

    def with_lost(self) -> SourceState:
        """Return the sources with those that went with the layers that are missing.

        They have their old places among the others.
        """
        table, source_id = self.sources, self.source_id
        for view in self.views:
            if view.layer is None and view.lost is not None:
                rows, ids = view.lost
                table = join(table, rows, pivot=flux_pivots(rows, self.observation))
                source_id = np.concatenate([source_id, ids])
        # ids go up from row to row
        order = np.argsort(source_id)
        return replace(self._state(), sources=table[order], source_id=source_id[order])

    def change(self, table: QTable) -> None:
        """Put a master table with the same rows, edited, in the table's place; `write` shows it."""
        self._set(table, self.source_id)

    def undo(self) -> bool:
        """Take the last edit back; False if there is none, or while the mouse holds a source."""
        self.end_nudge()
        return self.held is None and self.restore(self.history.undo())

    def redo(self) -> bool:
        """Do again what was undone; False if there is nothing."""
        self.end_nudge()
        return self.held is None and self.restore(self.history.redo())

    def restore(self, state: SourceState | None) -> bool:
        """Put a state in the place of the present one; False if there is none."""
        if state is None:
            return False
        observation = with_psf_choice(self.observation, state.psf)
        self.observation = observation.replace(shape=state.shape)
        gone = np.isin(self.source_id, state.source_id, invert=True)
        self._bury(gone)
        self._set(state.sources, state.source_id)
        return True

    def nudge(self, dx: float, dy: float) -> bool:
        """Move the selected sources; until `end_nudge` all moves are one step of the history.

        The sources are held meanwhile as by the mouse. False if none is selected, or while the
        mouse holds one.
        """
        moving = np.isin(self.source_id, list(self.selected_ids))
        if not moving.any() or (self.held is not None and not self._nudging):
            return False
        if not self._nudging:
            self._nudging = True
            ids = frozenset(self.source_id[moving].tolist())
            self.held = HeldSources(self.sources, self.source_id, ids)
        assert self.held is not None
        table = self.sources.copy()
        table["x"][moving] += dx
        table["y"][moving] += dy
        self.sources = table
        self.version += 1
        self.write(self.held.moving)
        return True

    def end_nudge(self) -> None:
        """Let go of the sources that keys have moved."""
        if self._nudging:
            self._nudging, self.held, self._untidy = False, None, True
            self.take_over()

    def observe(self, observation: Observation) -> None:
        """Take over another set-up; a change of its PSF or frame is a step of the history."""
        self.observation = observation
        if self.held is None:
            self._note()

    def _set(self, table: QTable, source_id: Ids) -> None:
        self.end_nudge()
        self.held = None
        self._born.clear()
        self.sources, self.source_id = table, source_id
        self.version += 1
        self._note()

    def _note(self) -> None:
        """Let the present state be a step of the history, if it differs from the last."""
        self.history.note(self._state())

    def _state(self) -> SourceState:
        observation = self.observation
        return SourceState(self.sources, self.source_id, psf_choice(observation), observation.shape)

    def _bury(self, gone: NDArray[np.bool_]) -> None:
        """Keep rows that go, for those that come back by paste."""
        rows = self.sources[gone]
        self._deleted.update(
            (int(number), (rows, place)) for place, number in enumerate(self.source_id[gone])
        )

    def write(self, ids: Collection[int] | None = None) -> None:
        """Make the layers show the table: all of them, or those that hold one of these ids."""
        with self.quiet():
            for view in self.views:
                if ids is None or np.isin(view.source_id, list(ids)).any():
                    view.write(self.sources, self.source_id)

    def listen(self, layer: Any) -> None:
        """Follow the edits of a layer."""
        layer.events.set_data.connect(self._layer_changed)
        layer.events.features.connect(self._layer_changed)
        layer.events.data.connect(self._layer_edited)
        layer.selected_data.events.items_changed.connect(self._selection_changed)

    @property
    def selected_ids(self) -> set[int]:
        """Ids of the sources that are selected, on either layer."""
        return {number for view in self.views for number in view.selected_ids().tolist()}

    def select(self, ids: Iterable[int]) -> None:
        """Select the sources with these ids, and no others."""
        chosen = list(ids)
        with self.quiet():
            for view in self.views:
                if view.layer is not None:
                    rows = np.flatnonzero(np.isin(view.current_ids(), chosen))
                    view.layer.selected_data = set(rows.tolist())
        self._selected()

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Change layers without taking that for an edit of the user's."""
        before, self._writing = self._writing, True
        try:
            yield
        finally:
            self._writing = before

    # ---------------------------------------------------------------- layers to table

    def _layer_changed(self, event: Any = None) -> None:
        if not self._writing:
            self._changed()

    def deselect_all_but(self, layer: Any) -> None:
        """Select nothing on the layers of sources other than this one."""
        for view in self._others(layer):
            if view.layer.selected_data:
                view.layer.selected_data = set()

    def select_in_box(self, layer: Any, corner: Any, opposite: Any) -> None:
        """Select what has its centre in a box (world coordinates) on the layers but this one.

        On this one, napari does it.
        """
        for view in self._others(layer):
            if not view.layer.visible:
                continue
            ends = np.sort([view.layer.world_to_data(end)[-2:] for end in (corner, opposite)], 0)
            data = view.read()
            centres = data.reshape(-1, 2) if data.ndim == 2 else data.mean(axis=1)
            inside = np.all((centres >= ends[0]) & (centres <= ends[1]), axis=1)
            view.layer.selected_data = set(np.flatnonzero(inside).tolist())

    def _others(self, layer: Any) -> list[SourceLayer]:
        """Return the views whose layer is there, and is not this one."""
        return [view for view in self.views if view.layer not in (None, layer)]

    def _selection_changed(self, event: Any = None) -> None:
        if not self._writing:
            self._selected()

    def _layer_edited(self, event: Any) -> None:
        """Follow the start and end of a drag; napari tells no more during it."""
        if self._writing:
            return
        action = str(getattr(event.action, "value", event.action))
        view = self.points if event.source is self.points.layer else self.ellipses
        self.end_nudge()
        if action in ("changing", "adding"):
            self.take_over()
            moving: list[int] = []
            if action == "changing":
                ids = view.current_ids()
                moving = [int(ids[row]) for row in event.data_indices if -1 <= row < len(ids)]
            else:
                self._adding = True
            self._along = None
            if moving:
                others = (set(v.selected_ids().tolist()) for v in self._others(view.layer))
                along = set[int]().union(*others)
                self._along = (moving[0], along) if along else None
                moving += along
            self.held = HeldSources(self.sources, self.source_id, frozenset(moving))
        else:
            self.held = None
            self._untidy = True
        self._changed()

    def layer_removed(self, layer: Any) -> None:
        """Let the sources of a layer go that the user deleted."""
        for view in self.views:
            if view.layer is layer:
                self.take_over()
                view.layer, view.lost = None, None
                self.held = None
                self._changed()

    def take_over(self) -> None:
        """Take over what the user changed in the layers; cheap if nothing."""
        if self._writing:
            return
        for view in self.views:
            if view.layer is not None and view.foreign() and not self._refused(view):
                continue
            try:
                if view.changed():
                    self._adopt(view)
                    self.version += 1
                    self._untidy = True
            except ValueError as error:
                show_error(str(error))
                self.held = None
                self.write()
        self._draw_along()
        if self.held is None and self._untidy:
            self._adding = self._untidy = False
            self._tidy()
            self._note()

    def _draw_along(self) -> None:
        """Move what is selected on the other layer with the source that the mouse drags."""
        if self.held is None or self._along is None:
            return
        leader, along = self._along
        old, new = np.flatnonzero(self.held.source_id == leader), self._places([leader])
        if not old.size or new[0] < 0:
            return
        before, now = self.held.sources[old[:1]], self.sources[new]
        steps = {name: float(now[name][0] - before[name][0]) for name in ("x", "y")}
        moved = before.copy()
        for name, step in steps.items():
            moved[name] += step
        table, first = self.sources.copy(), self.held.sources
        mine, origin = (np.isin(ids, list(along)) for ids in (self.source_id, self.held.source_id))
        for name, step in steps.items():
            # a handle changes more than the place, and the galaxies alone
            now[name] = moved[name]
            table[name][mine] = first[name][origin] + step
        if not same_table(now, moved):
            for name in steps:
                table[name][mine] = first[name][origin]
        if same_table(table, self.sources):
            return
        self.sources = table
        self.version += 1
        self.write(along)

    def _refused(self, view: SourceLayer) -> bool:
        """Remove shapes that can be no sources, unless one is being drawn just now."""
        if self.held is not None:
            return False
        with self.quiet():
            view.layer.remove(view.foreign())
        self._adding = False
        show_warning(
            "Extended sources are ellipses: draw them with the ellipse tool. "
            "Other shapes belong on a layer of your own."
        )
        return True

    def _adopt(self, view: SourceLayer) -> None:
        """Bring the table in step with one layer."""
        if view.only_moved():
            self.sources = self._moved(view)
            view.note_geometry()
            return
        mine = np.isin(self.source_id, view.source_id)
        if view.layer is None:
            self._bury(mine)
            view.lost = self.sources[mine], self.source_id[mine]
            self.sources, self.source_id = self.sources[~mine], self.source_id[~mine]
            view.forget()
            return
        rows, before, fresh = view.survivors()
        surviving = view.source_id[before]
        places = self._places(surviving)
        part = view.adopt(self.sources[places], rows, before)
        table = self.sources.copy()
        for name in part.colnames:
            put(table, name, places, part[name])
        kept = ~mine | np.isin(self.source_id, surviving)
        both = table[kept]
        for row in fresh:
            drawn = self._drawn(view, row)
            both = join(both, drawn, pivot=flux_pivots(drawn, self.observation))
        # From here on nothing can fail.
        self._bury(~kept)
        ids = self._new_ids(len(fresh))
        self.sources, self.source_id = both, np.concatenate([self.source_id[kept], ids])
        if len(fresh):
            column = view.current_ids()
            column[fresh] = ids
            # In place: napari emits nothing.
            view.layer.features["source_id"] = column
            if self._adding:
                self._born |= set(ids.tolist())
            self._color(view)
        if len(fresh) or len(surviving) < len(view.source_id):
            order = self._places(view.current_ids())
            with self.quiet():
                view.in_step(self.sources[order], self.source_id[order])
        else:
            view.note_geometry()

    def _moved(self, view: SourceLayer) -> QTable:
        """Return the table with what was moved, resized or turned; the rest is not copied."""
        rows, part = view.moved_part(self.sources, self._places(view.source_id))
        # the columns are shared with the old table, and those that change replaced
        table = QTable(self.sources, copy=False)
        for name in ("x", "y", "r_half", "ellipticity", "pa"):
            column = self.sources[name].copy()
            column[rows] = part[name]
            table[name] = column
        return table

    def _drawn(self, view: SourceLayer, row: int) -> QTable:
        """Return the table row of a source that was drawn (as the form says) or pasted."""
        data = view.read()
        source_id = int(view.current_ids()[row])
        place = int(self._places([source_id])[0])
        if not self._adding and place >= 0:
            base = self.sources[[place]]
        elif not self._adding and source_id in self._deleted:
            rows, place = self._deleted[source_id]
            base = rows[[place]]
        else:
            base = self._template(view, *data[row].reshape(-1, 2).mean(axis=0))
        return view.moved(base, view.geometry(base), data[row : row + 1])

    def _template(self, view: SourceLayer, y: float, x: float) -> QTable:
        new = dict(self.new_source)
        if not view.holds([new["kind"]])[0]:
            new["kind"] = "point" if view is self.points else "exponential"
        if new["kind"] != "sersic":
            new["n"] = None
        return master_table(source(x=float(x), y=float(y), **new))

    def _tidy(self) -> None:
        """At rest: size clicked ellipses, show what the table says."""
        self._size_clicked()
        for view in self.views:
            if view.layer is None:
                continue
            order = self._places(view.current_ids())
            lost = np.any(order < 0) or len(order) != view.holds(self.sources["kind"]).sum()
            if lost or not view.shows(self.sources[order]):
                self.write()
                return
        for view in self.views:
            if view.layer is not None:
                self._settle(view)

    def _settle(self, view: SourceLayer) -> None:
        order = self._places(view.current_ids())
        part = self.sources[order]
        if view.changed() or view.stale(part):
            self._color(view)
            with self.quiet():
                view.in_step(part, self.source_id[order])

    def _size_clicked(self) -> None:
        """Give ellipses that were clicked, not drawn, the size and shape of the form."""
        born, self._born = self._born, set()
        table = self.sources.copy() if born else self.sources
        for row in self._places(sorted(born)):
            if row < 0 or table["kind"][row] == "point" or table["r_half"][row].value >= CLICKED:
                continue
            base = self._template(self.ellipses, 0.0, 0.0)
            for name in ("r_half", "ellipticity", "pa"):
                table[name][row] = base[name][0]
            self.version += 1
        self.sources = table

    def _color(self, view: SourceLayer) -> None:
        if isinstance(view, EllipsesLayer):
            order = self._places(view.current_ids())
            kinds = [str(self.sources["kind"][row]) if row >= 0 else "" for row in order]
            with self.quiet():
                view.recolor(kinds)

    def row_of(self, source_id: int) -> int | None:
        """Row of the table with an id, None if there is none."""
        rows = np.flatnonzero(self.source_id == source_id)
        return int(rows[0]) if rows.size else None

    def _places(self, ids: Any) -> NDArray[np.intp]:
        """Rows of the table with these ids, -1 where there is none."""
        wanted = np.asarray(ids, dtype=np.int64)
        if not self.source_id.size:
            return np.full(wanted.shape, -1, dtype=np.intp)
        order = np.argsort(self.source_id, kind="stable")
        at = np.searchsorted(self.source_id, wanted, sorter=order)
        places = order[np.minimum(at, order.size - 1)]
        return np.where(self.source_id[places] == wanted, places, -1)

    def _new_ids(self, count: int) -> Ids:
        first = self._last_id + 1
        self._last_id += count
        return np.arange(first, first + count, dtype=np.int64)

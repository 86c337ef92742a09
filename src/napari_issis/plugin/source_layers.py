"""A napari layer as the editor of one part of the source table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from astropy.table import QTable
from napari.layers import Points, Shapes
from numpy.typing import NDArray

from ..sources import IMAGE
from . import layer_styles as styles
from .layers import (
    FEATURES,
    adopt_features,
    adopt_points,
    adopt_shapes,
    features,
    points_data,
    same_ellipses,
    shapes_data,
)
from .marks import MARKER

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


class SourceLayer:
    """Keeps a layer and its rows of the source table in step.

    Attributes
    ----------
    layer : napari layer or None
        None where the user deleted it or it was not needed yet.
    source_id : ndarray of int
        Ids of the rows that the layer held when the two were last in step.
    lost : tuple of QTable and ndarray, or None
        The sources that went with the layer when the user deleted it, and their ids.
    """

    role = ""
    _scale = 1.0

    def __init__(self, layer: Any = None) -> None:
        self.layer = layer
        self.lost: tuple[QTable, Ids] | None = None
        self.forget()

    def forget(self) -> None:
        """Forget what was written, as after the deletion of the layer."""
        self.source_id: Ids = np.empty(0, dtype=np.int64)
        self._geometry: Array = self.geometry(QTable(), empty=True)
        self._features = pd.DataFrame(columns=[*FEATURES, "source_id"])

    def fit(self, shape: tuple[int, int], pixel_scale: float) -> None:
        """Draw the marks so that they suit a frame of this shape and scale (arcsec per pixel)."""
        self._scale = pixel_scale
        if self.layer is not None:
            self.layer.scale = (pixel_scale, pixel_scale)

    def holds(self, kinds: Any) -> NDArray[np.bool_]:
        """Tell which kinds of sources belong on the layer."""
        raise NotImplementedError

    def geometry(self, table: QTable, *, empty: bool = False) -> Array:
        """Layer data of a table."""
        raise NotImplementedError

    def read(self) -> Array:
        """Layer data as they are now."""
        raise NotImplementedError

    def foreign(self) -> list[int]:
        """Rows of the layer that cannot be sources."""
        return []

    def moved(self, table: QTable, written: Array, current: Array) -> QTable:
        """Return the table with the changes of geometry."""
        raise NotImplementedError

    def same(self, first: Array, second: Array) -> bool:
        """Whether two sets of layer data show the same sources."""
        raise NotImplementedError

    def make(self) -> Any:
        """Create an empty layer."""
        raise NotImplementedError

    def replace(self, data: Array, table: QTable) -> None:
        """Put data into the layer, whatever it held."""
        raise NotImplementedError

    def recolor(self, kinds: Iterable[str]) -> None:
        """Give each mark the colour of its kind, where kinds have colours."""

    def changed(self) -> bool:
        """Whether the layer holds other sources than when last in step (cheap)."""
        if self.layer is None:
            return len(self.source_id) > 0
        data = self.read()
        return not (
            data.shape == self._geometry.shape
            and np.array_equal(data, self._geometry)
            and self._same_features()
        )

    def current_ids(self) -> Ids:
        """Ids of the layer's rows; -1 where a row has none."""
        table = self.layer.features
        if "source_id" not in table.columns:
            return np.full(len(table), -1, dtype=np.int64)
        ids = pd.to_numeric(table["source_id"], errors="coerce").fillna(-1)
        return np.array(ids, dtype=np.int64)

    def selected_ids(self) -> Ids:
        """Ids of the selected rows."""
        if self.layer is None:
            return np.empty(0, dtype=np.int64)
        current = self.current_ids()
        return current[[row for row in self.layer.selected_data if row < current.size]]

    def write(self, table: QTable, source_id: Ids) -> None:
        """Show the rows of the table that belong here, if there is a layer."""
        if self.layer is None:
            return
        mine = self.holds(table["kind"])
        part, ids = table[mine], source_id[mine]
        written = features(part, ids)
        mark = {"role": self.role, "flux_unit": str(table["flux"].unit)}
        self.layer.metadata = {**self.layer.metadata, MARKER: mark}
        current = self.layer.features
        shown = self.shows(part)
        told = len(current) == len(written) and bool(
            current.reindex(columns=written.columns).equals(written)
        )
        if not (shown and told):
            selected = set(self.current_ids()[list(self.layer.selected_data)])
            # napari draws all anew, which an edit of fluxes does not need
            if shown:
                self.recolor(part["kind"])
            else:
                self.replace(self.geometry(part), part)
            self.layer.features = written.copy()
            self.layer.selected_data = {
                int(row) for row in np.flatnonzero(np.isin(ids, list(selected)))
            }
        self._note(written, ids)

    def in_step(self, part: QTable, source_id: Ids) -> None:
        """Note what the layer holds now, and the features of these rows in the layer."""
        self._note(features(part, source_id), source_id)
        table = self.layer.features
        for name in self._features.columns:
            # Setting a column in place emits nothing.
            table[name] = self._features[name].to_numpy()

    def _note(self, table: pd.DataFrame, source_id: Ids) -> None:
        self.source_id, self._features = source_id, table
        self._geometry = self.read().copy()

    def shows(self, table: QTable) -> bool:
        """Whether the layer shows these rows, which are its own, as the table has them."""
        return self.same(self.read(), self.geometry(table))

    def stale(self, table: QTable) -> bool:
        """Whether the features of the layer lag behind these rows, which are its own."""
        return not features(table, self.source_id).equals(self._features)

    def survivors(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Match the layer's rows to those last in step.

        Returns
        -------
        rows : ndarray of int
            Rows of the layer that were there before.
        before : ndarray of int
            Their places in ``source_id``.
        fresh : ndarray of int
            Rows that are new: drawn, pasted or cloned (their id is unknown or repeated).
        """
        known = {int(value): place for place, value in enumerate(self.source_id)}
        rows, before, fresh = [], [], []
        for row, value in enumerate(self.current_ids().tolist()):
            place = known.pop(value, None)
            if place is None:
                fresh.append(row)
            else:
                rows.append(row)
                before.append(place)
        return tuple(np.array(v, dtype=np.intp) for v in (rows, before, fresh))  # type: ignore[return-value]

    def adopt(self, table: QTable, rows: NDArray[np.intp], before: NDArray[np.intp]) -> QTable:
        """Return surviving rows of the table with what changed in the layer."""
        current = self.layer.features.iloc[rows].reset_index(drop=True)
        written = self._features.iloc[before].reset_index(drop=True)
        if not current.reindex(columns=written.columns).equals(written):
            table = adopt_features(table, written, current)
        return self.moved(table, self._geometry[before], self.read()[rows])

    def only_moved(self) -> bool:
        """Whether the layer holds the same sources as when last in step, some of them moved."""
        return (
            self.layer is not None
            and np.array_equal(self.current_ids(), self.source_id)
            and self._same_features()
        )

    def moved_part(
        self, table: QTable, places: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], QTable]:
        """Return the rows of the table that moved, and how they are now.

        Parameters
        ----------
        table : astropy.table.QTable
            The master table.
        places : ndarray of int
            Its rows in the order of the layer's.
        """
        current = self.read()
        differs = current != self._geometry
        moved = np.flatnonzero(differs.any(axis=tuple(range(1, differs.ndim))))
        rows = places[moved]
        return rows, self.moved(table[rows], self._geometry[moved], current[moved])

    def _same_features(self) -> bool:
        return len(self.layer.features) == len(self._features) and bool(
            self.layer.features.reindex(columns=self._features.columns).equals(self._features)
        )

    def note_geometry(self) -> None:
        """Note the geometry as it is now, without touching the layer (during a drag)."""
        self._geometry = self.read().copy()


class PointsLayer(SourceLayer):
    """Point sources as stars."""

    role = "points"
    _size = 9.0

    def fit(self, shape: tuple[int, int], pixel_scale: float) -> None:
        """Give the markers a size that suits the frame."""
        super().fit(shape, pixel_scale)
        self._size = styles.marker_size(shape)
        if self.layer is not None:
            self.layer.size = self._size
            self.layer.current_size = self._size

    def holds(self, kinds: Any) -> NDArray[np.bool_]:
        """Points only."""
        held: NDArray[np.bool_] = np.asarray(kinds, dtype=np.str_) == "point"
        return held

    def geometry(self, table: QTable, *, empty: bool = False) -> Array:
        """Positions."""
        return np.empty((0, 2)) if empty else points_data(table)

    def read(self) -> Array:
        """Positions now."""
        return np.asarray(self.layer.data, dtype=np.float64)

    def moved(self, table: QTable, written: Array, current: Array) -> QTable:
        """Return the table with the points that moved."""
        return adopt_points(table, written, current)

    def same(self, first: Array, second: Array) -> bool:
        """Tell whether the positions are the same, and floats (integers move in steps)."""
        return np.array_equal(first, second) and self.layer.data.dtype == np.float64

    def make(self) -> Points:
        """Create an empty layer."""
        return Points(
            np.empty((0, 2)),
            features=features(QTable(_no_rows()), np.empty(0, dtype=np.int64)),
            metadata={MARKER: {"role": self.role}},
            size=self._size,
            scale=(self._scale, self._scale),
            **styles.POINTS,
        )

    def replace(self, data: Array, table: QTable) -> None:
        """Put positions into the layer."""
        self.layer.selected_data = set()
        self.layer.data = data


class EllipsesLayer(SourceLayer):
    """Extended sources as the ellipses that hold half of their light."""

    role = "ellipses"
    _widest = _edge_width = 1.0

    def fit(self, shape: tuple[int, int], pixel_scale: float) -> None:
        """Make the edges thick enough to be seen, and no thicker, when the frame is."""
        super().fit(shape, pixel_scale)
        self._widest = styles.edge_width(shape)
        self._set_width(self._widest)

    def follow_zoom(self, zoom: float) -> None:
        """Keep the edges as thin on the screen as they are in the whole frame.

        ``zoom`` is in pixels of the screen for an arcsec.
        """
        self._set_width(min(self._widest, styles.EDGE / (zoom * self._scale)))

    def _set_width(self, width: float) -> None:
        self._edge_width = width
        if self.layer is not None:
            self.layer.edge_width = self._edge_width
            self.layer.current_edge_width = self._edge_width

    def holds(self, kinds: Any) -> NDArray[np.bool_]:
        """All but points."""
        held: NDArray[np.bool_] = np.asarray(kinds, dtype=np.str_) != "point"
        return held

    def geometry(self, table: QTable, *, empty: bool = False) -> Array:
        """Corners of the half-light isophotes."""
        return np.empty((0, 4, 2)) if empty else shapes_data(table)

    def read(self) -> Array:
        """Corners now."""
        corners = self.layer.data
        return np.array(corners, dtype=np.float64) if len(corners) else np.empty((0, 4, 2))

    def foreign(self) -> list[int]:
        """Other shapes than ellipses and the rectangles of images."""
        other = [row for row, kind in enumerate(self.layer.shape_type) if kind != "ellipse"]
        if not other or "kind" not in self.layer.features.columns:
            return other
        kinds = self.layer.features["kind"].to_numpy()
        return [row for row in other if kinds[row] != IMAGE]

    def moved(self, table: QTable, written: Array, current: Array) -> QTable:
        """Return the table with the ellipses that changed."""
        return adopt_shapes(table, written, current)

    def same(self, first: Array, second: Array) -> bool:
        """Tell whether the ellipses are the same, whatever corner comes first."""
        return same_ellipses(first, second)

    def make(self) -> Shapes:
        """Create an empty layer."""
        return Shapes(
            None,
            ndim=2,
            features=features(QTable(_no_rows()), np.empty(0, dtype=np.int64)),
            metadata={MARKER: {"role": self.role}},
            edge_width=self._edge_width,
            scale=(self._scale, self._scale),
            **styles.ELLIPSES,
        )

    def replace(self, data: Array, table: QTable) -> None:
        """Put ellipses and images into the layer."""
        self.layer.selected_data = set()
        self.layer.data = list(zip(data, styles.shape_types(table["kind"]), strict=True))
        if len(data):
            self.layer.edge_color = styles.edge_colors(table["kind"])
            self.layer.edge_width = [self._edge_width] * len(data)

    def shows(self, table: QTable) -> bool:
        """Tell whether the layer shows these rows, each in its shape."""
        return super().shows(table) and self.layer.shape_type == styles.shape_types(table["kind"])

    def recolor(self, kinds: Iterable[str]) -> None:
        """Give each ellipse the colour of its kind."""
        colors = styles.edge_colors(kinds)
        if colors:
            self.layer.edge_color = colors


def _no_rows() -> dict[str, Any]:
    return {"kind": np.empty(0, dtype="U13"), "x": [], "y": [], "flux": []}

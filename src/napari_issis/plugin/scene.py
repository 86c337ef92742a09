"""The live scene: two source layers, an image layer, and what keeps them in step."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, cast
from weakref import WeakValueDictionary

import numpy as np
from astropy.table import QTable, Table
from napari.layers import Image
from napari.utils.events import EmitterGroup, Event
from napari.utils.notifications import show_error, show_warning
from napari.viewer import Viewer
from qtpy.QtCore import QEventLoop, QTimer
from qtpy.QtWidgets import QApplication

from ..exposure import Exposure
from ..observation import Observation
from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    empty_sources,
    source,
)
from . import layer_styles as styles
from .contrast import contrast_limits
from .latest_wins import LatestWins
from .picking import activate_source_under
from .picture import Drag, Picture, PictureMaker
from .source_layers import MARKER, EllipsesLayer, PointsLayer, SourceLayer
from .table import join, master_table

# The live scene of each viewer, kept alive by the viewer's mouse callbacks.
_SCENES: WeakValueDictionary[int, Scene] = WeakValueDictionary()

# A drag that rests for so long (ms) is shown as it will be when it ends.
PAUSE = 200
ORIENTATION = ("up", "right")


class Scene:
    """A scene that is edited in napari and simulated live.

    Made by `open_scene` (`napari_issis.show`). The source table is the master; the layers
    show it, and what the user changes in them is taken over.

    Parameters
    ----------
    viewer : napari.Viewer
        The viewer. Its own layers are left alone.

    Attributes
    ----------
    events : napari.utils.events.EmitterGroup
        ``picture`` after each exposure that came to the screen at rest, ``observation`` after
        a change of the instrument set-up or the seed.
    new_source : dict
        Arguments of `napari_issis.source` for sources that are drawn by hand.
    """

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self.events = EmitterGroup(source=self, picture=Event, observation=Event)
        self.new_source: dict[str, Any] = {
            "kind": "exponential",
            "flux": DEFAULT_FLUX,
            "r_half": DEFAULT_R_HALF,
            "ellipticity": DEFAULT_ELLIPTICITY,
            "pa": DEFAULT_PA,
            "n": None,
        }
        self._sources = master_table(empty_sources())
        self._source_id = np.empty(0, dtype=np.int64)
        self._last_id = 0
        # Rows by id, also of deleted sources: these can come back by paste.
        self._deleted: dict[int, QTable] = {}
        self._observation = Observation()
        self._seed = 0
        self._points = PointsLayer()
        self._ellipses = EllipsesLayer()
        self._image: Image | None = None
        self._orientation = viewer.camera.orientation2d

        self._maker = PictureMaker()
        self._jobs = LatestWins(self._show, self._failed)
        self._picture: Picture | None = None
        self._error: BaseException | None = None
        self._version = 0
        self._requested = (-1, False)
        self._shown = (-1, False)
        self._limits: tuple[float, float] | None = None
        self._rescale = True
        self._by_hand_ends = True

        self._drag: Drag | None = None
        self._adding = False
        self._untidy = False
        self._born: set[int] = set()
        self._writing = False
        self._timer = QTimer()
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._refresh)
        self._pause = QTimer()
        self._pause.setSingleShot(True)
        self._pause.setInterval(PAUSE)
        self._pause.timeout.connect(self._rest)

        viewer.mouse_drag_callbacks.append(self._pick)
        viewer.layers.events.removed.connect(self._layer_removed)
        _SCENES[id(viewer)] = self

    # ------------------------------------------------------------------ what scripts use

    @property
    def sources(self) -> QTable:
        """A copy of the source table; setting it replaces all sources.

        Positions and radii are in pixels, angles in degrees, the flux in the unit given.
        A table with an error raises a ``ValueError`` and leaves the scene as it was.
        """
        self._take_over()
        return self._sources.copy()

    @sources.setter
    def sources(self, table: Table) -> None:
        self._replace(master_table(table))

    @property
    def observation(self) -> Observation:
        """The instrument set-up; can be set."""
        return self._observation

    @observation.setter
    def observation(self, observation: Observation) -> None:
        if not isinstance(observation, Observation):
            raise ValueError(f"observation is {observation!r}; give an Observation.")
        if observation == self._observation:
            return
        self._observation = observation
        self._rescale = self._by_hand_ends = True
        self._touch()
        self.events.observation()

    @property
    def seed(self) -> int:
        """Seed of the Poisson noise; can be set."""
        return self._seed

    @seed.setter
    def seed(self, seed: int) -> None:
        if isinstance(seed, bool) or int(seed) != seed or seed < 0:
            raise ValueError(f"seed is {seed!r}; it must be a whole number, 0 or more.")
        if seed != self._seed:
            self._seed = int(seed)
            self._touch()
            self.events.observation()

    @property
    def exposure(self) -> Exposure:
        """The exposure of the scene as it is now; waits until it is made."""
        self.wait()
        assert self._picture is not None
        return self._picture.exposure

    @property
    def picture(self) -> Picture | None:
        """What is on the screen now; None before the first exposure."""
        return self._picture

    @property
    def settled(self) -> bool:
        """Whether the picture is that of the scene as it is now, and no preview."""
        return not self._timer.isActive() and self._shown == (self._version, True)

    def new_noise(self) -> None:
        """Draw the noise anew: the next seed."""
        self.seed = self._seed + 1

    def add(self, table: Table) -> None:
        """Add sources.

        Raises
        ------
        ValueError
            If the table has an error; the scene stays as it was.
        """
        self._take_over()
        more = master_table(table)
        both = join(self._sources, more, pivot=self._observation.channel_data.pivot)
        self._sources = both
        self._source_id = np.concatenate([self._source_id, self._new_ids(len(more))])
        self._rescale = True
        self._write()
        self._touch()

    def wait(self, timeout: float = 60.0) -> None:
        """Wait until the picture is settled.

        Parameters
        ----------
        timeout : float
            Seconds.

        Raises
        ------
        TimeoutError
            If it takes longer.
        RuntimeError
            If the picture could not be made; the cause is chained.
        """
        if self._dormant:
            self._ensure_layers()
            self._write()
        self._refresh()
        until = time.monotonic() + timeout
        while not self.settled:
            if self._error is not None and not self._jobs.busy:
                raise RuntimeError(f"the scene could not be simulated: {self._error}") from (
                    self._error
                )
            if time.monotonic() > until:
                raise TimeoutError(f"the scene was not simulated within {timeout:g} s.")
            QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 10)
            time.sleep(0.001)

    # ------------------------------------------------------------- from scene to layers

    @property
    def _dormant(self) -> bool:
        return self._points.layer is None and self._ellipses.layer is None and self._image is None

    @property
    def _views(self) -> tuple[SourceLayer, SourceLayer]:
        return self._ellipses, self._points

    def _replace(self, table: QTable) -> None:
        """Put a master table in the place of all sources."""
        self._drag = None
        self._born.clear()
        self._sources = table
        self._source_id = self._new_ids(len(table))
        self._rescale = True
        self._write()
        self._touch()

    def _new_ids(self, count: int) -> Any:
        first = self._last_id + 1
        self._last_id += count
        return np.arange(first, first + count, dtype=np.int64)

    def _write(self) -> None:
        """Make the source layers show the table."""
        self._ensure_layers()
        self._writing = True
        try:
            for view in self._views:
                view.write(self._sources, self._source_id)
        finally:
            self._writing = False

    def _ensure_layers(self) -> None:
        """Make the layers that are missing: the image lowest, the points uppermost."""
        layers = self.viewer.layers
        alone = len(layers) == 0
        if self._dormant:
            self._orientation = self.viewer.camera.orientation2d
            self.viewer.camera.orientation2d = ORIENTATION  # type: ignore[assignment]
        self._writing = True
        try:
            if self._image is None:
                self._image = self._make_image()
                above = [v.layer for v in self._views if v.layer is not None]
                place = min((layers.index(layer) for layer in above), default=len(layers))
                layers.insert(place, self._image)
            for view in self._views:
                if view.layer is None:
                    view.forget()
                    view.layer = view.make()
                    place = len(layers)
                    if view is self._ellipses and self._points.layer is not None:
                        place = layers.index(self._points.layer)
                    layers.insert(place, view.layer)
                    self._listen(view.layer)
        finally:
            self._writing = False
        if alone:
            self.viewer.reset_view()

    def _make_image(self) -> Image:
        kept = self._picture
        counts = (
            np.zeros(self._observation.shape, dtype=np.int64)
            if kept is None
            else kept.exposure.counts
        )
        return Image(
            counts,
            contrast_limits=self._limits or (0, 1),
            metadata={MARKER: {"role": "counts"}},
            **styles.COUNTS,
        )

    def _listen(self, layer: Any) -> None:
        layer.events.set_data.connect(self._layer_changed)
        layer.events.features.connect(self._layer_changed)
        layer.events.data.connect(self._layer_edited)

    def use_layers(self, image: Image | None, points: Any, shapes: Any) -> None:
        """Take over layers that carry our mark, as a sample or a saved scene has them."""
        self._image, self._points.layer, self._ellipses.layer = image, points, shapes
        self._orientation = self.viewer.camera.orientation2d
        self.viewer.camera.orientation2d = ORIENTATION  # type: ignore[assignment]
        for layer in (points, shapes):
            if layer is not None:
                self._listen(layer)

    # ------------------------------------------------------------- from layers to scene

    def _pick(self, _viewer: Any, event: Any) -> None:
        ours = [self._image, self._ellipses.layer, self._points.layer]
        activate_source_under(self.viewer.layers, ours, event)

    def _layer_changed(self, event: Any = None) -> None:
        if not self._writing:
            self._timer.start(0)

    def _layer_edited(self, event: Any) -> None:
        if self._writing:
            return
        action = str(getattr(event.action, "value", event.action))
        view = self._points if event.source is self._points.layer else self._ellipses
        if action in ("changing", "adding"):
            self._take_over()
            moving: list[int] = []
            if action == "changing":
                ids = view.current_ids()
                moving = [int(ids[row]) for row in event.data_indices if -1 <= row < len(ids)]
            else:
                self._adding = True
            self._drag = Drag(self._sources, self._source_id, frozenset(moving))
        else:
            self._drag = None
            self._untidy = True
        self._timer.start(0)

    def _layer_removed(self, event: Any) -> None:
        if event.value is self._image:
            self._image = None
        for view in self._views:
            if event.value is view.layer:
                self._take_over()
                view.layer = None
                self._drag = None
                self._timer.start(0)
        if self._dormant and self.viewer.camera.orientation2d == ORIENTATION:
            self.viewer.camera.orientation2d = self._orientation

    def _take_over(self) -> None:
        """Take over what the user changed in the layers."""
        if self._writing:
            return
        for view in self._views:
            try:
                if view.changed():
                    self._adopt(view)
                    self._version += 1
                    self._untidy = True
            except ValueError as error:
                show_error(str(error))
                self._drag = None
                self._write()
        if self._drag is None and self._untidy:
            self._adding = self._untidy = False
            self._tidy()

    def _adopt(self, view: SourceLayer) -> None:
        """Bring the table in step with one layer."""
        mine = np.isin(self._source_id, view.source_id)
        if view.layer is None:
            self._keep(~mine)
            view.forget()
            return
        rows, before, fresh = view.survivors()
        surviving = view.source_id[before]
        places = self._places(surviving)
        part = view.adopt(self._sources[places], rows, before)
        table = self._sources.copy()
        for name in part.colnames:
            if name not in table.colnames:
                table[name] = np.full(len(table), np.nan)
            table[name][places] = part[name]
        added = [self._drawn(view, row) for row in fresh]
        self._sources = table
        if len(surviving) < mine.sum():
            self._keep(~mine | np.isin(self._source_id, surviving))
        if added:
            ids = self._new_ids(len(added))
            pivot = self._observation.channel_data.pivot
            for row in added:
                table = join(self._sources, row, pivot=pivot)
                self._sources = table
            self._source_id = np.concatenate([self._source_id, ids])
            column = view.current_ids()
            column[fresh] = ids
            # In place: emits nothing.
            view.layer.features["source_id"] = column
            if self._drag is not None:
                self._born |= set(ids.tolist())
            self._color_ellipses(view)
        if len(fresh) or len(surviving) < mine.sum():
            order = self._places(view.current_ids())
            usable = order >= 0
            if usable.all():
                view.in_step(self._sources[order], self._source_id[order])
        view.adopt_geometry(self._sources)

    def _keep(self, mask: Any) -> None:
        for row in np.flatnonzero(~mask):
            self._deleted[int(self._source_id[row])] = self._sources[[row]]
        self._sources = self._sources[mask]
        self._source_id = self._source_id[mask]

    def _places(self, ids: Any) -> Any:
        """Rows of the table with these ids, -1 where there is none."""
        known = {int(value): place for place, value in enumerate(self._source_id)}
        return np.array([known.get(int(value), -1) for value in ids], dtype=np.intp)

    def _drawn(self, view: SourceLayer, row: int) -> QTable:
        """Return the table row of a source that was drawn (as the form says) or pasted."""
        data, _ = view.read()
        source_id = int(view.current_ids()[row])
        place = int(self._places([source_id])[0])
        if not self._adding and place >= 0:
            base = self._sources[[place]]
        elif not self._adding and source_id in self._deleted:
            base = self._deleted[source_id].copy()
        else:
            base = self._template(view, *data[row].reshape(-1, 2).mean(axis=0))
        return view.moved(base, view.geometry(base), data[row : row + 1])

    def _template(self, view: SourceLayer, y: float, x: float) -> QTable:
        new = dict(self.new_source)
        if not view.holds([new["kind"]])[0]:
            new.update(kind="point" if view is self._points else "exponential", n=None)
        if new["kind"] != "sersic":
            new["n"] = None
        return master_table(source(x=float(x), y=float(y), **new))

    def _color_ellipses(self, view: SourceLayer) -> None:
        if isinstance(view, EllipsesLayer):
            order = self._places(view.current_ids())
            kinds = [str(self._sources["kind"][k]) if k >= 0 else "exponential" for k in order]
            self._quietly(lambda: view.recolor(kinds))

    def _tidy(self) -> None:
        """At rest: refuse foreign shapes, size clicked ellipses, show what the table says."""
        refused = 0
        if self._ellipses.layer is not None:
            refused = self._quietly(self._ellipses.refuse)
            if refused:
                show_warning(
                    "Extended sources are ellipses: draw them with the ellipse tool. "
                    "Other shapes belong on a layer of your own."
                )
            self._size_clicked()
        for view in self._views:
            if view.layer is None:
                continue
            order = self._places(view.current_ids())
            if np.any(order < 0) or len(order) != view.holds(self._sources["kind"]).sum():
                self._write()
                return
            part = self._sources[order]
            if not view.shows(part):
                self._quietly(lambda view=view: view.write(self._sources, self._source_id))
                continue
            if view.changed() or view.stale(part):
                self._color_ellipses(view)
                self._quietly(
                    lambda view=view, part=part, order=order: view.in_step(
                        part, self._source_id[order]
                    )
                )

    def _size_clicked(self) -> None:
        """Give ellipses that were clicked, not drawn, the size and shape of the form."""
        born, self._born = self._born, set()
        if not born:
            return
        self._sources = self._sources.copy()
        for row in self._places(sorted(born)):
            if row < 0 or self._sources["kind"][row] == "point":
                continue
            if self._sources["r_half"][row].value < 1.0:
                base = self._template(self._ellipses, 0.0, 0.0)
                for name in ("r_half", "ellipticity", "pa"):
                    self._sources[name][row] = base[name][0]
                self._version += 1

    def _quietly(self, action: Callable[[], Any]) -> Any:
        self._writing = True
        try:
            return action()
        finally:
            self._writing = False

    # ------------------------------------------------------------------ from scene to image

    def _touch(self) -> None:
        self._version += 1
        self._timer.start(0)

    def _refresh(self) -> None:
        """Bring table and picture in step with what the user did; cheap if nothing changed."""
        self._timer.stop()
        self._take_over()
        if self._dormant:
            self._jobs.drop()
            return
        if self._drag is None:
            self._pause.stop()
            self._rest()
        elif self._requested[0] != self._version:
            self._request_preview(self._drag)
            self._pause.start()

    def _rest(self) -> None:
        """Ask for the final picture unless it is there or on its way."""
        if self._requested == (self._version, True) and (
            self._jobs.busy or self._shown == self._requested or self._error is not None
        ):
            return
        ticket = self._requested = (self._version, True)
        maker, args = self._maker, (self._sources.copy(), self._observation, self._seed)
        self._error = None

        def job() -> tuple[tuple[int, bool], Picture]:
            return ticket, maker.final(*args)

        self._jobs.request(job)

    def _request_preview(self, drag: Drag) -> None:
        ticket = self._requested = (self._version, False)
        maker = self._maker
        args = (drag, self._sources, self._source_id, self._observation, self._seed)
        self._error = None

        def job() -> tuple[tuple[int, bool], Picture]:
            return ticket, maker.preview(*args)

        self._jobs.request(job)

    def _show(self, result: tuple[tuple[int, bool], Picture]) -> None:
        self._shown, picture = result
        if self._dormant:
            return
        previous, self._picture = self._picture, picture
        if self._image is None:
            self._ensure_layers()
        assert self._image is not None
        exposure = picture.exposure
        self._image.data = exposure.counts
        if not picture.final:
            return
        self._image.metadata = {
            **self._image.metadata,
            MARKER: {"role": "counts", "exposure": exposure},
        }
        self._scale_image(exposure)
        shape = exposure.counts.shape
        if previous is None or previous.exposure.counts.shape != shape:
            ours = {self._image, self._points.layer, self._ellipses.layer}
            if all(layer in ours for layer in self.viewer.layers):
                self.viewer.reset_view()
        self.events.picture()

    def _scale_image(self, exposure: Exposure) -> None:
        """Set the contrast limits, unless the user chose some for this instrument set-up."""
        image = cast(Image, self._image)
        by_hand = self._limits is not None and tuple(image.contrast_limits) != self._limits
        if self._rescale and (self._by_hand_ends or not by_hand):
            limits = contrast_limits(exposure.counts, exposure.background)
            image.contrast_limits_range = (0.0, max(float(exposure.counts.max()), limits[1]))
            image.contrast_limits = limits
            self._limits = cast(tuple[float, float], tuple(image.contrast_limits))
        self._rescale = self._by_hand_ends = False

    def _failed(self, error: BaseException) -> None:
        self._error = error


def scene_of(viewer: Any) -> Scene | None:
    """Return the live scene of a viewer, if it has one."""
    viewer = getattr(viewer, "__wrapped__", viewer)
    scene = _SCENES.get(id(viewer))
    return scene if scene is not None and scene.viewer is viewer else None


def open_scene(
    sources: Table | None = None,
    observation: Observation | None = None,
    *,
    viewer: Any = None,
    dock: bool = True,
    seed: int | None = None,
) -> Scene:
    """Open a live scene in a viewer, or give the viewer's scene new sources.

    Parameters
    ----------
    sources : astropy.table.QTable, optional
        Source table; by default those of the scene that the viewer has, or none.
    observation : Observation, optional
        Instrument set-up.
    viewer : napari.Viewer, optional
        A new one by default.
    dock : bool
        Whether to open the dock widget too.
    seed : int, optional
        Seed of the noise.

    Returns
    -------
    Scene
    """
    table = None if sources is None else master_table(sources)
    if viewer is None:
        viewer = Viewer(title="napari-issis")
    viewer = getattr(viewer, "__wrapped__", viewer)
    scene = scene_of(viewer) or _adopted(viewer) or Scene(viewer)
    if observation is not None:
        scene.observation = observation
    if seed is not None:
        scene.seed = seed
    if table is not None:
        scene._replace(table)
    elif scene._dormant:
        scene._write()
        scene._touch()
    if dock:
        from .dock import dock_simulator

        dock_simulator(viewer)
    return scene


def marked_layers(viewer: Any) -> dict[str, Any]:
    """Layers with our mark that belong to no scene, by role (the uppermost of each)."""
    scene = scene_of(viewer)
    owned = (
        [] if scene is None else [scene._image, scene._points.layer, scene._ellipses.layer]
    )
    found = {}
    for layer in viewer.layers:
        mark = layer.metadata.get(MARKER)
        if isinstance(mark, dict) and "role" in mark and not any(layer is own for own in owned):
            found[mark["role"]] = layer
    return found


def _adopted(viewer: Any) -> Scene | None:
    """Make a scene from layers of ours that lie in the viewer, such as a sample's."""
    layers = marked_layers(viewer)
    image = layers.get("counts")
    exposure = None if image is None else image.metadata[MARKER].get("exposure")
    if exposure is None:
        return None
    scene = Scene(viewer)
    scene.use_layers(image, layers.get("points"), layers.get("ellipses"))
    scene._observation, scene._seed = exposure.observation, exposure.seed
    scene._replace(master_table(exposure.sources))
    return scene

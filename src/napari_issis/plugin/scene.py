"""The live scene: what is edited, how it is observed, and the picture that follows."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, cast
from weakref import WeakValueDictionary

import numpy as np
from astropy.table import QTable, Table
from napari.layers import Image
from napari.utils.events import EmitterGroup, Event
from napari.utils.notifications import show_info
from napari.viewer import Viewer
from qtpy.QtCore import QEventLoop
from qtpy.QtWidgets import QApplication

from ..exposure import Exposure
from ..observation import Observation
from ..source_rates import rates_per_flux
from ..sources import IMAGE, KINDS, source
from .counts_layer import CountsLayer
from .editor import SourceEditor
from .layer_keys import LayerKeys
from .live_picture import LivePicture, SceneNow
from .marks import MARKER
from .picture import Picture
from .pointer import Pointer
from .single_shot import single_shot
from .source_columns import of_kind
from .table import master_table, put
from .units import Units

# The live scene of each viewer, kept alive by its pointer in the viewer's mouse callbacks.
_SCENES: WeakValueDictionary[int, Scene] = WeakValueDictionary()

# When a zoom rests for so long (ms), the ellipses' edges are drawn as thin as before.
ZOOM_PAUSE = 80
# Key presses with no more than this (ms) between them are one nudge.
BURST = 600
# Row 0 at the bottom and x to the right, as astronomers expect.
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
        ``picture`` after each exposure that came to the screen at rest, ``shown`` after each
        one, previews included, ``observation`` after a change of the instrument set-up or the seed,
        ``sources`` after a change of the source table, also during a drag, ``selection`` when
        other sources are selected, ``progress`` after a change of `slow` or `cancelled`,
        ``missing`` when a layer of the scene was deleted or is back.
    units : Units
        What fluxes and lengths are shown in.
    """

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self.events = EmitterGroup(
            source=self,
            picture=Event,
            shown=Event,
            observation=Event,
            sources=Event,
            selection=Event,
            progress=Event,
            missing=Event,
        )
        self.editor = SourceEditor(self._soon, self._selected)
        self.counts = CountsLayer()
        self.units = Units()
        self._observation = Observation()
        self._fit_marks()
        self._seed = 0
        self._orientation = viewer.scene.camera.orientation2d
        self._told = False

        self._live = LivePicture(self._now, self._shows, self._show, self.events.progress)
        self._set_up = 0
        self._told_version = 0
        self._told_missing: tuple[str, ...] = ()
        self._timer = single_shot(self._refresh)
        self._zoomed = single_shot(self._follow_zoom, ZOOM_PAUSE)
        viewer.scene.camera.events.zoom.connect(self._zoom_changed)
        self._keys = LayerKeys(self)
        self._burst = single_shot(self._end_nudge, BURST)

        self.pointer = Pointer(self)
        viewer.layers.events.removed.connect(self._layer_removed)
        _SCENES[id(viewer)] = self

    # ---------------------------------------------------------------- what scripts use

    @property
    def sources(self) -> QTable:
        """A copy of the source table; setting it replaces all sources.

        Positions and radii are in pixels, angles in degrees, the flux in the unit given.
        A table with an error raises a ``ValueError`` and leaves the scene as it was.
        """
        self.editor.take_over()
        return self.editor.sources.copy()

    @sources.setter
    def sources(self, table: Table) -> None:
        self.editor.replace(self._checked(table))
        self.counts.rescale()
        self._show_sources(all_layers=True)
        points = self.editor.points.holds(self.editor.sources["kind"])
        view = self.editor.points if 2 * points.sum() > points.size else self.editor.ellipses
        self.viewer.layers.selection.active = view.layer

    @property
    def new_source(self) -> dict[str, Any]:
        """Arguments of `napari_issis.source` for sources that are drawn by hand."""
        return self.editor.new_source

    @new_source.setter
    def new_source(self, arguments: dict[str, Any]) -> None:
        source(x=0.0, y=0.0, **arguments)
        self.editor.new_source = dict(arguments)

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
        # refused before anything has changed, if a source has no light in a new channel
        rates_per_flux(self.editor.sources, observation)
        rescaled = observation.pixel_scale != self._observation.pixel_scale
        reframed = rescaled or observation.shape != self._observation.shape
        self._observation = observation
        self.editor.observe(observation)
        if reframed:
            self._fit_marks()
            # a view that stays as it is shows the new frame at another zoom than the whole
            self._zoom_changed()
        if rescaled and self.counts.layer is not None:
            self.counts.layer.scale = (observation.pixel_scale, observation.pixel_scale)
            if self._alone:
                self.viewer.reset_view(layers=[self.counts.layer])
        self.counts.rescale(always=True)
        self._set_up += 1
        self._soon()
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
            self._set_up += 1
            self._soon()
            self.events.observation()

    @property
    def exposure(self) -> Exposure:
        """The exposure of the scene as it is now; waits until it is made."""
        self.wait()
        assert self.picture is not None
        return self.picture.exposure

    @property
    def picture(self) -> Picture | None:
        """What is on the screen now; None before the first exposure."""
        return self._live.picture

    @property
    def settled(self) -> bool:
        """Whether the picture is that of the scene as it is now, and no preview."""
        return not self._timer.isActive() and self._live.settled

    @property
    def slow(self) -> bool:
        """Whether a picture is being made and takes long."""
        return self._live.slow

    @property
    def cancelled(self) -> bool:
        """Whether the picture of the scene as it is now was cancelled: an older one is shown."""
        return self._live.cancelled

    def cancel(self) -> None:
        """Keep the picture that is shown; the scene is simulated at its next change.

        What is being computed runs on to its end in the background; its result is dropped.
        """
        self._live.cancel()

    def simulate(self) -> None:
        """Simulate the scene after all, if that was cancelled."""
        if self.cancelled:
            self._live.resume()
            self._soon()

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
        self.editor.take_over()
        self.editor.append(self._checked(table))
        self.counts.rescale()
        self._show_sources()

    def change(self, table: Table) -> None:
        """Put an edited copy of `sources`, with the same rows, in its place.

        Raises
        ------
        ValueError
            If the table has an error or other rows; the scene stays as it was.
        """
        self.editor.take_over()
        if len(table) != len(self.editor.sources):
            raise ValueError(
                f"the table has {len(table)} rows, the scene {len(self.editor.sources)} sources; "
                "use `sources` or `add` to change their number."
            )
        self.editor.change(self._checked(table))
        self._show_sources()

    def _checked(self, table: Table) -> QTable:
        """Master table of sources that all have a count rate in this observation."""
        master = master_table(table, self._observation.pixel_scale)
        rates_per_flux(master, self._observation)
        return master

    def remove(self, ids: Iterable[int]) -> None:
        """Remove the sources with these ids (of `SourceEditor.source_id`)."""
        self.editor.take_over()
        self.editor.remove(ids)
        self._show_sources()

    def next_kind(self, layer: Any = None) -> None:
        """Make the selected sources all of the kind after that of the first; images stay."""
        self.editor.take_over()
        ids = self.editor.selected_ids
        table = self.editor.sources.copy()
        rows = np.flatnonzero(np.isin(self.editor.source_id, list(ids)) & (table["kind"] != IMAGE))
        if not rows.size or self.editor.held is not None:
            return
        kind = KINDS[(KINDS.index(str(table["kind"][rows[0]])) + 1) % len(KINDS)]
        part = of_kind(table[rows], kind)
        for name in part.colnames:
            put(table, name, rows, part[name])
        self.change(table)
        # those that went to the other layer too
        self.editor.select(ids)

    def nudge(self, right: float, up: float) -> None:
        """Move the selected sources as seen on the screen; several moves at once are one step.

        Parameters
        ----------
        right, up : float
            Pixels.
        """
        if self.viewer.scene.camera.orientation2d[0] == "down":
            up = -up
        self.editor.take_over()
        if self.editor.nudge(right, up):
            self._burst.start()
            self._soon()

    def _end_nudge(self) -> None:
        self.editor.end_nudge()
        self._soon()

    def undo(self, event: Any = None) -> None:
        """Take back the last edit of sources, PSF or frame; nothing while the mouse holds one."""
        self.editor.take_over()
        if self.editor.undo():
            self._restored()

    def redo(self, event: Any = None) -> None:
        """Do again the edit that was taken back last."""
        self.editor.take_over()
        if self.editor.redo():
            self._restored()

    def _restored(self) -> None:
        self._show_sources()
        # undo and redo change the PSF and the frame too
        self.observation = self.editor.observation

    def wait(self, timeout: float = 60.0) -> None:
        """Wait until the picture is settled; keeps the window alive meanwhile.

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
        self.show_layers()
        self.simulate()
        self._refresh()
        until = time.monotonic() + timeout
        while not self.settled:
            error = self._live.error
            if error is not None:
                raise RuntimeError(f"the scene could not be simulated: {error}") from error
            if time.monotonic() > until:
                raise TimeoutError(f"the scene was not simulated within {timeout:g} s.")
            QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 10)
            time.sleep(0.001)

    # ---------------------------------------------------------------- layers in the viewer

    @property
    def layers(self) -> list[Any]:
        """The scene's layers that are in the viewer, from the bottom up."""
        image = [] if self.counts.layer is None else [self.counts.layer]
        return image + self.editor.layers

    @property
    def missing(self) -> tuple[str, ...]:
        """Roles of the layers that the user deleted: ``counts``, ``ellipses``, ``points``.

        A layer of sources comes back with the first source for it, the image by `restore`.
        """
        image = () if self.counts.layer is not None else ("counts",)
        return image + tuple(view.role for view in self.editor.views if view.layer is None)

    def restore(self) -> None:
        """Make the layers that the user deleted anew, with the sources that went with them.

        Raises
        ------
        ValueError
            If such a source has no light in the present channel; the scene stays as it was.
        """
        self.editor.take_over()
        state = self.editor.with_lost()
        rates_per_flux(state.sources, self._observation)
        self._ensure_layers(all_layers=True)
        if len(state.source_id) > len(self.editor.source_id):
            self.editor.restore(state)
            self.editor.write()
        self._soon()

    def show_layers(self) -> None:
        """Make the layers anew if the user deleted all three."""
        if not self.layers:
            self._ensure_layers()
            self._soon()

    def use_layers(self, image: Image, points: Any, ellipses: Any) -> None:
        """Take over layers that carry our mark, as a sample has them."""
        exposure = image.metadata[MARKER]["exposure"]
        self.counts.layer = image
        self.editor.points.layer, self.editor.ellipses.layer = points, ellipses
        self._orient()
        self.viewer.reset_view(layers=[image])
        for layer in self.editor.layers:
            self.editor.listen(layer)
        for layer in self.layers:
            self._keys.bind(layer)
        self.observation, self.seed = exposure.observation, exposure.seed
        self.sources = exposure.sources

    def _show_sources(self, *, all_layers: bool = False) -> None:
        self._ensure_layers(all_layers=all_layers)
        self.editor.write()
        self._soon()

    def _ensure_layers(self, *, all_layers: bool = False) -> None:
        """Make layers that are missing: the image lowest, the points uppermost.

        Those that the user deleted only where sources need them, unless ``all_layers`` is set
        or there is none at all.
        """
        layers = self.viewer.layers
        new = not self.layers
        all_layers = all_layers or new
        selected, active = set(layers.selection), layers.selection.active
        if new:
            self._orient()
        if self.counts.layer is None and all_layers:
            observation = self._observation
            image = self.counts.make(observation.shape, observation.pixel_scale, self.picture)
            place = min((layers.index(above) for above in self.editor.layers), default=len(layers))
            layers.insert(place, image)
            self._keys.bind(image)
        with self.editor.quiet():
            for view in self.editor.views:
                needed = all_layers or view.holds(self.editor.sources["kind"]).any()
                if view.layer is None and needed:
                    view.forget()
                    view.layer = view.make()
                    points = self.editor.points.layer
                    below = view is self.editor.ellipses and points is not None
                    layers.insert(layers.index(points) if below else len(layers), view.layer)
                    self.editor.listen(view.layer)
                    self._keys.bind(view.layer)
        if new:
            self.viewer.reset_view(layers=[self.counts.layer])
        elif active is not None and layers.selection.active is not active:
            # napari makes a new layer the active one; the mouse may be dragging in another
            layers.selection.clear()
            layers.selection.update(selected)
            layers.selection.active = active

    def _selected(self) -> None:
        self.editor.end_nudge()
        self._keys.follow_selection()
        self.events.selection()

    def _fit_marks(self) -> None:
        with self.editor.quiet():
            for view in self.editor.views:
                view.fit(self._observation.shape, self._observation.pixel_scale)

    def _zoom_changed(self, event: Any = None) -> None:
        self._zoomed.start()

    def _follow_zoom(self) -> None:
        with self.editor.quiet():
            self.editor.ellipses.follow_zoom(self.viewer.scene.camera.zoom)

    @property
    def _alone(self) -> bool:
        """Whether the viewer holds no layers of others."""
        return all(any(layer is own for own in self.layers) for layer in self.viewer.layers)

    def _orient(self) -> None:
        """Draw row 0 at the bottom, unless that would turn the images of others."""
        camera = self.viewer.scene.camera
        self._orientation = camera.orientation2d
        if self._alone:
            camera.orientation2d = ORIENTATION
        elif not self._told:
            self._told = True
            text = f"The ISSIS layers are in arcsec ({self._observation.pixel_scale:g} per pixel)"
            if camera.orientation2d[0] == "down":
                text += ", with row 0 drawn at the top because the viewer has other layers"
            show_info(f"{text}.")

    def _layer_removed(self, event: Any) -> None:
        if event.value is self.counts.layer:
            self.counts.layer = None
            self._soon()
        self.editor.layer_removed(event.value)
        if not self.layers and self.viewer.scene.camera.orientation2d == ORIENTATION:
            self.viewer.scene.camera.orientation2d = self._orientation

    # ---------------------------------------------------------------- from scene to image

    def _now(self) -> SceneNow:
        editor = self.editor
        return SceneNow(
            version=(editor.version, self._set_up),
            sources=editor.sources,
            source_id=editor.source_id,
            observation=self._observation,
            seed=self._seed,
            held=editor.held,
        )

    def _soon(self) -> None:
        """Look once, when napari has done with what it is doing."""
        self._timer.start(0)

    def _refresh(self) -> None:
        """Bring table and picture in step with what the user did; cheap if nothing changed."""
        self._timer.stop()
        self.editor.take_over()
        if self._told_version != self.editor.version:
            self._told_version = self.editor.version
            self.events.sources()
        if self._told_missing != self.missing:
            self._told_missing = self.missing
            self.events.missing()
        if self.layers:
            self._live.follow()
        else:
            self._live.drop()

    def _shows(self) -> bool:
        """Whether all layers are there: a window that is closed takes them away one by one."""
        layers = self.layers
        return bool(layers) and all(layer in self.viewer.layers for layer in layers)

    def _show(self, picture: Picture, previous: Picture | None) -> None:
        self.counts.show(picture)
        shape = picture.exposure.counts.shape
        if (
            self.counts.layer is not None
            and self._alone
            and (previous is None or previous.exposure.counts.shape != shape)
        ):
            self.viewer.reset_view(layers=[self.counts.layer])
        self.events.shown()
        if picture.final:
            self.events.picture()


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

    Raises
    ------
    ValueError
        If the source table has an error; no window is opened then.
    """
    known = None if viewer is None else scene_of(viewer)
    given = observation or (Observation() if known is None else known.observation)
    table = None if sources is None else master_table(sources, given.pixel_scale)
    if viewer is None:
        viewer = Viewer(title="napari-issis")
    # Widgets get a proxy of the viewer, which must not be mistaken for another one.
    viewer = cast(Viewer, getattr(viewer, "__wrapped__", viewer))
    scene = scene_of(viewer)
    new = scene is None
    if scene is None:
        scene = Scene(viewer)
        found = marked_layers(viewer)
        if "counts" in found:
            scene.use_layers(found["counts"], found.get("points"), found.get("ellipses"))
    if observation is not None:
        scene.observation = observation
    if seed is not None:
        scene.seed = seed
    if table is not None:
        scene.sources = table
    if new:
        scene.editor.history.restart(scene.editor.history.present)
    scene.show_layers()
    if dock:
        from .dock import dock_simulator

        dock_simulator(viewer)
    return scene


def marked_layers(viewer: Any) -> dict[str, Any]:
    """Layers with our mark that belong to no scene, by role (the uppermost of each)."""
    scene = scene_of(viewer)
    owned = [] if scene is None else scene.layers
    found = {}
    for layer in viewer.layers:
        mark = layer.metadata.get(MARKER)
        if not isinstance(mark, dict) or any(layer is own for own in owned):
            continue
        if mark.get("role") in ("points", "ellipses") or isinstance(mark.get("exposure"), Exposure):
            found[mark["role"]] = layer
    return found

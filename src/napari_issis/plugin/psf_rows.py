"""The rows of the instrument panel that edit the PSF's blurs and halo, and tell its width."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from magicgui.widgets import PushButton
from qtpy.QtCore import Qt
from qtpy.QtGui import QShowEvent
from qtpy.QtWidgets import QLabel, QToolButton

from ..encircled_energy import psf_table
from ..psf import PSF, RadialPSF, TelescopePSF
from ..psf_blurs import BLURS, blurs_of, with_blurs
from .form import Form
from .latest_wins import LatestWins
from .number_field import INVALID_STYLE, NumberField
from .scene import Scene

# Diameters in arcsec of the circles whose share of the light is told.
CIRCLES = (0.1, 0.2, 0.5, 1.0)
FIXED = "The PSF was given by a script: its blurs cannot be edited here."


class PsfRows:
    """Jitter, detector blur and halo; folded away until the user opens them.

    Parameters
    ----------
    form : Form
        The rows are added to it.
    scene : Scene
        The live scene.
    """

    def __init__(self, form: Form, scene: Scene) -> None:
        self._form = form
        self.scene = scene
        self.unfold = QToolButton()
        self.unfold.setText("PSF")
        self.unfold.setCheckable(True)
        self.unfold.setAutoRaise(True)
        self.unfold.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.unfold.setToolTip("Show or hide what blurs the PSF, and how much light is where")
        self.text = QLabel()
        self.text.setWordWrap(True)
        self.text.setMinimumWidth(10)
        form.add_native(self.unfold, self.text)
        self.jitter = _field(
            "jitter_fwhm", "Jitter of the pointing: FWHM of a Gaussian blur, arcsec; 0 for none"
        )
        self.blur = _field(
            "blur_fwhm",
            "Blur of the detector (of the channel's own PSF that of the pointing too): FWHM of a "
            "Gaussian, arcsec; jitter and blur add in quadrature",
        )
        self.share = _field(
            "halo_share", "Share of the light that the detector spreads into a halo, 0 to 1"
        )
        self.width = _field(
            "halo_fwhm", "Width of the halo: FWHM of a Gaussian, arcsec; above 0 if it has a share"
        )
        self.own = PushButton(
            text="Channel's own", tooltip="Take the PSF that the channel has by itself"
        )
        self.read_out = _ReadOut(self._measure)
        self.read_out.setToolTip(
            "Full width at half maximum, and share of a star's light within circles about it; "
            "the detector's pixel is no part of it"
        )
        self._rows = [
            form.add("Blurs (″)", self.jitter, self.blur),
            form.add("Halo (1, ″)", self.share, self.width),
            form.add("", self.own),
        ]
        name = QLabel("Light in ⌀")
        name.setToolTip(self.read_out.toolTip())
        form.add_native(name, self.read_out)
        self._rows.append(self.read_out)
        self._shown: PSF | None = None
        self._jobs = LatestWins(self._show_table, self._failed)
        self.unfold.toggled.connect(self._show_rows)
        for field in self._fields:
            field.native.editingFinished.connect(self.apply_typed)
        self.own.changed.connect(lambda: self._observe(with_blurs(self.scene.observation)))
        self._show_rows(False)

    @property
    def _fields(self) -> tuple[NumberField, ...]:
        """In the order of `BLURS`."""
        return self.jitter, self.blur, self.share, self.width

    def show_observation(self) -> None:
        """Show the PSF of the scene's observation."""
        observation = self.scene.observation
        blurs = blurs_of(observation)
        if observation.psf_assumed:
            text = f"assumed for {observation.instrument.name}"
        elif blurs:
            text = "assumed, with blurs and halo as edited"
        else:
            text = f"{type(observation.psf).__name__}, given by a script"
        self.text.setText(text)
        self.text.setToolTip(observation.instrument.psf_note)
        psf = observation.effective_psf
        self.own.enabled = not observation.psf_assumed
        for field, name in zip(self._fields, BLURS, strict=True):
            field.enabled = blurs is not None and isinstance(psf, TelescopePSF)
            # what is being typed, or has to be corrected, stays unless the PSF changed
            if isinstance(psf, TelescopePSF) and psf != self._shown:
                field.number = getattr(psf, name)
            elif not isinstance(psf, TelescopePSF):
                field.value = ""
            if blurs is None:
                field.native.setStyleSheet("")
                field.native.setToolTip(FIXED)
        self._shown = psf
        self._measure()

    def apply_typed(self) -> None:
        """Take over what was typed and not confirmed yet; what is wrong stays, marked."""
        if blurs_of(self.scene.observation) is None:
            return
        try:
            blurs = {name: field.number for field, name in zip(self._fields, BLURS, strict=True)}
        except ValueError:
            return
        try:
            observation = with_blurs(self.scene.observation, **blurs)
        except ValueError as error:
            # each is allowed by itself: a halo lacks its width
            self.width.native.setStyleSheet(INVALID_STYLE)
            self.width.native.setToolTip(str(error))
            return
        self.width.native.setStyleSheet("")
        self._observe(observation)

    def pause(self) -> None:
        """Measure nothing more."""
        self._jobs.cancel()

    def _observe(self, observation: Any) -> None:
        self.scene.observation = observation
        self.show_observation()

    def _show_rows(self, on: bool) -> None:
        arrow = Qt.ArrowType.DownArrow if on else Qt.ArrowType.RightArrow
        self.unfold.setArrowType(arrow)
        for row in self._rows:
            self._form.show_row(row, on)

    def _measure(self) -> None:
        """Have the PSF measured in the background, if somebody sees the result."""
        if not self.read_out.isVisible():
            return
        psf = self.scene.observation.effective_psf
        if not isinstance(psf, RadialPSF):
            self._jobs.cancel()
            self.read_out.setText("not measured: the PSF is an image")
            return
        if not self.read_out.text():
            self.read_out.setText("…")
        self.read_out.setEnabled(False)
        self._jobs.request(lambda: (psf, psf_text(psf)))

    def _show_table(self, result: tuple[PSF, str]) -> None:
        psf, text = result
        if psf == self.scene.observation.effective_psf:
            self.read_out.setText(text)
            self.read_out.setEnabled(True)

    def _failed(self, error: BaseException) -> None:
        self.read_out.setText(f"not measured: {error}")


@lru_cache(maxsize=64)
def psf_text(psf: RadialPSF) -> str:
    """Full width at half maximum and encircled energy of a PSF; takes some tenths of a second."""
    table = psf_table(psf, CIRCLES)
    shares = ", ".join(
        f"{diameter.value:g}″ {100 * share:.1f} %"
        for diameter, share in zip(table["diameter"], table["encircled_energy"], strict=True)
    )
    return f"{shares}; FWHM {table.meta['fwhm'].value:.4f}″"


class _ReadOut(QLabel):  # type: ignore[misc]
    """Text that is made when it comes into sight."""

    def __init__(self, make: Any) -> None:
        super().__init__()
        self._make = make
        self.setWordWrap(True)
        self.setMinimumWidth(10)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)

    def showEvent(self, event: QShowEvent) -> None:
        """Have the text made."""
        super().showEvent(event)
        self._make()


def _field(name: str, tooltip: str) -> NumberField:
    halo = {"halo_fwhm": 1.0} if name == "halo_share" else {}

    def check(number: float) -> TelescopePSF:
        return TelescopePSF(1.7, **{**halo, name: number})

    return NumberField(name, 0.0, tooltip, check=check)

"""The spectrum of new sources, typed or chosen from examples."""

from __future__ import annotations

from collections.abc import Callable

from qtpy.QtWidgets import QComboBox, QFileDialog

from ..spectra import FLAT, Spectrum, parse_spectrum
from .count_field import INVALID_STYLE

EXAMPLES = ("flat", "powerlaw(-1.5)", "blackbody(30000 K)", "line(1550 A, 10 A)")
FROM_FILE = "table from a file…"
HELP = (
    "Spectrum: flat, powerlaw(index), blackbody(T in K), line(wavelength, FWHM in Å) or "
    'table("file"). Options within the brackets: z= redshift, ebv= reddening E(B−V), at= the '
    "wavelength in Å at which F is given (else F is the mean over the channel's band), as in "
    "powerlaw(-1.5, z=1.7, ebv=0.05, at=1500)"
)


class SpectrumField:
    """A field for the text of a spectrum; red, with the reason as tooltip, if it is none.

    Parameters
    ----------
    check : callable
        Raises a ``ValueError`` if a spectrum is not allowed.
    """

    def __init__(self, check: Callable[[Spectrum], object]) -> None:
        self.tooltip, self._check = HELP, check
        self.native = QComboBox()
        self.native.setEditable(True)
        self.native.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.native.setCompleter(None)
        self.native.addItems([*EXAMPLES, FROM_FILE])
        self.native.setToolTip(HELP)
        self.native.editTextChanged.connect(self._mark)
        self.native.activated.connect(self._chosen)
        self._before = self.native.currentText()

    @property
    def text(self) -> str:
        """The text of a valid spectrum; a ``ValueError`` that names what is wrong with it."""
        try:
            spectrum = parse_spectrum(self.native.currentText())
            self._check(spectrum)
            return str(spectrum)
        except (ImportError, ValueError) as error:
            raise ValueError(f"spectrum: {error}") from error

    @text.setter
    def text(self, text: str) -> None:
        self.native.setEditText(text)

    @property
    def valid(self) -> bool:
        """Whether the text is that of a spectrum that is allowed."""
        try:
            return bool(self.text)
        except ValueError:
            return False

    @property
    def options(self) -> dict[str, str]:
        """Argument of `napari_issis.source`; none for the flat spectrum."""
        return {} if self.text == str(FLAT) else {"spectrum": self.text}

    def mark(self) -> None:
        """Check the text again, as when what is allowed has changed."""
        self._mark(self.native.currentText())

    def ask_path(self) -> str | None:
        """Ask for the file of a spectrum; None if the user changed his mind."""
        path, _ = QFileDialog.getOpenFileName(
            self.native, "Spectrum", "", "Tables of wavelength and flux (*.ecsv *.csv *.fits)"
        )
        return path or None

    def _chosen(self, row: int) -> None:
        if self.native.itemText(row) == FROM_FILE:
            path = self.ask_path()
            self.text = self._before if path is None else f'table("{path}")'

    def _mark(self, text: str) -> None:
        if text == FROM_FILE:
            return
        self._before = text
        try:
            _ = self.text
        except ValueError as error:
            style, help_ = INVALID_STYLE, str(error)
        else:
            style, help_ = "", HELP
        self.native.setStyleSheet(style)
        self.native.setToolTip(help_)

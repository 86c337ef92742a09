"""Undo and redo: the sources, PSFs and frames that were, and those that were undone."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from ..exposure import same_table
from ..observation import Observation
from ..psf import PSF

MOST_STEPS = 200
# cells kept in all: large scenes keep fewer steps, but never less than LEAST_STEPS
MOST_CELLS = 20_000_000
LEAST_STEPS = 50


@dataclass(frozen=True, eq=False)
class SourceState:
    """What can be undone.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table, which nobody changes in place.
    source_id : ndarray of int
        The ids of its rows.
    psf : dict or PSF, optional
        What was chosen as the PSF, see `napari_issis.psf_blurs.psf_choice`.
    shape : (int, int), optional
        The frame ``(ny, nx)``.
    """

    sources: QTable
    source_id: NDArray[np.int64]
    psf: dict[str, float] | PSF = field(default_factory=dict)
    shape: tuple[int, int] = Observation().shape

    def same(self, other: SourceState) -> bool:
        """Whether both hold the same rows, PSF and frame."""
        return self.shape == other.shape and self.psf == other.psf and self.same_rows(other)

    def same_rows(self, other: SourceState) -> bool:
        """Whether both hold the same rows."""
        return np.array_equal(self.source_id, other.source_id) and (
            self.sources is other.sources or same_table(self.sources, other.sources)
        )


class History:
    """The states of a scene's sources, each reached by one edit from the one before.

    Parameters
    ----------
    state : SourceState
        The state to begin with.
    """

    def __init__(self, state: SourceState) -> None:
        self.restart(state)

    def restart(self, state: SourceState) -> None:
        """Forget everything and begin with a state."""
        self.present = state
        self._past: deque[SourceState] = deque()
        self._undone: list[SourceState] = []

    def note(self, state: SourceState) -> None:
        """Note a state; nothing happens if it is the present one."""
        if state.same(self.present):
            # an equal table may have been made anew
            self.present = state
            return
        self._past.append(self.present)
        self.present = state
        self._undone.clear()
        cells = len(state.sources) * len(state.sources.colnames)
        while len(self._past) > max(LEAST_STEPS, min(MOST_STEPS, MOST_CELLS // max(cells, 1))):
            self._past.popleft()

    def undo(self) -> SourceState | None:
        """Go one step back; None if there is none."""
        if not self._past:
            return None
        self._undone.append(self.present)
        self.present = self._past.pop()
        return self.present

    def redo(self) -> SourceState | None:
        """Go one step forward again; None if there is none."""
        if not self._undone:
            return None
        self._past.append(self.present)
        self.present = self._undone.pop()
        return self.present

    @property
    def last_step(self) -> str:
        """What `undo` would take back, in words; empty if there is nothing."""
        return describe(self._past[-1], self.present) if self._past else ""

    @property
    def next_step(self) -> str:
        """What `redo` would do again, in words; empty if there is nothing."""
        return describe(self.present, self._undone[-1]) if self._undone else ""


def describe(before: SourceState, after: SourceState) -> str:
    """Say what leads from one state to the next, such as ``move 1 source``."""
    if before.same_rows(after):
        return "change the PSF" if before.shape == after.shape else "change the frame"
    added = int(np.isin(after.source_id, before.source_id, invert=True).sum())
    removed = int(np.isin(before.source_id, after.source_id, invert=True).sum())
    if added and removed:
        return f"replace {_sources(removed)} by {_sources(added)}"
    if added or removed:
        return f"add {_sources(added)}" if added else f"remove {_sources(removed)}"
    order = np.argsort(before.source_id), np.argsort(after.source_id)
    changed: dict[str, NDArray[np.bool_]] = {}
    for name in after.sources.colnames:
        new = _values(after.sources, name)[order[1]]
        if name not in before.sources.colnames:
            changed[name] = np.ones(new.shape, dtype=bool)
            continue
        old = _values(before.sources, name)[order[0]]
        differs = np.asarray(old != new)
        if old.dtype.kind == new.dtype.kind == "f":
            differs &= ~(np.isnan(old) & np.isnan(new))
        if differs.any():
            changed[name] = differs
    if not changed:
        return "change the units"
    count = int(np.logical_or.reduce(list(changed.values())).sum())
    verb = "move" if set(changed) <= {"x", "y"} else "change"
    return f"{verb} {_sources(count)}"


def _values(table: QTable, name: str) -> NDArray[np.generic]:
    column = table[name]
    return np.asarray(getattr(column, "value", column))


def _sources(count: int) -> str:
    return f"{count} source" if count == 1 else f"{count} sources"

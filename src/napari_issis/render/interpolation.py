"""From coarse meshes to finer ones, down to the pixels."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import signal, sparse

from .plan import Plan

Array = NDArray[np.float64]
# first and last mesh index of an axis, counted from position 0
Span = tuple[int, int]


def spans(plan: Plan, shape: tuple[int, int], levels: int) -> list[tuple[Span, Span]]:
    """Mesh points (y, x) of each level from which the frame's pixels can be interpolated.

    Below a cell of one pixel, and at one pixel, those are just the frame's.
    """
    y, x = _finest(plan, shape[0]), _finest(plan, shape[1])
    result = [(y, x)]
    for level in range(1, levels):
        taps = plan.taps() if plan.cell_size(level) > 1 else 0
        y, x = _coarser(y, taps), _coarser(x, taps)
        result.append((y, x))
    return result


def add_up(plan: Plan, results: list[Array | None], shape: tuple[int, int]) -> Array:
    """Interpolate the levels' contributions down to the pixels and add all.

    Parameters
    ----------
    plan : Plan
        Cells and filter.
    results : list of ndarray or None
        Contribution of each level at its `spans`; at the pixels where cells are not larger.
    shape : (int, int)
        Frame (ny, nx) in pixels.
    """
    at = spans(plan, shape, len(results))
    carried: Array | None = None
    for level in range(len(results) - 1, -1, -1):
        result = results[level]
        if carried is not None and plan.cell_size(level + 1) > 1:
            carried = _finer(plan, carried, at[level + 1], at[level])
        if result is not None:
            carried = result if carried is None else carried + result
    if carried is None:
        return np.zeros(shape)
    cell, here = plan.cell_size(0), at[0]
    while cell > 1:
        cell /= 2
        steps = round(np.log2(cell))
        there = (_steps(plan, shape[0], steps), _steps(plan, shape[1], steps))
        carried, here = _finer(plan, carried, here, there), there
    return carried


def _finest(plan: Plan, n: int) -> Span:
    cell = plan.cell_size(0)
    return (0, (n - 1) * round(1 / cell)) if cell < 1 else _steps(plan, n, round(np.log2(cell)))


def _steps(plan: Plan, n: int, doublings: int) -> Span:
    """Span of an axis of n pixels on a mesh whose cells are 2^doublings pixels."""
    span = (0, n - 1)
    for _ in range(doublings):
        span = _coarser(span, plan.taps())
    return span


def _coarser(span: Span, taps: int) -> Span:
    """Mesh indices of the next level from which those of ``span`` can be interpolated."""
    return span[0] // 2 - taps, -(-span[1] // 2) + taps


def _finer(
    plan: Plan,
    values: Array,
    at: tuple[Span, Span],
    to: tuple[Span, Span],
) -> Array:
    """Interpolate from one mesh to the next finer one."""
    y = _interpolation(at[0], to[0], plan.taps(), plan.attenuation())
    x = _interpolation(at[1], to[1], plan.taps(), plan.attenuation())
    finer: Array = (x @ (y @ values).T).T
    return finer


@lru_cache(maxsize=64)
def _interpolation(at: Span, to: Span, taps: int, attenuation: float) -> sparse.csr_array:
    """Matrix that interpolates halfway between mesh points by a Kaiser-windowed sinc."""
    offset = np.arange(-taps, taps) + 0.5
    beta = signal.kaiser_beta(attenuation)
    weight = np.sinc(offset) * np.i0(beta * np.sqrt(1 - (offset / (taps + 0.5)) ** 2))
    weight /= weight.sum()
    fine = np.arange(to[0], to[1] + 1)
    even = np.flatnonzero(fine % 2 == 0)
    odd = np.flatnonzero(fine % 2 != 0)
    column = (fine[odd] // 2)[:, None] + np.arange(1 - taps, taps + 1) - at[0]
    rows = np.concatenate([even, np.repeat(odd, 2 * taps)])
    columns = np.concatenate([fine[even] // 2 - at[0], column.ravel()])
    entries = np.concatenate([np.ones(even.size), np.tile(weight, odd.size)])
    return sparse.csr_array(
        (entries, (rows, columns)), shape=(fine.size, at[1] - at[0] + 1), dtype=np.float64
    )

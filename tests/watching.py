"""What runs, by the calls that are made."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any

import pytest
from scipy import fft

TRANSFORMS = [
    kind + name
    for name in ("fft", "fft2", "fftn", "rfft", "rfft2", "rfftn", "dct", "dst", "dctn", "dstn")
    for kind in ("", "i")
]

Calls = list[tuple[Any, ...]]


def watch(monkeypatch: pytest.MonkeyPatch, function: Callable[..., Any]) -> Calls:
    """Record the arguments of all calls of a function, in whichever module it is called."""
    calls: Calls = []

    @functools.wraps(function)
    def watched(*args: Any, **options: Any) -> Any:
        calls.append(args)
        return function(*args, **options)

    found = 0
    for name, module in list(sys.modules.items()):
        if name.startswith("napari_issis"):
            for known_as, value in list(vars(module).items()):
                if value is function:
                    monkeypatch.setattr(module, known_as, watched)
                    found += 1
    assert found, f"nothing in the package calls {function}"
    return calls


def watch_transforms(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """Record the Fourier transforms: the arguments of each."""
    calls: Calls = []
    for name in TRANSFORMS:
        monkeypatch.setattr(fft, name, _recorded(calls, getattr(fft, name)))
    return calls


def _recorded(calls: Calls, function: Callable[..., Any]) -> Callable[..., Any]:
    def recorded(*args: Any, **options: Any) -> Any:
        calls.append(args)
        return function(*args, **options)

    return recorded


def refuse(*args: Any, **options: Any) -> Any:
    """Take the place of what must not run."""
    raise AssertionError("this must not run")

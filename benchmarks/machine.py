"""The machine and the versions a benchmark ran on."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("napari-issis", "numpy", "scipy", "numba", "galsim", "photutils")


def machine() -> str:
    """Processor, cores, Python and packages in one line."""
    processor = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                processor = line.split(":", 1)[1].strip()
                break
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    threads = os.environ.get("OMP_NUM_THREADS")
    limit = f", OMP_NUM_THREADS={threads}" if threads else ""
    return (
        f"{processor}, {os.cpu_count()} cores{limit}, {platform.system()}, "
        f"Python {platform.python_version()}, {packages}"
    )

"""What dask computes of a sequence of exposures: frames of a stack, and files of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from .exposure import Exposure, expected_of_rate, expose, noise_ready_rate, same_table
from .limits import warn_of_a_sequence
from .observation import Observation
from .source_image import SourceImage

if TYPE_CHECKING:
    from .monitoring import Monitoring, PlannedExposure

IMAGES = ("counts", "expected")
# Renders handed to dask at a time by `run`, so that progress can be told.
BATCH = 16


def stack(plan: Monitoring, image: str, coadd: bool) -> Any:
    """Make a lazily computed stack of images; see `Monitoring.stack`."""
    if image not in IMAGES:
        raise ValueError(f"image is {image!r}; known: {', '.join(IMAGES)}.")
    dask, da = import_dask()
    dtype = np.int64 if image == "counts" else np.float64
    frames, rates = [], _rates(plan, dask)
    for index, one in enumerate(plan.exposures):
        name = f"issis-{image}-{plan.token}-{index}"
        draw = dask.delayed(_image, pure=False)
        frames.append(draw(rates[one.render], one, image, dask_key_name=name))
    if coadd:
        together = dask.delayed(add_shifted, pure=False)
        frames = [
            together(
                [frames[index] for index in members],
                [plan.exposures[index].shift for index in members],
                dask_key_name=f"issis-sum-{image}-{plan.token}-{epoch}",
            )
            for epoch, members in enumerate(plan.members())
        ]
    shape = plan.observation.shape
    return da.stack([da.from_delayed(frame, shape, dtype=dtype) for frame in frames])


def run(
    plan: Monitoring, folder: Path, progress: Callable[[int, int], None] | None = None
) -> list[Path]:
    """Simulate all exposures into a folder, one file each; see `Monitoring.run`."""
    dask, _ = import_dask()
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / one.file_name for one in plan.exposures]
    groups: dict[int, list[int]] = {}
    check, finished = dask.delayed(_check_finished, pure=False), []
    for index, path in enumerate(paths):
        if path.exists():
            finished.append(check(str(path), plan.exposures[index]))
        else:
            groups.setdefault(plan.exposures[index].render, []).append(index)
    dask.compute(*finished)
    total = len(paths)
    done = total - sum(map(len, groups.values()))
    tell = progress or (lambda done, total: None)
    tell(done, total)
    rates, write = _rates(plan, dask), dask.delayed(_write, pure=False)
    # All exposures of a render go together, so that none is rendered twice.
    renders = list(groups)
    for start in range(0, len(renders), BATCH):
        members = [i for render in renders[start : start + BATCH] for i in groups[render]]
        tasks = [
            write(
                rates[plan.exposures[index].render],
                plan.exposures[index],
                str(paths[index]),
                dask_key_name=f"issis-file-{plan.token}-{index}",
            )
            for index in members
        ]
        dask.compute(*tasks)
        done += len(members)
        tell(done, total)
    return paths


def import_dask() -> tuple[Any, Any]:
    """Return dask and its arrays, or raise an ImportError that names the remedy."""
    try:
        import dask
        import dask.array as da
    except ImportError:
        raise ImportError(
            'stacks of exposures need dask: pip install "napari-issis[monitor]"'
        ) from None
    return dask, da


def _rates(plan: Monitoring, dask: Any) -> dict[int, Any]:
    render = dask.delayed(rate_of, pure=False)
    rates: dict[int, Any] = {}
    for one in plan.exposures:
        if one.render not in rates:
            name = f"issis-rate-{plan.token}-{one.render}"
            rates[one.render] = render(
                one.sources, one.observation, plan.tolerance, one.images, dask_key_name=name
            )
    return rates


def rate_of(
    sources: QTable,
    observation: Observation,
    tolerance: float | None,
    images: tuple[SourceImage, ...] = (),
) -> tuple[NDArray[np.float64], float]:
    """Render what an exposure is drawn from: its rate, and the ripple removed from it.

    The images that sources are come along, as another process does not know them by name.
    """
    rate, clipped = noise_ready_rate(sources, observation, tolerance=tolerance)
    warn_of_a_sequence(rate, observation)
    return rate, clipped


def exposed(rate: tuple[NDArray[np.float64], float], one: PlannedExposure) -> Exposure:
    """Draw a planned exposure from its rendered rate."""
    return expose(rate[0], one.sources, one.observation, seed=one.seed, clipped=rate[1])


def _image(
    rate: tuple[NDArray[np.float64], float], one: PlannedExposure, image: str
) -> NDArray[Any]:
    if image == "expected":
        return expected_of_rate(rate[0], one.observation)
    return exposed(rate, one).counts


def _write(rate: tuple[NDArray[np.float64], float], one: PlannedExposure, path: str) -> str:
    try:
        exposed(rate, one).write(path)
    except FileExistsError:
        # A cluster may run a task again whose worker was lost after it had written.
        read_finished(Path(path), one)
    return path


def add_shifted(frames: Sequence[NDArray[Any]], shifts: Sequence[tuple[int, int]]) -> NDArray[Any]:
    """Add frames, each moved by whole pixels (x, y)."""
    total = np.zeros_like(frames[0])
    ny, nx = total.shape
    for frame, (dx, dy) in zip(frames, shifts, strict=True):
        if abs(dx) >= nx or abs(dy) >= ny:
            continue
        to = slice(max(dy, 0), ny + min(dy, 0)), slice(max(dx, 0), nx + min(dx, 0))
        of = slice(max(-dy, 0), ny + min(-dy, 0)), slice(max(-dx, 0), nx + min(-dx, 0))
        total[to] += frame[of]
    return total


def _check_finished(path: str, one: PlannedExposure) -> None:
    read_finished(Path(path), one)


def read_finished(path: Path, one: PlannedExposure) -> Exposure:
    """Read the file of an exposure; raise a ValueError if it is not the planned one."""
    try:
        exposure = Exposure.read(path)
    except ValueError as error:
        raise ValueError(f"{path} is no finished exposure ({error}); remove it.") from error
    same = exposure.seed == one.seed and exposure.observation == one.observation
    if not (same and same_table(exposure.sources, one.sources)):
        raise ValueError(
            f"{path} holds an exposure of another sequence; choose another folder, or remove it."
        )
    return exposure

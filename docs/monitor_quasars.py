"""Monitor 41 lensed quasars: 100 epochs of 3 dithered exposures each, and their light curves.

``python docs/monitor_quasars.py FOLDER`` writes a folder for each system, with a FITS file for
each exposure, ``light_curves.ecsv`` and ``light_curves.png``. Called again after an interruption
it goes on: what is finished is kept. ``--scheduler ADDRESS`` uses a running cluster of
`dask.distributed` whose workers see the folder; otherwise one is started on this machine.
``--help`` lists what else can be chosen.

What is measured of the systems comes from the library. All else is illustrative: the light
curves are damped random walks of 0.2 mag and 200 days, the delays those of isothermal lenses,
and where the library has no flux or flux ratios some are made up.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from astropy.table import QTable
from dask.distributed import Client, LocalCluster, as_completed
from tqdm import tqdm

import napari_issis as ni
from napari_issis.lensed_quasars import LensedQuasar, quasar_library

FLUX = 1e-15
RATIOS = (1.0, 0.6, 0.4, 0.3)
# A redshift of a lens, where none is known.
Z_LENS = 0.5
CADENCE = 5.0
RESULT = "light_curves.ecsv"
DITHERS = ((0, 0), (5.5, 2.5), (-3.5, 6.5))


def system_of(number: int) -> LensedQuasar:
    """Return a system: the library's in turn."""
    systems = list(quasar_library().values())
    return systems[number % len(systems)]


def plan_of(number: int, options: argparse.Namespace) -> ni.Monitoring:
    """Plan the exposures of one system; the same at each call."""
    system = system_of(number)
    names = list(system.images)
    frame = ni.Observation(shape=(options.frame,) * 2, exposure=options.seconds, roll=9.0 * number)
    sources = ni.lensed_quasar(
        system.name,
        frame,
        flux=FLUX if system.flux is None else None,
        ratios=RATIOS[: len(names)] if system.ratios is None else None,
    )
    known = np.isfinite(system.z_lens)
    delays = ni.isothermal_delays(system.name, z_lens=None if known else Z_LENS)
    curve = ni.damped_random_walk(0.2, 200.0, seed=number)
    return ni.monitor(
        sources,
        frame,
        [CADENCE * epoch for epoch in range(options.epochs)],
        light_curves=dict.fromkeys(range(len(names)), curve),
        delays={row: delays[name] for row, name in enumerate(names)},
        exposures=options.exposures,
        dithers=[DITHERS[k % len(DITHERS)] for k in range(options.exposures)],
        seed=number,
    )


def title_of(number: int, options: argparse.Namespace) -> str:
    """Return what stands above the plot of a system."""
    name = system_of(number).name
    return f"{name}: {options.exposures} x {options.seconds:g} s every {CADENCE:g} days"


def folder_of(number: int, options: argparse.Namespace) -> Path:
    """Return the folder of a system."""
    return Path(options.folder) / f"{number:02d}-{system_of(number).name}"


def expose(options: argparse.Namespace) -> int:
    """Simulate what is missing; return how many exposures that were."""
    made = 0
    total = options.systems * options.epochs * options.exposures
    with tqdm(total=total, unit="exposure", desc="exposures", smoothing=0.05) as bar:
        for number in range(options.systems):
            before, found = bar.n, []

            def tell(done: int, _: int, before: int = before, found: list[int] = found) -> None:
                found.append(done)
                bar.update(before + done - bar.n)

            plan_of(number, options).run(folder_of(number, options), progress=tell)
            made += found[-1] - found[0]
    return made


def recover(number: int, options: argparse.Namespace) -> QTable:
    """Fit the light curves of one system and write them, with a plot."""
    folder, system = folder_of(number, options), system_of(number)
    table = ni.fit_light_curves(plan_of(number, options), folder)
    names = [*system.images, "lens galaxy"]
    ni.plot_light_curves(
        table,
        folder / "light_curves.png",
        names=names,
        title=title_of(number, options),
        time_label="time, days",
    )
    # Written last and whole: whoever sees it finds the system finished.
    part = folder / "light_curves.part"
    table.write(part, format="ascii.ecsv", overwrite=True)
    part.rename(folder / RESULT)
    return table


def fit(client: Client, options: argparse.Namespace) -> int:
    """Recover the light curves that are missing, a task a system; return how many those were."""
    missing = [n for n in range(options.systems) if not (folder_of(n, options) / RESULT).exists()]
    tasks = [client.submit(recover, number, options, pure=False) for number in missing]
    for task in tqdm(as_completed(tasks), total=len(tasks), unit="system", desc="light curves"):
        task.result()
    return len(missing)


def summary(options: argparse.Namespace) -> str:
    """Say how the recovered fluxes of all systems scatter."""
    pulls, snr = [], []
    for number in range(options.systems):
        table = QTable.read(folder_of(number, options) / RESULT, format="ascii.ecsv")
        pulls.append(((table["flux"] - table["truth"]) / table["error"]).value)
        snr.append((table["truth"] / table["error"]).value)
    pull, ratio = np.concatenate(pulls), np.concatenate(snr)
    seen = np.isfinite(pull)
    return (
        f"{seen.sum()} of {seen.size} fluxes recovered, median S/N {np.median(ratio[seen]):.0f}; "
        f"(flux - truth) / error has mean {pull[seen].mean():+.4f} and variance "
        f"{pull[seen].var():.4f}"
    )


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Read the command's arguments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", help="where the files go")
    parser.add_argument("--systems", type=int, default=41, help="default: 41")
    parser.add_argument("--epochs", type=int, default=100, help="default: 100")
    parser.add_argument("--exposures", type=int, default=3, help="at each epoch; default: 3")
    parser.add_argument("--seconds", type=float, default=600.0, help="of each; default: 600")
    parser.add_argument("--frame", type=int, default=128, help="pixels a side; default: 128")
    parser.add_argument("--workers", type=int, default=2, help="processes here; default: 2")
    parser.add_argument("--scheduler", help="address of a running dask.distributed cluster")
    return parser.parse_args(words)


def main(words: list[str] | None = None) -> None:
    """Run the command."""
    options = arguments(words)
    warnings.simplefilter("ignore", ni.CountRateWarning)
    start = time.perf_counter()
    with connected(options) as client:
        client.run(warnings.simplefilter, "ignore", ni.CountRateWarning)
        made = expose(options)
        exposed = time.perf_counter()
        fitted = fit(client, options)
    files = list(Path(options.folder).rglob("*.fits"))
    size = sum(file.stat().st_size for file in files)
    print(f"{made} exposures in {exposed - start:.0f} s; {len(files)} files, {size / 1e9:.2f} GB")
    print(f"{fitted} systems fitted in {time.perf_counter() - exposed:.0f} s")
    print(summary(options))


@contextmanager
def connected(options: argparse.Namespace) -> Iterator[Client]:
    """Connect to the cluster, or to one of this machine's own."""
    if options.scheduler:
        with Client(options.scheduler) as client:
            yield client
        return
    with (
        LocalCluster(
            n_workers=options.workers, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


if __name__ == "__main__":
    main()

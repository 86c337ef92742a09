"""Fill the tables of proposal.md from the program: python docs/proposal_tables.py."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import astropy.units as u
from astropy.coordinates import SkyCoord
from astropy.table import QTable
from instrument_tables import Rows, filled

import napari_issis as ni
from napari_issis.limits import count_rate_warnings

PAGE = Path(__file__).with_name("proposal.md")
SEED = 1
GOALS = {
    "flux of D to 5 %": {"rows": 3, "snr": 20},
    "flux of D to 1 %": {"rows": 3, "snr": 100},
    "flux ratio A/B to 1 %": {"rows": [0, 1], "flux_ratio": 0.01},
    "position of D to 1 mas": {"rows": 3, "position": 1 * u.mas},
}
# name, right ascension, declination, exposure time, filters in the NUV
CASES = {
    "Q2237+0305": (340.1258, 3.35855, 600.0, ("NF1", "open")),
    "HE0435-1223": (69.5619, -12.28745, 1000.0, ("open", "open")),
}


def case(name: str) -> tuple[QTable, tuple[ni.Observation, ni.Observation]]:
    """Return the scene of a case and its set-ups in both channels."""
    ra, dec, exposure, filters = CASES[name]
    nuv = ni.Observation(
        "NUV", filters, exposure, (128, 128), pointing=SkyCoord(ra, dec, unit="deg")
    )
    sources = ni.lensed_quasar(name, nuv)
    sources["name"] = ["A", "B", "C", "D", "lens"]
    return sources, (nuv, nuv.replace(channel="FUV", filters=("open", "open")))


@lru_cache
def exposures(name: str) -> tuple[ni.Exposure, ...]:
    """Simulate both exposures of a case."""
    sources, set_ups = case(name)
    return tuple(ni.simulate(sources, one, seed=SEED) for one in set_ups)


def limits() -> Rows:
    """Say what the detector would make of Q2237 without and with the neutral filter."""
    sources, (nuv, fuv) = case("Q2237+0305")
    rows = [["set-up", "brightest pixel (cps)", "limits broken"]]
    for one in (nuv.replace(filters=("open", "open")), nuv, fuv):
        rate = ni.count_rate(sources, one)
        broken = len(count_rate_warnings(rate, one.background_rate))
        peak = f"{rate.max() + one.background_rate:.3g}"
        rows.append(
            [
                f"{one.channel}, {'-'.join(one.filter_names)}",
                peak,
                str(broken) if broken else "none",
            ]
        )
    return rows


def goals(name: str) -> Rows:
    """Exposure times of a case."""
    sources, set_ups = case(name)
    rows = [["goal", *(_label(one) for one in set_ups)]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ni.CountRateWarning)
        for words, goal in GOALS.items():
            times = [ni.exposure_for(sources, one, **goal).value for one in set_ups]
            rows.append([words, *(f"{_plain(time)} s" for time in times)])
    return rows


def forecasts(name: str) -> Rows:
    """Tabulate what can be measured in a case."""
    sources, set_ups = case(name)
    rows = [["source"]]
    for one in set_ups:
        rows[0] += [f"{one.channel}: counts", "S/N", "place (mas)"]
    tables = [ni.forecast(sources, one) for one in set_ups]
    counts = [ni.expected_counts(sources, one) for one in set_ups]
    for row, who in enumerate(sources["name"]):
        cells = [str(who)]
        for table, count in zip(tables, counts, strict=True):
            place = max(table["x_error"][row].value, table["y_error"][row].value) * 36
            cells += [_plain(count[row]), _plain(table["snr"][row]), _plain(place)]
        rows.append(cells)
    return rows


def apertures(name: str) -> Rows:
    """Bias of aperture photometry of the images, by radius and sky."""
    rows = [["image"]]
    measured = []
    for exposure in exposures(name):
        for radius in (3.0, 5.0):
            for sky in ("known", "mean"):
                level = "sky known" if sky == "known" else "annulus"
                rows[0].append(f"{exposure.observation.channel}, {radius:g} px, {level}")
                options = {"radius": radius, "sky": sky, "sigma_clip": None, "rows": range(4)}
                measured.append(ni.aperture_photometry(exposure, **options))
    for row, who in enumerate("ABCD"):
        biases = [
            f"{table['bias_percent'][row]:+.2g} % ({table['bias_sigma'][row]:+.2g} σ)"
            for table in measured
        ]
        rows.append([who, *biases])
    return rows


def sheet(path: str) -> None:
    """Write the sheet of Q2237."""
    sources, set_ups = case("Q2237+0305")
    ni.proposal_sheet(
        sources,
        set_ups,
        path,
        seed=SEED,
        goals=list(GOALS.values()),
        title="Q2237+0305, the Einstein cross, with WSO-UV/ISSIS",
        notes="Fluxes are illustrative: F814W magnitudes carried on to 2500 A as a power law. In "
        "the FUV, rest frame 430 to 650 A, the quasar is likely fainter.",
        overwrite=True,
    )


def _plain(value: float) -> str:
    """Write three digits, without a power of ten up to a million."""
    return f"{float(f'{value:.3g}'):g}"


def _label(observation: ni.Observation) -> str:
    return f"{observation.channel}, {'-'.join(observation.filter_names)}"


TABLES: dict[str, Callable[[], Rows]] = {
    "limits": limits,
    "goals": lambda: goals("Q2237+0305"),
    "forecasts": lambda: forecasts("Q2237+0305"),
    "apertures": lambda: apertures("Q2237+0305"),
    "goals0435": lambda: goals("HE0435-1223"),
    "forecasts0435": lambda: forecasts("HE0435-1223"),
    "apertures0435": lambda: apertures("HE0435-1223"),
}


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), TABLES), encoding="utf-8")

"""The HTML of a proposal sheet: one file, no scripts, everything a user gave escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from string import Template
from typing import TYPE_CHECKING, Any

import astropy.units as u
import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .encircled_energy import encircled_energy
from .fits_header import psf_description
from .fits_light_path import sky_description
from .observation import Observation
from .photometry import ab_magnitude
from .psf import RadialPSF, fwhm
from .reproduction import (
    reproduction_code,
    spectrum_files,
    unwritten,
    unwritten_sources,
    written_name,
)
from .sheet_pictures import image_svg, model_svg
from .source_counts import expected_counts
from .source_rates import flux_pivots, sources_and_rates
from .sources import spectrum_texts

if TYPE_CHECKING:
    from .sheet import ChannelResult

# Sources beyond which their table and the commands are folded, and not printed.
UNFOLDED = 30
FORECAST_NOTE = (
    "Forecasts are Cramér-Rao bounds of the Poisson likelihood: the errors of the best fit "
    "possible, of all sources of the scene together, with the PSF, the sky and the Sersic "
    "indices known. Faint blended sources scatter more."
)
FLUX_NOTE = (
    "Fluxes are mean flux densities over the channel's band, spectra flat in wavelength, "
    "unless a spectrum is given. The effective area is constant over the band."
)
AB_NOTE = "AB magnitudes are those of the first image's channel."

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="napari-issis $version">
<title>$title</title>
<style>
@page { size: A4; margin: 11mm 12mm }
* { box-sizing: border-box }
body { font: 8.5pt/1.3 "Liberation Sans", Arial, Helvetica, sans-serif; color: #111;
  max-width: 186mm; margin: 0 auto; background: #fff }
h1 { font-size: 14pt; margin: 0 0 1mm }
h2 { font-size: 10pt; margin: 3mm 0 1mm; border-bottom: 0.3mm solid #0b3d91; color: #0b3d91 }
p { margin: 0 0 1mm }
.pictures { display: flex; gap: 3mm; margin-top: 2mm }
figure { flex: 1; margin: 0; min-width: 0 }
figure svg { width: 100%; display: block }
figcaption { font-size: 8pt; text-align: center }
table { border-collapse: collapse; width: 100%; break-inside: auto }
tr { break-inside: avoid }
th, td { padding: 0.3mm 1.2mm; text-align: right; border-bottom: 0.1mm solid #ccc;
  vertical-align: top; overflow-wrap: anywhere }
th { font-weight: bold; border-bottom: 0.2mm solid #555 }
th.group { text-align: center }
td:first-child, th:first-child, td.text, th.text { text-align: left }
.numbers td, .numbers th { white-space: nowrap; padding: 0.3mm 0.8mm }
ul { margin: 0; padding-left: 4mm }
ul.warnings { color: #a40000 }
pre { font: 6.6pt/1.25 "Liberation Mono", monospace; white-space: pre-wrap;
  overflow-wrap: anywhere; background: #f4f4f4; padding: 1.5mm; margin: 0 }
.note { color: #444; font-size: 7.5pt }
</style>
</head>
<body>
<h1>$title</h1>
<p class="note">$byline</p>
$notes
<div class="pictures">$pictures</div>
<p class="note">$caption</p>
<h2>Settings</h2>
$settings
<h2>Forecast: what can be measured</h2>
$forecast
<p class="note">$left_out</p>
$goals
<h2>Warnings</h2>
$warnings
<h2>Assumptions</h2>
$assumptions
<h2>Sources</h2>
$sources
<h2>Commands that make these exposures again</h2>
$commands
</body>
</html>
""")


def page(
    results: Sequence[ChannelResult],
    *,
    shown: NDArray[np.intp],
    goals: Sequence[Mapping[str, Any]],
    added: str,
    title: str,
    notes: str,
    date: str,
) -> str:
    """Return the page; the arguments are those of `napari_issis.proposal_sheet`, checked."""
    from . import __version__

    first = results[0].exposure
    table, observation = first.sources, first.observation
    arrays, _ = sources_and_rates(table, observation)
    names = _names(table)
    labels = _labels([one.exposure.observation for one in results])
    figures = [_figure(model_svg(arrays, names, observation), "Source model")]
    figures += [
        _figure(image_svg(one.exposure), f"{label}: counts in {seconds(_time(one))}")
        for one, label in zip(results, labels, strict=True)
    ]
    rest = len(table) - len(shown)
    by = [f"napari-issis {__version__}", f"seed {first.seed}", "simulated, no real observation"]
    code = reproduction_code(
        table, [one.exposure.observation for one in results], seed=first.seed, goals=goals
    )
    return PAGE.substitute(
        version=escape(__version__),
        title=escape(title.strip() or "WSO-UV/ISSIS simulation"),
        byline=escape(" · ".join([*by, date] if date else by)),
        notes="".join(f"<p>{escape(line)}</p>" for line in notes.splitlines() if line.strip()),
        pictures="".join(figures),
        caption="Stars are point sources, ellipses hold half of the light. The images show "
        "counts per pixel, on a logarithmic scale.",
        settings=_settings(results, labels),
        forecast=_forecast(results, labels, shown, names),
        left_out=f"{rest} of {len(table)} sources are left out of this table, but not of the "
        "scene and the fit."
        if rest
        else "All sources of the scene.",
        goals=_goals(results, labels, goals, names),
        warnings=_warnings(results, labels),
        assumptions=_list(_assumptions(results, added)),
        sources=_folded(
            _sources(table, observation, names), len(table), f"All {len(table)} sources are"
        ),
        commands=_folded(f"<pre>{escape(code)}</pre>", len(table), "The commands are"),
    )


def seconds(value: float) -> str:
    """Write a time as text, in s, and beyond 1000 s in hours too."""
    return f"{value:.4g} s" if value < 1000 else f"{value:.0f} s ({value / 3600:.3g} h)"


def _time(result: ChannelResult) -> float:
    return result.exposure.observation.exposure


def _names(table: Table) -> list[str]:
    if "name" not in table.colnames:
        return [str(row) for row in range(len(table))]
    column = table["name"]
    mask = np.asarray(getattr(column, "mask", np.zeros(len(table), dtype=bool)))
    return [
        str(row) if gone else str(name)
        for row, (name, gone) in enumerate(zip(column, mask, strict=True))
    ]


def _labels(observations: Sequence[Observation]) -> list[str]:
    channels = [one.channel for one in observations]
    return [
        name if channels.count(name) == 1 else f"{name} ({i + 1})"
        for i, name in enumerate(channels)
    ]


def _settings(results: Sequence[ChannelResult], labels: Sequence[str]) -> str:
    rows: dict[str, list[str]] = {}
    for result in results:
        exposure, one = result.exposure, result.exposure.observation
        ny, nx = one.shape
        low, high = one.channel_data.band
        psf = one.effective_psf
        for name, text in (
            ("Band", f"{low:g} to {high:g} Å"),
            ("Filters", " and ".join(one.filter_names)),
            ("Exposure time", seconds(one.exposure)),
            (
                "Frame",
                f"{nx} × {ny} pixels, {nx * one.pixel_scale:.4g} × "
                f"{ny * one.pixel_scale:.4g} arcsec",
            ),
            ("Pixel", f"{one.pixel_scale:g} arcsec"),
            ("Pointing and roll", _pointing(one)),
            ("PSF", psf_description(psf)),
            ("PSF, FWHM", f"{fwhm(psf):.3f} arcsec" if isinstance(psf, RadialPSF) else "-"),
            (
                "PSF, light within 0.2 arcsec diameter",
                f"{100 * encircled_energy(psf, 0.2):.3g} %" if isinstance(psf, RadialPSF) else "-",
            ),
            ("Count rate of 1e-16 erg s⁻¹ cm⁻² Å⁻¹", f"{1e-16 * one.cps_per_flux:.4g} cps"),
            ("Sky", f"{one.sky_rate:.3g} cps per pixel: {sky_description(one)}"),
            ("Dark rate", f"{one.dark_rate:.3g} cps per pixel"),
            ("Detector", _detector(one)),
            ("Sources in the frame", f"{result.source_rate:.4g} cps"),
            ("Expected background", f"{exposure.background:.3g} counts per pixel"),
            ("Brightest pixel", f"{exposure.counts.max()} counts"),
            ("Sum of all counts", str(exposure.counts.sum())),
        ):
            rows.setdefault(name, []).append(text)
    # what is the same and goes without saying is left out
    for name, usual in (("Dark rate", "0 cps per pixel"), ("Detector", "linear")):
        if set(rows[name]) == {usual}:
            del rows[name]
    body = [[name, *texts] for name, texts in rows.items()]
    return _table([["", *labels]], body, text=True)


def _pointing(observation: Observation) -> str:
    roll = f"roll {observation.roll:g}°"
    if observation.pointing is None:
        return f"none given, {roll}"
    position = observation.pointing.to_string("hmsdms", sep=":", precision=1)
    return f"{position} (ICRS), {roll}"


def _detector(observation: Observation) -> str:
    one = observation.detector
    words = [f"dead time {one.dead_time:g} s"] if one.dead_time else []
    words += ["16-bit rollover"] if one.rollover else []
    return ", ".join(words) or "linear"


def _forecast(
    results: Sequence[ChannelResult],
    labels: Sequence[str],
    shown: NDArray[np.intp],
    names: Sequence[str],
) -> str:
    columns = ("counts", "S/N alone", "S/N", "flux (%)", "place (mas)", "neighbour")
    head = '<tr><th rowspan="2">source</th>'
    head += "".join(
        f'<th class="group" colspan="{len(columns)}">{escape(name)}</th>' for name in labels
    )
    head += "</tr><tr>" + "".join(f"<th>{c}</th>" for c in columns) * len(results) + "</tr>"
    body = []
    for row in shown:
        cells = [names[row]]
        for result in results:
            one = result.forecast[int(row)]
            observation = result.exposure.observation
            counts = expected_counts(result.exposure.sources, observation)
            place = max(one["x_error"].value, one["y_error"].value) * observation.pixel_scale
            neighbour = int(one["neighbour"])
            cells += [
                f"{counts[row]:.0f}" if counts[row] < 1e6 else f"{counts[row]:.4g}",
                _number(one["snr_alone"]),
                _number(one["snr"]),
                _number(100 / one["snr"] if one["snr"] > 0 else np.inf, digits=3),
                _number(1e3 * place, digits=3),
                f"{names[neighbour]} ({one['flux_correlation']:+.2f})" if neighbour >= 0 else "-",
            ]
        body.append(cells)
    legend = (
        '<p class="note">S/N: flux over its 1-sigma error, alone on the sky and in the crowd; '
        "flux and place (the larger of x and y): 1-sigma errors in the crowd; in brackets the "
        "correlation with the flux of the worst neighbour.</p>"
    )
    return (
        f'<table class="numbers"><thead>{head}</thead><tbody>{_rows(body)}</tbody></table>{legend}'
    )


def _goals(
    results: Sequence[ChannelResult],
    labels: Sequence[str],
    goals: Sequence[Mapping[str, Any]],
    names: Sequence[str],
) -> str:
    if not goals:
        return ""
    body = []
    for i, goal in enumerate(goals):
        times = [one.times[i] for one in results]
        texts = [t if isinstance(t, str) else seconds(t) for t in times]
        body.append([_goal(goal, names), *texts])
    return f"<h2>Exposure times for goals</h2>{_table([['goal', *labels]], body, text=True)}"


def _goal(goal: Mapping[str, Any], names: Sequence[str]) -> str:
    rows = np.atleast_1d(np.asarray(goal["rows"], dtype=int)).tolist()
    who = [names[row] if 0 <= row < len(names) else str(row) for row in rows]
    ((name, value),) = ((k, v) for k, v in goal.items() if k != "rows")
    if name == "flux_ratio":
        return f"flux ratio {'/'.join(who)} to {100 * float(value):.3g} %"
    if name == "snr":
        return f"S/N {float(value):g} of {', '.join(who)}: flux to {100 / float(value):.3g} %"
    unit = "" if isinstance(value, u.Quantity) else " pixels"
    return f"position of {', '.join(who)} to {value}{unit}"


def _warnings(results: Sequence[ChannelResult], labels: Sequence[str]) -> str:
    found = [
        f"{label}: {message}"
        for result, label in zip(results, labels, strict=True)
        for message in result.warnings
    ]
    return _list(found, "warnings") if found else "<p>None.</p>"


def _assumptions(results: Sequence[ChannelResult], added: str) -> list[str]:
    observations = [one.exposure.observation for one in results]
    camera = observations[0].instrument
    texts = [FLUX_NOTE, FORECAST_NOTE, AB_NOTE]
    if camera.limits_note:
        texts.append(f"Count-rate limits are those of {camera.limits_note}.")
    if camera.psf_note and any(one.psf_assumed for one in observations):
        texts.insert(0, camera.psf_note)
    names = {name for one in observations for name in one.filter_names}
    curves = sorted(name for name in names if camera.is_illustrative(name))
    texts += [f"{name}: {camera.filter_note}" for name in curves]
    if added:
        texts.append(f"{added} was added with the same exposure time and its own PSF and sky.")
    table = results[0].exposure.sources
    missing = unwritten_sources(table)
    if missing is not None:
        texts.append(
            f"{missing} cannot be written on this page: the commands read all sources from "
            f"{observations[0].channel}.fits, the saved exposure, which holds them."
        )
    elif spectrum_files(table):
        texts.append(
            "The commands write the samples of spectra that are tables to files: "
            f"{', '.join(f'{written_name(path)} ({path})' for path in spectrum_files(table))}."
        )
    for one in observations:
        missing = unwritten(one)
        if missing is not None:
            texts.append(
                f"{missing} of {one.channel} cannot be written on this page: the commands read "
                f"it from {one.channel}.fits, the saved exposure."
            )
    return texts


def _sources(table: Table, observation: Observation, names: Sequence[str]) -> str:
    arrays, _ = sources_and_rates(table, observation)
    magnitudes = np.broadcast_to(
        ab_magnitude(arrays.flux, flux_pivots(table, observation)), arrays.flux.shape
    )
    spectra = spectrum_texts(table)
    head = ["source", "kind", "x", "y", "flux (erg s⁻¹ cm⁻² Å⁻¹)", "AB mag", "R½ (pixels)"]
    head += ["ellipticity", "PA (°)", "n"] + (["spectrum"] if spectra is not None else [])
    body = []
    for i, kind in enumerate(arrays.kind):
        cells = [names[i], str(kind), f"{arrays.x[i]:.3f}", f"{arrays.y[i]:.3f}"]
        cells += [f"{arrays.flux[i]:.4g}", _number(magnitudes[i], digits=5)]
        if kind == "point":
            cells += ["-", "-", "-"]
        else:
            cells += [f"{v[i]:.4g}" for v in (arrays.r_half, arrays.ellipticity, arrays.pa)]
        cells.append(f"{arrays.index[i]:g}" if kind == "sersic" else "-")
        if spectra is not None:
            cells.append(str(spectra[i]) or "flat")
        body.append(cells)
    return _table([head], body)


def _figure(svg: str, caption: str) -> str:
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def _number(value: float, unit: str = "", digits: int = 4) -> str:
    value = float(value)
    if np.isnan(value):
        return "-"
    return f"{value:.{digits}g}{unit}" if np.isfinite(value) else "∞"


def _table(head: Sequence[Sequence[str]], body: Sequence[Sequence[str]], text: bool = False) -> str:
    mark = ' class="text"' if text else ""
    top = "".join(
        f"<tr>{''.join(f'<th{mark}>{escape(cell)}</th>' for cell in row)}</tr>" for row in head
    )
    return f"<table><thead>{top}</thead><tbody>{_rows(body, mark)}</tbody></table>"


def _rows(body: Iterable[Sequence[str]], mark: str = "") -> str:
    return "\n".join(
        f"<tr>{''.join(f'<td{mark}>{escape(cell)}</td>' for cell in row)}</tr>" for row in body
    )


def _list(items: Iterable[str], name: str = "") -> str:
    mark = f' class="{name}"' if name else ""
    return f"<ul{mark}>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>"


def _folded(html: str, sources: int, what: str) -> str:
    if sources <= UNFOLDED:
        return html
    return (
        f"<details><summary>{what} in this file: open it in a browser to see them.</summary>"
        f"{html}</details>"
    )

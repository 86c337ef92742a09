"""The same call gives the same bits, whatever was rendered before and in whatever process."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import psf_of, table_of
from print_digests import digest
from random_scene import random_scene

import napari_issis as ni

HERE = Path(__file__).parent
SEEDS = [20_003, 20_007, 20_011, 20_012, 20_015, 20_019]


def image_of(scene, tolerance):
    observation = ni.Observation(shape=scene.shape, psf=psf_of(*scene.psf))
    return ni.count_rate(table_of(scene.sources), observation, tolerance=tolerance)


@given(st.integers(30_000, 10**9), st.integers(30_000, 10**9), st.floats(-6, -2))
def test_other_calls_in_between(seed, other, log_tolerance):
    """Catches a cache whose key forgets tolerance, PSF or frame, and scratch memory reused."""
    scene = random_scene(seed)
    before = image_of(scene, 1e-5)
    kept = before.copy()
    image_of(scene, 10**log_tolerance)
    image_of(random_scene(other), 1e-5)
    neighbour = random_scene(seed)
    neighbour.psf = random_scene(other).psf
    image_of(neighbour, 1e-5)
    neighbour.psf, neighbour.shape = scene.psf, scene.shape[::-1]
    image_of(neighbour, 10**log_tolerance)
    np.testing.assert_array_equal(before, kept)
    np.testing.assert_array_equal(image_of(scene, 1e-5), kept)


def run(seeds, **environment):
    """Digests from a fresh process."""
    inherited = [str(HERE), str(HERE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    result = subprocess.run(
        [sys.executable, str(HERE / "print_digests.py"), *map(str, seeds)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(inherited), **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    return dict(line.split() for line in result.stdout.splitlines())


@pytest.fixture(scope="module")
def fresh():
    return run(SEEDS[::-1])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_fresh_process_gives_the_same_bits(seed, fresh):
    """Catches anything learnt from earlier scenes: timings, measured plans, warm tables."""
    assert fresh[str(seed)] == digest(seed)

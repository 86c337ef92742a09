"""The number of threads changes an image by no more than rounding."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from plain_scene import psf_of, table_of
from random_scene import random_scene

import napari_issis as ni

HERE = Path(__file__).parent
SEEDS = (20_003, 20_011, 20_015)
PROGRAM = """
import os, sys
os.cpu_count = lambda: 1
import numpy as np
from test_threads import images
np.savez(sys.argv[1], *images())
"""


def images():
    """Images of some scenes and of a crowd large enough for threads to share."""
    result = []
    for seed in SEEDS:
        scene = random_scene(seed)
        observation = ni.Observation(shape=scene.shape, psf=psf_of(*scene.psf))
        result.append(ni.count_rate(table_of(scene.sources), observation, tolerance=1e-6))
    crowd = ni.random_sources("point", 3000, shape=(256, 200), seed=3)
    result.append(ni.count_rate(crowd, ni.Observation(shape=(256, 200)), tolerance=1e-6))
    galaxies = ni.random_sources("devaucouleurs", 30, shape=(256, 200), seed=4)
    result.append(ni.count_rate(galaxies, ni.Observation(shape=(256, 200)), tolerance=1e-6))
    return result


def test_one_thread(tmp_path):
    """Catches threads that add into the same memory at once, or rows that none of them takes."""
    path = tmp_path / "one.npz"
    inherited = [str(HERE), str(HERE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    one = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path)],
        env={**os.environ, **one, "PYTHONPATH": os.pathsep.join(inherited)},
        timeout=300,
        check=True,
    )
    here = images()
    with np.load(path) as there:
        assert len(there.files) == len(here)
        for name, image in zip(there.files, here, strict=True):
            # an order of summation changes rounding, not the sum to the tolerance
            assert np.abs(there[name] - image).max() <= 1e-10 * image.max()

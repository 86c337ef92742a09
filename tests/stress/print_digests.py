"""Digests of some random scenes' images, one a line; a fresh process prints the same ones.

Arguments: the scenes' seeds.
"""

import hashlib
import sys

from plain_scene import psf_of, table_of
from random_scene import random_scene

import napari_issis as ni


def digest(seed, before=()):
    """Bits of the image and of the counts of a scene, after its images at other tolerances."""
    scene = random_scene(seed)
    observation = ni.Observation(shape=scene.shape, psf=psf_of(*scene.psf), background=1e-3)
    table = table_of(scene.sources)
    for tolerance in before:
        ni.count_rate(table, observation, tolerance=tolerance)
    image = ni.count_rate(table, observation, tolerance=scene.tolerance)
    exposure = ni.simulate(table, observation, tolerance=1e-6)
    return hashlib.sha256(image.tobytes() + exposure.expected.tobytes()).hexdigest()


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        print(argument, digest(int(argument), before=(1e-2, 1e-5)))

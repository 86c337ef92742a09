"""PLACEHOLDER for counts."""
import numpy as np

def poisson_counts(expected, seed):
    return np.random.default_rng(seed).poisson(expected)

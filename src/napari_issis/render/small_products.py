"""Products of many small matrices, in the calling thread.

For a product that takes microseconds BLAS wakes threads that then wait for each other; on a busy
machine that costs 20 times the work itself. OpenBLAS leaves them asleep for products of at most
`ALONE` multiplications.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# OpenBLAS, interface/gemm.c: SMP_THRESHOLD_MIN * GEMM_MULTITHREAD_THRESHOLD
ALONE = 65536 * 4
# fewer columns than this in a piece are more work than threads are
FEWEST = 12


def stack_product(a: Array, b: Array, out: Array | None = None) -> Array:
    """Return a @ b for stacks of matrices, (n, l, m) and (n, m, k) or (m, k)."""
    if out is None:
        out = np.empty((*a.shape[:-1], b.shape[-1]))
    step = max(ALONE // (b.shape[-2] * b.shape[-1]), 1)
    for first in range(0, a.shape[-2], step):
        np.matmul(a[..., first : first + step, :], b, out=out[..., first : first + step, :])
    return out


def square(a: Array) -> Array:
    """Return a @ a.T of a wide matrix."""
    step = ALONE // len(a) ** 2
    if step < FEWEST:
        whole: Array = a @ a.T
        return whole
    result = np.zeros((len(a), len(a)))
    for first in range(0, a.shape[1], step):
        part = a[:, first : first + step]
        result += part @ part.T
    return result

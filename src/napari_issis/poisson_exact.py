"""The Poisson distribution to some 30 digits, for the rare pixels that 16 digits cannot decide."""

from __future__ import annotations

from decimal import Decimal, localcontext
from functools import lru_cache

_DIGITS = 60
_SUMMED_BELOW = 2000
_STEP = Decimal(1) / 20
_HALF_LOG_TWO_PI = Decimal("0.918938533204672741780329736405617639861397473637783412817151540483")
# (2j (2j - 1)) / B_2j: Stirling's series of ln k!, to 2e-33 for k >= 2000.
_STIRLING = (Decimal(12), Decimal(-360), Decimal(1260), Decimal(-1680))


def poisson_cdf(k: int, lam: float) -> Decimal:
    """Probability of at most `k` counts where `lam` are expected.

    Parameters
    ----------
    k : int
        Number of counts; the result is 0 below zero.
    lam : float
        Expected number, above zero, taken as the exact binary number that it is.

    Returns
    -------
    decimal.Decimal
        Correct to 1e-30 of itself or, above 1/2, of its complement, for lam up to 1e15 and
        k within nine standard deviations of it.

    Notes
    -----
    Small k: the sum of its terms. Otherwise the incomplete gamma function,
    CDF(k; lam) = Integral_lam^inf s^k e^-s ds / k!, with k! from Stirling's series and the
    integral on the side of lam where its integrand falls (below lam it gives 1 - CDF), by the
    trapezoidal rule after s = lam +- sqrt(k) exp(r - exp(-r)), which converges exponentially
    (Takahasi & Mori 1974, Publ. RIMS 9, 721).
    """
    if k < 0:
        return Decimal(0)
    with localcontext() as context:
        context.prec = _DIGITS
        mean = Decimal(lam)
        if k < _SUMMED_BELOW:
            term = total = Decimal(1)
            for j in range(1, k + 1):
                term = term * mean / j
                total += term
            return total * (-mean).exp()
        n = Decimal(k)
        stirling = sum(1 / (c * n ** (2 * j + 1)) for j, c in enumerate(_STIRLING))
        log_pmf = n - mean + n * (mean / n).ln() - n.ln() / 2 - _HALF_LOG_TWO_PI - stirling
        step = n.sqrt() if n < mean else -n.sqrt()
        integral = Decimal(0)
        for t, weight in _nodes():
            v = step * t / mean
            if v <= -1:
                break
            integrand = (n * (1 + v).ln() - mean * v).exp()
            integral += weight * integrand
            if integrand < Decimal("1e-40"):
                break
        tail = log_pmf.exp() * n.sqrt() * integral
        return tail if n < mean else 1 - tail


def poisson_quantile_exact(u: float, lam: float, guess: int) -> int:
    """Smallest k with CDF(k; lam) >= u, searched from a guess.

    Parameters
    ----------
    u : float
        Probability, in (0, 1).
    lam : float
        Expected number, above zero.
    guess : int
        Where to begin; the nearer the faster.
    """
    probability = Decimal(u)
    k = max(guess, 0)
    while poisson_cdf(k, lam) < probability:
        k += 1
    while poisson_cdf(k - 1, lam) >= probability:
        k -= 1
    return k


@lru_cache(maxsize=1)
def _nodes() -> list[tuple[Decimal, Decimal]]:
    nodes = []
    with localcontext() as context:
        context.prec = _DIGITS
        for i in range(-96, 60):
            r = i * _STEP
            decay = (-r).exp()
            t = (r - decay).exp()
            nodes.append((t, _STEP * t * (1 + decay)))
    return nodes

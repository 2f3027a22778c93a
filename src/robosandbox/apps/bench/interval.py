"""Jeffreys interval of a success rate, from the beta distribution."""

from __future__ import annotations

import math


def beta_interval(successes: int, trials: int, level: float = 0.95) -> tuple[float, float]:
    """Return the Jeffreys interval of a rate: the middle `level` of Beta(successes + 1/2, failures + 1/2).

    With no success the low end is 0, with no failure the high end is 1 (Brown, Cai and DasGupta, Interval Estimation for a
    Binomial Proportion, Statistical Science 16, 2001).

    Raises:
        ValueError: The counts are not 0 <= successes <= trials, trials >= 1.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"{successes} of {trials} is no rate")
    a, b, tail = successes + 0.5, trials - successes + 0.5, (1.0 - level) / 2.0
    low = 0.0 if successes == 0 else _beta_quantile(tail, a, b)
    high = 1.0 if successes == trials else _beta_quantile(1.0 - tail, a, b)
    return low, high


def _beta_quantile(p: float, a: float, b: float) -> float:
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2.0
        if beta_cdf(middle, a, b) < p:
            low = middle
        else:
            high = middle
    return (low + high) / 2.0


def beta_cdf(x: float, a: float, b: float) -> float:
    """Return the regularized incomplete beta function I_x(a, b) by Lentz's continued fraction (DLMF 8.17.22)."""
    if x <= 0.0 or x >= 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - beta_cdf(1.0 - x, b, a)
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)) / a
    fraction, c, d = 1.0, 1.0, 0.0
    for i in range(500):
        m = i // 2
        if i == 0:
            term = 1.0
        elif i % 2 == 0:
            term = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        else:
            term = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        d = 1.0 / (1.0 + term * d)
        c = 1.0 + term / c
        fraction *= c * d
        if abs(1.0 - c * d) < 1e-14:
            break
    return front * (fraction - 1.0)


def wilson_interval(successes: int, trials: int, z: float = 1.959964) -> tuple[float, float]:
    """Return the Wilson score interval of a rate (Wilson, Probable Inference, JASA 22, 1927); `z` = 1.96 covers 95%.

    Raises:
        ValueError: The counts are not 0 <= successes <= trials, trials >= 1.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"{successes} of {trials} is no rate")
    rate, share = successes / trials, z * z / trials
    middle = (rate + share / 2.0) / (1.0 + share)
    half = z * math.sqrt(rate * (1.0 - rate) / trials + share / (4.0 * trials)) / (1.0 + share)
    return max(0.0, middle - half), min(1.0, middle + half)

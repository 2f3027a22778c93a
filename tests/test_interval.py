"""The Beta interval against closed forms."""

import math

import pytest

from robosandbox.apps.bench.interval import beta_cdf, beta_interval, wilson_interval


@pytest.mark.parametrize("x", [0.01, 0.2, 0.5, 0.9, 0.999])
def test_beta_cdf_matches_closed_forms(x: float) -> None:
    assert beta_cdf(x, 0.5, 0.5) == pytest.approx(2.0 / math.pi * math.asin(math.sqrt(x)), abs=1e-12)
    assert beta_cdf(x, 7.0, 1.0) == pytest.approx(x**7, abs=1e-12)
    assert beta_cdf(x, 1.0, 200.5) == pytest.approx(1.0 - (1.0 - x) ** 200.5, abs=1e-12)
    assert beta_cdf(x, 3.0, 4.0) + beta_cdf(1.0 - x, 4.0, 3.0) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("successes", "trials"), [(1, 2), (198, 200), (3, 50)])
def test_interval_ends_are_quantiles(successes: int, trials: int) -> None:
    low, high = beta_interval(successes, trials)
    a, b = successes + 0.5, trials - successes + 0.5
    assert (beta_cdf(low, a, b), beta_cdf(high, a, b)) == (pytest.approx(0.025), pytest.approx(0.975))


def test_no_failure_ends_at_one_and_no_success_at_zero() -> None:
    assert beta_interval(200, 200)[1] == 1.0 and beta_interval(0, 200)[0] == 0.0


def test_counts_that_are_no_rate_are_refused() -> None:
    with pytest.raises(ValueError):
        beta_interval(3, 2)


@pytest.mark.parametrize(("successes", "trials"), [(0, 20), (3, 20), (10, 20), (20, 20), (5, 7)])
def test_wilson_limits_are_the_rates_whose_score_is_z(successes: int, trials: int) -> None:
    z = 1.959964
    for limit in wilson_interval(successes, trials, z):
        deviation = abs(successes / trials - limit)
        assert deviation == pytest.approx(z * math.sqrt(limit * (1.0 - limit) / trials), abs=1e-9)

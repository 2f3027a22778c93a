"""Evaluation of a task: its criterion at the end of an episode, while things come to lie still, and two seconds on."""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.driver import Driver, simulated
from robosandbox.tasks.judge.checks import Check
from robosandbox.tasks.judge.finding import Judgement
from robosandbox.tasks.judge.rest import any_moved, rests_for_good
from robosandbox.tasks.success import AllOf, merged
from robosandbox.types import Truth, Verdict

# Between looks after the episode, seconds; chosen below the time in which a thing topples.
_SAMPLE_SECONDS = 0.1
# Seconds for which what a task is about has to lie still. Chosen: what stands on an edge leaves it by a factor of e every
# 0.07 s (a can of 50 mm), so that two seconds make a fall of a tilt that is too small to be simulated.
STILL_SECONDS = 2.0
# Seconds after which it will not come to lie still any more; chosen as twice the time that settling at a start may take.
_PATIENCE_SECONDS = 6.0


def evaluate(criterion: Check, start: Truth, look: Callable[[], Truth], wait: Callable[[float], object]) -> Verdict:
    """Evaluate a criterion at the end of an episode, and for as long as it takes to see that this lasts.

    It has to hold at the end, until what it is about has lain still for two seconds, and for as long as it asks to hold.
    Nothing is waited for where speeds and forces say that nothing can move by itself.

    Args:
        criterion: The task's.
        start: The state in which the episode began.
        look: Returns the state now.
        wait: Lets simulated seconds pass.
    """
    end = look()
    first = criterion.evaluate(start, end)
    if not first.holds:
        return Verdict(False, first.detail)
    names = sorted({*criterion.settled(start, end)})
    elapsed, hold, now, still = 0.0, longest_hold(criterion), end, end
    settled = not names
    while True:
        settled = settled or rests_for_good(still, now) or now.time - still.time >= STILL_SECONDS - 1e-6
        left = (hold - elapsed) if settled else _PATIENCE_SECONDS - elapsed
        if left <= 1e-9:
            break
        wait(min(_SAMPLE_SECONDS, left))
        now = look()
        if now.time - end.time <= elapsed:
            raise RuntimeError(f"waiting {_SAMPLE_SECONDS} s after the episode let no time pass at {now.time:.3f} s")
        elapsed = now.time - end.time
        later = _still_holds(criterion, start, now, elapsed, settled=settled)
        if not later.holds:
            return Verdict(False, {**later.detail, "held_s": elapsed})
        if any_moved(still, now, names):
            still = now
    if not settled:
        return Verdict(False, {**first.detail, "moving_s": elapsed})
    return Verdict(True, first.detail)


def longest_hold(check: Check) -> float:
    """Return for how many seconds a criterion, or any check in it, must stay true."""
    return max([check.hold_s, *(longest_hold(child) for _, child in check.children())])


def _still_holds(check: Check, start: Truth, now: Truth, elapsed: float, *, settled: bool) -> Judgement:
    """Evaluate what has to hold `elapsed` seconds after the end: all of it until everything lies still."""
    if not settled:
        return check.evaluate(start, now)
    if elapsed > longest_hold(check) + 1e-6:
        return Judgement(True)
    if isinstance(check, AllOf) and elapsed > check.hold_s + 1e-6:
        found = [_still_holds(child, start, now, elapsed, settled=True) for child in check.checks]
        return Judgement(all(found), merged(check.checks, found))
    return check.evaluate(start, now)


def true_state(driver: Driver) -> Callable[[], Truth] | None:
    """Return how to ask for the state to judge on: a simulated world's truth, a referee's measurements; None without both."""
    if driver.capabilities.truth:
        return simulated(driver, "a verdict is made of it").truth
    return driver.referee


def aside(driver: Driver) -> Driver:
    """Return a copy of the world to look ahead in, so that judging moves nothing; the driver itself where it makes none."""
    world = driver.simulation
    return driver if world is None or not driver.capabilities.fork else world.fork()

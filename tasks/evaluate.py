"""Whether a task has succeeded: its criterion at the end of an episode, and for as long as it asks to hold."""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.drivers import simulated
from robosandbox.protocols import Driver, Refereed
from robosandbox.tasks.checks import Check
from robosandbox.tasks.success import AllOf, merged
from robosandbox.types import Truth, Verdict
from robosandbox.world.relations import Relation

# Between looks while success has to hold, seconds; chosen below the time in which a thing topples.
_SAMPLE_SECONDS = 0.1


def evaluate(criterion: Check, start: Truth, look: Callable[[], Truth], wait: Callable[[float], object]) -> Verdict:
    """Evaluate a criterion at the end of an episode, and for as long as it asks to hold.

    Args:
        criterion: The task's.
        start: The state in which the episode began.
        look: Returns the state now.
        wait: Lets simulated seconds pass.
    """
    end = look()
    first = criterion.evaluate(start, end)
    elapsed, hold = 0.0, longest_hold(criterion)
    while first.holds and elapsed < hold - 1e-9:
        wait(min(_SAMPLE_SECONDS, hold - elapsed))
        now = look()
        elapsed = now.time - end.time
        later = _still_holds(criterion, start, now, elapsed)
        if not later.holds:
            return Verdict(False, {**later.detail, "held_s": elapsed})
    return Verdict(first.holds, first.detail)


def longest_hold(check: Check) -> float:
    """Return for how many seconds a criterion, or any check in it, must stay true."""
    return max([check.hold_s, *(longest_hold(child) for _, child in check.children())])


def _still_holds(check: Check, start: Truth, now: Truth, elapsed: float) -> Relation:
    """Evaluate what has to hold `elapsed` seconds after the end."""
    if elapsed > longest_hold(check) + 1e-6:
        return Relation(True)
    if isinstance(check, AllOf) and elapsed > check.hold_s + 1e-6:
        found = [_still_holds(child, start, now, elapsed) for child in check.checks]
        return Relation(all(found), merged(check.checks, found))
    return check.evaluate(start, now)


def true_state(driver: Driver) -> Callable[[], Truth] | None:
    """Return how to ask for the state to judge on: a simulated world's truth, a referee's measurements; None without both."""
    if driver.capabilities.truth:
        return simulated(driver, "a verdict is made of it").truth
    return driver.referee if isinstance(driver, Refereed) else None

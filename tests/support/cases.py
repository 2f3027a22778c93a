"""The cases of perturbed episodes: which perturbation happens to which tasks, and which error names its cause.

A case is recoverable when the robot can still do the task, and hopeless when it cannot. Which it is follows from figures of
the world alone (reach of the tool centre point, weight over friction of the pads, widths), never from what the skills do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from support import arrangements, causes, perturbations as drawn
from support.perturbations import FARTHEST
from support.sampling import EpisodeSampler, Perturbation

from robosandbox.driver import simulated
from robosandbox.errors import Failure
from robosandbox.tasks.task import Task
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.world.relations import centre, support

_PICKS = ("pick_cube_scrambled", "pick_can", "pick_ball")
_HANDLED = (*_PICKS, "put_in_bin", "stack_two")

Causes = Callable[[Failure], bool]


@dataclass(frozen=True, slots=True)
class Case:
    """A kind of perturbation.

    Attributes:
        name: Its name.
        tasks: Bundled tasks to which it happens.
        draw: Returns the perturbation that a sampler draws for its episode.
        named: Whether an error names the cause; for what is or may become hopeless.
    """

    name: str
    tasks: tuple[str, ...]
    draw: Callable[[EpisodeSampler], Perturbation] = field(repr=False)
    named: Causes = field(repr=False)


_LOST = causes.out_of_reach
RECOVERABLE = (
    Case("nudged", (*_HANDLED, "push_left"), drawn.nudged, _LOST),
    Case("slipped", _HANDLED, drawn.slipped, _LOST),
    Case("blocked_on_top", ("pick_cube_scrambled", "pick_can", "stack_two"), drawn.blocked_on_top, _LOST),
    Case("crowded", ("pick_cube_scrambled", "pick_can", "stack_two", "put_in_bin"), drawn.crowded, _LOST),
    Case("occupied", ("stack_two", "place_on_block", "place_beside"), drawn.occupied, _LOST),
    Case("toppled", ("stack_three",), drawn.toppled, _LOST),
    Case("rolled_away", ("pick_ball",), drawn.rolled_away, _LOST),
    Case("just_too_far", ("pick_cube_scrambled", "pick_can", "put_in_bin"), drawn.just_too_far, _LOST),
    Case("mislocated", (*_PICKS, "put_in_bin"), drawn.mislocated, _LOST),
    Case("missized", _HANDLED, drawn.missized, _LOST),
    Case("half_closed", (*_PICKS, "put_in_bin"), drawn.half_closed, _LOST),
    Case("weakened", (*_HANDLED, "push_left"), drawn.weakened, _LOST),
    Case("lidded", ("pick_cube_scrambled", "pick_can", "stack_two"), arrangements.lidded, _LOST),
    Case("full_tray", ("put_in_bin",), arrangements.full_tray, _LOST),
    Case("under_rim", ("pick_cube_scrambled", "stack_two"), arrangements.under_rim, _LOST),
    Case("before_drawer", ("open_drawer",), arrangements.before_drawer, _LOST),
)
HOPELESS = (
    Case("bolted", _HANDLED, drawn.bolted, causes.immovable),
    Case("too_wide", _HANDLED, drawn.too_wide, causes.too_wide),
    Case("too_heavy", _HANDLED, drawn.too_heavy, causes.too_heavy),
    Case("far_out", _HANDLED, drawn.far_out, causes.out_of_reach),
    Case("locked", ("open_drawer", "put_in_drawer"), drawn.locked, causes.locked),
    Case("jammed", (*_PICKS, "put_in_bin"), drawn.jammed, causes.stuck_fingers),
)
CASES = {case.name: case for case in (*RECOVERABLE, *HOPELESS)}


def draw_perturbation(case: Case, seed: int) -> tuple[Task, Perturbation, str]:
    """Return a seed's task, what is done to it, and the object that it is about."""
    attempt = 0
    while True:
        sampler = EpisodeSampler(case.name, seed + 100_000 * attempt, case.tasks)
        try:
            perturbation = case.draw(sampler)
        except ValueError:
            # This layout has no room for the perturbation: draw another one.
            attempt += 1
            if attempt == 20:
                raise
            continue
        return sampler.task, perturbation, sampler.subject


def lost(session: EmbeddedWorkcell, subject: str) -> bool:
    """Tell whether an object has come to rest where no part of the hand gets to it."""
    item = simulated(session.driver, "it tells where a lost object lies").truth().objects[subject].detected()
    towards = session.driver.arms["arm"].spec.base_position - centre(item)
    towards[2] = 0.0
    distance = float(np.linalg.norm(towards))
    nearest = distance - float(support(item, towards[None] / distance)[0] - towards @ centre(item) / distance)
    return nearest > FARTHEST

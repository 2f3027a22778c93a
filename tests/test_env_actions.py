"""What an environment makes of actions that no space of it holds."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from robosandbox.apps.envs import ManipulationEnv
from robosandbox.errors import InputError


def test_an_action_of_another_shape_or_not_finite_is_told_and_moves_nothing() -> None:
    with contextlib.closing(ManipulationEnv("home")) as env:
        env.reset(seed=0)
        before = env.session.state().q.copy()
        with pytest.raises(InputError, match=r"action: has shape \(3,\); ee actions have shape \(7,\)"):
            env.step(np.zeros(3))
        with pytest.raises(InputError, match=r"action: .*nan.* not finite"):
            env.step(np.full(7, np.nan))
        assert np.array_equal(env.session.state().q, before)


def test_a_step_before_the_first_reset_is_told() -> None:
    with contextlib.closing(ManipulationEnv("home")) as env:
        with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
            env.step(np.zeros(7))
        env.reset(seed=0)
        env.step(np.zeros(7))

"""Commands of any kind, for an arm whose limits have to hold against them."""

from __future__ import annotations

import numpy as np

from robosandbox.driver import SafeDriver
from robosandbox.errors import FaultError, LimitError
from robosandbox.types import Trajectory


def fuzz(driver: SafeDriver, commands: int, seed: int) -> int:
    """Send an arm jumps, numbers that are none, ways past limits, at any speed; return how many were refused."""
    random = np.random.default_rng(seed)
    arm, refused = driver.arms["arm"], 0
    spec = arm.spec
    for _ in range(commands):
        q = driver.state().q
        wide = random.choice([0.01, 0.1, 1.0, 10.0])
        goal = q + wide * random.standard_normal(spec.n)
        if random.random() < 0.1:
            goal[random.integers(spec.n)] = random.choice([np.nan, np.inf, -np.inf])
        try:
            match random.integers(4):
                case 0:
                    arm.trim(goal)
                case 1:
                    arm.follow(Trajectory(q=np.stack([q, goal]), dt=float(random.choice([1e-9, 0.01, 0.05]))))
                case 2:
                    ramp = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 8)))[:, None]
                    with np.errstate(invalid="ignore"):
                        rows = q + ramp * (goal - q)
                    arm.follow(Trajectory(q=rows, dt=0.01))
                case _:
                    driver.hands["hand"].set_gripper(float(random.choice([-1.0, 0.0, 0.5, 1.0, 2.0, np.nan])))
        except FaultError:
            refused += 1
            # Nobody ends a fault while the arm comes to stand.
            driver.wait(driver.safety.stop_deadline)
            driver.recover()
        except (LimitError, ValueError):
            refused += 1
    return refused

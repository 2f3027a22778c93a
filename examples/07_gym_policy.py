"""A scripted policy of twenty lines on a Gymnasium environment: over the cube, down, close, up.

Needs the extra `gym`. The same policy runs as `robo-sandbox run --task pick_cube_franka --policy 07_gym_policy:grasp`.
"""

import gymnasium
import numpy as np

import robosandbox.apps.envs  # registers the environments


def grasp(env=None):
    """Return a policy from observations to actions (dx, dy, dz, three rotations, gripper)."""
    closed_for = 0

    def policy(seen):
        nonlocal closed_for
        to_cube = seen["environment_state"][:3] - seen["tcp_pose"][:3]
        over = np.linalg.norm(to_cube[:2]) < 0.01
        there = over and abs(to_cube[2]) < 0.01
        closed_for += there or closed_for > 0
        if closed_for:
            move = [0.0, 0.0, 1.0 if closed_for > 8 else 0.0]
        else:
            aim = to_cube + [0.0, 0.0, 0.0 if over else 0.10]
            move = 20.0 * aim
        return np.clip([*move, 0.0, 0.0, 0.0, 1.0 if closed_for else -1.0], -1.0, 1.0).astype(np.float32)

    return policy


if __name__ == "__main__":
    env = gymnasium.make(robosandbox.apps.envs.env_id("pick_cube_franka"))
    for layout in range(3):
        policy = grasp()
        seen, info = env.reset(options={"layout": layout})
        ended = cut = False
        while not (ended or cut):
            seen, reward, ended, cut, info = env.step(policy(seen))
        print(f"layout {layout}: success={info['is_success']} reward={reward:g}")
    env.close()

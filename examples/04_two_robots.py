"""Two sims, each a process with a robot of its own, and one program with an agent for each of them.

The sims are started here to keep the example in one file; anywhere else they are two `robo-sandbox sim` on two machines.
"""

import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

PROMPTS = {"left_arm": "pick up the red cube", "right_arm": "put the green cube on the blue cube"}


@contextmanager
def sim(robot_id: str):
    """Run a sim process and give its endpoint once it listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    program = Path(sys.executable).with_name("robo-sandbox")
    command = [program, "sim", "--robot-id", robot_id, "--listen", endpoint, "--pace", "fast"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            if not process.stdout.readline():
                raise SystemExit(f"the sim of {robot_id} did not start")
            yield endpoint
        finally:
            process.terminate()


def main() -> int:
    with ExitStack() as stack:
        endpoints = [stack.enter_context(sim(robot_id)) for robot_id in PROMPTS]
        client = stack.enter_context(connect(*endpoints))
        sessions = {robot_id: RemoteWorkcell(client.robot(robot_id)) for robot_id in PROMPTS}
        pool = stack.enter_context(ThreadPoolExecutor(len(sessions)))
        # Both work at the same time; each agent waits for its own robot only.
        runs = {robot_id: pool.submit(session.run, PROMPTS[robot_id]) for robot_id, session in sessions.items()}
        episodes = {robot_id: run.result() for robot_id, run in runs.items()}
        for robot_id, episode in episodes.items():
            print(f"{robot_id}: {episode.prompt}: success={episode.success}  {episode.final_detail}")
            print(f"    holds {sessions[robot_id].observe().held}")
    return 0 if all(episode.success for episode in episodes.values()) else 1


if __name__ == "__main__":
    raise SystemExit(main())

"""What the service survives: each fault injected many times into real processes, and counted.

    python benchmarks/faults.py [FAULT ...] [--times 20] [--minutes 10] [--json]

Faults: sim_killed, accepted, agent_killed, cancelled, numbers, deadline, duplicate, busy, late_joiner, slow_consumer, many_clients,
reopened, endurance. All of them when none is named; endurance runs for --minutes.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import zenoh
from pydantic import TypeAdapter
from support.processes import SimProcess

from robosandbox.errors import BusyError, GoalTimeoutError, SkillError, UnknownGoalError
from robosandbox.evidence import PlacementEvidence
from robosandbox.tasks.loader import find_task
from robosandbox.types import Truth
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

TASKS = ("pick_cube_franka", "put_in_bin", "place_on_block", "stack_two", "push_left", "place_beside")
STILL = 0.01
# All of the simulated state, for comparing.
WHOLE = TypeAdapter(Truth).dump_json


def sim_killed(times: int) -> dict[str, Any]:
    """SIGKILL of the sim at a random moment of a skill; a new sim goes on from the state file."""
    finished, noticed, failures = 0, [], []
    for number in range(times):
        task = TASKS[number % len(TASKS)]
        with tempfile.TemporaryDirectory() as folder:
            success, latency, said = _killed_once(task, number, Path(folder, "world.json"))
        noticed.append(latency)
        finished += success
        if not success:
            failures.append(f"{task} seed {number}: {said}")
    return {
        "times": times,
        "task_finished": finished,
        "noticed_ms_max": round(max(noticed), 2),
        "failures": failures,
    }


def _killed_once(task: str, number: int, file: Path) -> tuple[bool, float, str]:
    """Return whether the task was finished, the milliseconds until the agent knew, and what it said."""
    with SimProcess("--task", task, state_file=file) as sim, connect(sim.endpoint) as client:
        session = RemoteWorkcell(client.robot())
        wait = random.Random(number).uniform(0.05, 0.95) * _length(session)
        session.reset(number)
        started, killed, seen = threading.Event(), [0.0], [0.0]
        client.listeners.append(lambda _, there: None if there or seen[0] else seen.__setitem__(0, time.monotonic()))
        session.ctx.events.subscribe(lambda _: started.set())

        def kill() -> None:
            started.wait()
            time.sleep(wait)
            killed[0] = time.monotonic()
            sim.kill()
            sim.restart()

        killer = threading.Thread(target=kill)
        killer.start()
        episode = session.run()
        killer.join()
        verdict = session.judge()
        said = f"{episode.final_reason}: {episode.final_detail}"
        return bool(verdict and verdict.success), 1000.0 * (seen[0] - killed[0]), said


def accepted(times: int) -> dict[str, Any]:
    """SIGKILL of the sim at a random moment with goals open: the next one must know every goal that was accepted."""
    sent, known, statuses, wrong = 0, 0, dict[str, int](), []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "world.json")
        with SimProcess("--task", "pick_from_three", state_file=file) as sim:
            for number in range(times):
                goals = _sent_and_killed(sim, random.Random(2000 + number))
                with connect(sim.endpoint) as client:
                    for skill, goal_id in goals:
                        sent += 1
                        try:
                            goal = client.robot().result(skill, goal_id)
                        except UnknownGoalError:
                            wrong.append(f"kill {number}: {skill} goal {goal_id} is unknown")
                            continue
                        said = f"{goal.status}/{goal.error.code}" if goal.error else str(goal.status)
                        statuses[said] = statuses.get(said, 0) + 1
                        # The first may have ended before the kill; none may be left open.
                        known += goal.status.final
    return {"times": times, "accepted": sent, "known": known, "as": statuses, "wrong": wrong}


def _sent_and_killed(sim: SimProcess, rng: random.Random) -> list[tuple[str, str]]:
    """Send one to four goals, kill the sim at a random moment after the last was accepted, and start it again."""
    with connect(sim.endpoint) as client:
        robot = client.robot()
        robot.reset(rng.randrange(100))
        goals = [robot.send("pick", {"object": "red_cube"})]
        goals += [robot.send("home", queue=True) for _ in range(rng.randrange(4))]
        # Half of the kills within the first milliseconds, the others in the middle of the motion.
        time.sleep(rng.uniform(0.0, 0.01) if rng.random() < 0.5 else rng.uniform(0.01, 2.0))
        sim.kill()
        names = [(goal.goal.skill, goal.id) for goal in goals]
    sim.restart()
    return names


def _length(session: RemoteWorkcell) -> float:
    """Return how long the task takes at real time, seconds; what passed before it began is not part of it."""
    session.robot.set_pace("fast")
    begin = session.elapsed()[0]
    session.run()
    took = session.elapsed()[0] - begin
    session.robot.set_pace("realtime")
    return took


_AGENT = "from robosandbox.apps.cli import main; main()"


def agent_killed(times: int) -> dict[str, Any]:
    """SIGKILL of an agent in the middle of a goal; the arm must hold and the next client be served at once."""
    held, served, latencies, drift = 0, 0, [], []
    with SimProcess("--task", "pick_from_three") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        for number in range(times):
            robot.reset(number)
            rng = random.Random(number)
            command = [sys.executable, "-c", _AGENT, "agent", "pick up the red cube", "--connect", sim.endpoint]
            agent = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _until(lambda: robot.state().goal_id is not None)
            time.sleep(rng.uniform(0.1, 3.0))
            agent.send_signal(signal.SIGKILL)
            agent.wait()
            begin = time.monotonic()
            _until(lambda: robot.state().goal_id is None)
            latencies.append(1000.0 * (time.monotonic() - begin))
            before = robot.state()
            # What the next client asks for first.
            with connect(sim.endpoint) as other:
                begin_state = other.robot().state()
                time.sleep(0.5)
                after = other.robot().state()
                moved = max(abs(a - b) for a, b in zip(begin_state.robot.q, after.robot.q, strict=True))
                drift.append(moved)
                held += bool(moved < 0.002 and max(abs(v) for v in before.robot.qd) < 0.05)
                session = RemoteWorkcell(other.robot())
                goal = other.robot().send("home")
                goal.wait()
                if session.observe().held is None:
                    episode = session.run("pick up the red cube")
                    served += episode.success
                else:
                    served += 1
    return {
        "times": times,
        "arm_holds": held,
        "next_client_served": served,
        "free_after_ms_max": round(max(latencies), 1),
        "drift_in_half_a_second_rad_max": round(max(drift), 6),
    }


def cancelled(times: int) -> dict[str, Any]:
    """Cancel at a random moment of a task; how long the arm goes on, in simulated time."""
    waits: list[float] = []
    phases: dict[str, int] = {}
    ended = 0
    with SimProcess("--task", "put_in_bin") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        session = RemoteWorkcell(robot)
        for number in range(times):
            session.load(find_task(TASKS[number % len(TASKS)]))
            length = _length(session)
            session.reset(number)
            rng = random.Random(1000 + number)
            states: list[tuple[float, float]] = []
            at: list[tuple[float, int]] = []
            watcher = robot.watch("obs/state", lambda sample, states=states: states.append(_speed(sample)))

            def cancel(
                wait: float = rng.uniform(0.0, length), at: list[tuple[float, int]] = at, states: list[Any] = states
            ) -> None:
                time.sleep(wait)
                at.append((robot.state().robot.time, len(states)))
                session.ctx.cancel()

            thread = threading.Thread(target=cancel)
            thread.start()
            episode = session.run()
            thread.join()
            time.sleep(0.6)
            watcher.undeclare()
            if episode.final_reason != "cancelled":
                continue
            ended += 1
            phase = str(episode.attempts[-1].error.phase)
            phases[phase] = phases.get(phase, 0) + 1
            waits.append(_still_after(states[at[0][1] :], at[0][0]))
    return {
        "times": times,
        "cancelled": ended,
        "sim_s_to_still_max": round(max(waits), 3),
        "sim_s_to_still_median": round(sorted(waits)[len(waits) // 2], 3),
        "phases": phases,
    }


def _speed(sample: zenoh.Sample) -> tuple[float, float]:
    state = json.loads(sample.payload.to_bytes())
    return state["robot"]["time"], max(abs(value) for value in state["robot"]["arms"]["arm"]["qd"])


def _still_after(states: list[tuple[float, float]], begin: float) -> float:
    """Return the simulated seconds from `begin` to the last message in which a joint moved."""
    moving = [at for at, speed in states if at > begin and speed > STILL]
    return max(moving) - begin if moving else 0.0


def numbers(_: int) -> dict[str, Any]:
    """NaN and infinity in every numeric argument and message field: refused before they reach physics."""
    tried, refused = 0, 0
    with SimProcess("--task", "push_left", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        before = WHOLE(robot.truth())
        for value in ("NaN", "Infinity", "-Infinity", "1e999", '"nan"', '"inf"', "null", "[]"):
            for body in (
                f'"arguments":{{"object":"red_cube","direction":"left","distance":{value}}}',
                f'"arguments":{{"object":"red_cube","direction":"left","distance":0.1}},"timeout":{value}',
            ):
                if value == "null" and "timeout" in body:
                    continue
                tried += 1
                refused += _refused(client.session, "push", f'{{"goal_id":"{uuid.uuid4()}",{body}}}')
            tried += 1
            refused += _refused(
                client.session, "place_at", f'{{"goal_id":"{uuid.uuid4()}","arguments":{{"x":{value},"y":0}}}}'
            )
        unmoved = WHOLE(robot.truth()) == before
    return {"tried": tried, "refused": refused, "physics_untouched": unmoved}


def _refused(session: zenoh.Session, skill: str, payload: str) -> bool:
    for reply in session.get(f"robosandbox/robot/skill/{skill}/send_goal", payload=payload, timeout=10.0):
        if reply.ok is not None:
            return False
        return bool(reply.err and json.loads(reply.err.payload.to_bytes())["code"] in _REFUSALS)
    return False


_REFUSALS = ("invalid_argument", "invalid_message")


def deadline(times: int) -> dict[str, Any]:
    """A goal that may take less time than it needs: stopped in time, the arm still, or done before."""
    stopped, done, late = 0, 0, []
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        for number in range(times):
            robot.reset(number)
            limit = random.Random(number).uniform(0.2, 2.5)
            goal = robot.send("pick", {"object": "red_cube"}, timeout=limit)
            try:
                goal.wait(30.0)
                done += 1
            except GoalTimeoutError:
                ended = goal.goal
                late.append((ended.ended or 0.0) - (ended.began or 0.0) - limit)
                stopped += bool(max(abs(speed) for speed in robot.state().robot.qd) < STILL)
    return {"times": times, "stopped_and_still": stopped, "done_in_time": done, "sim_s_over_the_limit_max": round(max(late), 3)}


def duplicate(times: int) -> dict[str, Any]:
    """The same goal id sent again while it runs and after: it runs once."""
    once = 0
    with SimProcess("--task", "push_left", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        for number in range(times):
            robot.reset(number)
            start = {item.id: item.pose.xyz for item in robot.observe().objects}
            arguments = {"object": "red_cube", "direction": "left", "distance": 0.08}
            name = str(uuid.uuid4())
            goals = [robot.send("push", arguments, goal_id=name) for _ in range(5)]
            results = [goal.wait(60.0) for goal in goals]
            results.append(robot.send("push", arguments, goal_id=name).wait(10.0))
            went = {item.id: item.pose.xyz for item in robot.observe().objects}["red_cube"][1] - start["red_cube"][1]
            once += bool(all(result == results[0] for result in results) and 0.06 < went < 0.11)
    return {"times": times, "ran_once": once}


def busy(times: int) -> dict[str, Any]:
    """A second goal while one runs: refused, or queued where asked."""
    refused, queued = 0, 0
    with SimProcess("--task", "pick_from_three") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        for _ in range(times):
            robot.reset(0)
            first = robot.send("pick", {"object": "red_cube"})
            try:
                robot.send("home")
            except BusyError as error:
                refused += getattr(error.evidence, "goal_id", None) == first.id
            second = robot.send("home", queue=True)
            first.cancel()
            queued += second.wait(60.0).skill == "home"
    return {"times": times, "refused": refused, "queued_ran": queued}


def late_joiner(times: int) -> dict[str, Any]:
    """A client that comes after the end reads the result."""
    read = 0
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim:
        for number in range(times):
            with connect(sim.endpoint) as client:
                client.robot().reset(number)
                goal = client.robot().send("pick", {"object": "red_cube"})
                result = goal.wait(60.0)
            with connect(sim.endpoint) as other:
                read += other.robot().result("pick", goal.id).result == result
    return {"times": times, "result_read": read}


def slow_consumer(_: int) -> dict[str, Any]:
    """A subscriber to every stream that sleeps in its callback: physics keeps its pace."""

    def measure(robot: Any) -> float:
        begin_sim, begin = robot.state().robot.time, time.monotonic()
        robot.send("pick", {"object": "red_cube"}).wait(60.0)
        robot.send("home").wait(60.0)
        return (robot.state().robot.time - begin_sim) / (time.monotonic() - begin)

    with SimProcess("--task", "pick_from_three") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        alone = measure(robot)
        robot.reset(0)
        with connect(sim.endpoint) as other:
            slow = other.robot().watch("obs/**", lambda _: time.sleep(0.5))
            beside = measure(robot)
            slow.undeclare()
    return {"realtime_factor_alone": round(alone, 3), "realtime_factor_beside": round(beside, 3)}


def many_clients(_: int, count: int = 50) -> dict[str, Any]:
    """Fifty clients at once that look and send goals, queued."""
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim:

        def work(number: int) -> str:
            with connect(sim.endpoint, timeout=30.0) as client:
                robot = client.robot()
                for _ in range(5):
                    robot.observe()
                    robot.state()
                while True:
                    try:
                        robot.send("home", queue=True).wait(120.0)
                        return "done"
                    except BusyError:
                        time.sleep(0.05)

        begin = time.monotonic()
        with ThreadPoolExecutor(count) as pool:
            done = sum(answer == "done" for answer in pool.map(work, range(count)))
        took = time.monotonic() - begin
        with connect(sim.endpoint) as client:
            client.robot().reset(0)
            picked = client.robot().send("pick", {"object": "red_cube"}).wait(60.0).skill == "pick"
    return {"clients": count, "served": done, "seconds": round(took, 2), "pick_afterwards": picked}


def reopened(_: int, count: int = 200) -> dict[str, Any]:
    """Connect and close again and again."""
    with SimProcess("--task", "home", "--pace", "fast") as sim:
        opened, sizes, files = 0, [], []
        for _ in range(count):
            with connect(sim.endpoint) as client:
                opened += client.robot().state().goal_id is None
            sizes.append(_rss_mb(sim.pid))
            files.append(len(list(Path(f"/proc/{sim.pid}/fd").iterdir())))
    return {
        "times": count,
        "opened": opened,
        "sim_rss_mb_after_20": round(sizes[19], 1),
        "sim_rss_mb_at_the_end": round(sizes[-1], 1),
        "sim_open_files_after_20": files[19],
        "sim_open_files_at_the_end": files[-1],
    }


def endurance(_: int, minutes: float = 10.0) -> dict[str, Any]:
    """Goals without a pause: memory of the sim and of this client."""
    goals, occupied, failed, sizes, own = 0, 0, 0, [], []
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        begin = time.monotonic()
        next_sample = 0.0
        while (now := time.monotonic() - begin) < 60.0 * minutes:
            if now >= next_sample:
                next_sample += 6.0 * minutes / 10.0
                sizes.append(_rss_mb(sim.pid))
                own.append(_rss_mb("self"))
            robot.reset(goals % 100)
            for skill, arguments in (("pick", {"object": "red_cube"}), ("place_at", {"x": 0.1, "y": 0.2})):
                try:
                    robot.send(skill, arguments).wait(60.0)
                except SkillError as error:
                    # Some layouts have a cube on the mark, or nearer to it than the cubes' spacing: rightly refused.
                    full = isinstance(error.evidence, PlacementEvidence) and error.evidence.reason == "occupied"
                    occupied, failed = occupied + full, failed + (not full)
                goals += 1
    settled = max(1, len(sizes) // 5)
    return {
        "minutes": minutes,
        "goals": goals,
        "refused_as_occupied": occupied,
        "failed_goals": failed,
        "sim_rss_mb": [round(size, 1) for size in (sizes[0], sizes[settled], sizes[len(sizes) // 2], sizes[-1])],
        "client_rss_mb": [round(size, 1) for size in (own[0], own[settled], own[len(own) // 2], own[-1])],
    }


def _rss_mb(pid: int | str) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024.0
    return 0.0


def _until(holds: Callable[[], bool], timeout: float = 30.0) -> None:
    end = time.monotonic() + timeout
    while not holds():
        if time.monotonic() > end:
            raise SystemExit("waited in vain")
        time.sleep(0.002)


FAULTS: dict[str, Callable[..., dict[str, Any]]] = {
    act.__name__: act
    for act in (
        sim_killed,
        accepted,
        agent_killed,
        cancelled,
        numbers,
        deadline,
        duplicate,
        busy,
        late_joiner,
        slow_consumer,
        many_clients,
        reopened,
        endurance,
    )
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("faults", nargs="*", choices=[[], *FAULTS], default=[])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    table: dict[str, Any] = {}
    for name in arguments.faults or FAULTS:
        begin = time.monotonic()
        act = FAULTS[name]
        row = act(arguments.times, arguments.minutes) if name == "endurance" else act(arguments.times)
        table[name] = {**row, "seconds_taken": round(time.monotonic() - begin, 1)}
        if not arguments.json:
            print(f"{name:14} {', '.join(f'{key}={value}' for key, value in table[name].items())}", flush=True)
    if arguments.json:
        print(json.dumps(table, indent=2))


if __name__ == "__main__":
    main()

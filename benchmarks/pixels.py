"""What an episode on pixels costs beside the same one on the simulated state: CPU, pictures, success; rendering included.

    python benchmarks/pixels.py [--suite standard] [--tasks NAME ...] [--seeds 5] [--sensor realsense] [--json]
    python benchmarks/pixels.py --perception rgb --cameras scene top --sensor webcam --own-sensor --seeds 20

Both episodes of a seed run one after the other in one process, so that whatever else the machine does slows both. CPU
time is that of all threads of the process, those that draw included. A picture of a part is counted as a window. With
`--own-sensor` each seed has a sensor of its own: other noise, and another error of calibration. False are the claims that the
judge denies; what was not claimed is listed with the last thing that was said.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from robosandbox import open_session
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.types import PictureWindow, RgbdFrame
from robosandbox.workcell.workcell import Workcell


@dataclass
class Side:
    """Episodes of one task on one perception.

    Attributes:
        cpu: Seconds of each episode.
        whole: Pictures that were taken whole.
        windows: Pictures of which a part was taken.
        claimed: Episodes that the agent called done.
        judged: Episodes that were done.
        differ: Episodes of which agent and judge say different things.
        false: Episodes that the agent called done and that were not.
        refused: What was said last of each that was not claimed.
    """

    cpu: list[float] = field(default_factory=list)
    whole: int = 0
    windows: int = 0
    claimed: int = 0
    judged: int = 0
    differ: int = 0
    false: int = 0
    refused: list[str] = field(default_factory=list)

    def count(self, capture: Callable[..., RgbdFrame]) -> Callable[..., RgbdFrame]:
        """Return a driver's `capture` that is counted."""

        def counted(camera: str, window: PictureWindow | None = None) -> RgbdFrame:
            self.windows += window is not None
            self.whole += window is None
            return capture(camera, window)

        return counted

    def run(self, session: Workcell, seed: int) -> None:
        """Run the episode of a seed."""
        session.reset(seed)
        begin = time.process_time()
        episode = session.run()
        self.cpu.append(time.process_time() - begin)
        success = session.judge().success
        self.claimed += episode.success
        self.judged += success
        self.differ += episode.success != success
        self.false += episode.success and not success
        if not episode.success:
            self.refused.append(f"seed {seed}, {'done' if success else 'not done'}: {episode.final_detail}")


def compare(
    task: str, seeds: int, sensor: str, perception: str, options: Mapping[str, Any], *, own_sensor: bool
) -> tuple[Side, Side]:
    """Return a task's episodes on the simulated state and on pixels."""
    truth, pixels = Side(), Side()
    with (
        open_session(task) as exact,
        open_session(task, perception=perception, sensor=sensor, perception_options=options) as seen,
    ):
        # What is made once, as compiled models, graphics contexts and tables of noise, is made in an episode that does not count.
        for session in (exact, seen):
            Side().run(session, 0)
        capture: Any = pixels.count(seen.mujoco.capture)
        seen.mujoco.capture = capture  # type: ignore[method-assign]
        for seed in range(seeds):
            truth.run(exact, seed)
            if own_sensor:
                seen.mujoco.sensor = replace(seen.mujoco.sensor, seed=seed)
            pixels.run(seen, seed)
    return truth, pixels


def row(task: str, truth: Side, pixels: Side) -> dict[str, Any]:
    """Return a line of the table."""
    episodes = len(truth.cpu)
    return {
        "task": task,
        "episodes": episodes,
        "truth_ms": round(1000.0 * sum(truth.cpu) / episodes, 1),
        "pixels_ms": round(1000.0 * sum(pixels.cpu) / episodes, 1),
        "ratio": round(sum(pixels.cpu) / sum(truth.cpu), 2),
        "pictures": round(pixels.whole / episodes, 1),
        "windows": round(pixels.windows / episodes, 1),
        "claimed": pixels.claimed,
        "judged": pixels.judged,
        "differ": pixels.differ,
        "false": pixels.false,
        "judged_on_truth": truth.judged,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--suite", default=STANDARD_SUITE)
    parser.add_argument("--tasks", nargs="*", help="these, and not a suite")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--sensor", default="realsense")
    parser.add_argument("--perception", default="rgbd")
    parser.add_argument("--cameras", nargs="*", help="those that are looked through; else all")
    parser.add_argument("--own-sensor", action="store_true", help="other noise and calibration for each seed")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    tasks = arguments.tasks or [entry.name for entry in task_entries() if entry.suite == arguments.suite]
    rows, whole = [], (Side(), Side())
    for task in tasks:
        sides = compare(
            task,
            arguments.seeds,
            arguments.sensor,
            arguments.perception,
            {"cameras": tuple(arguments.cameras)} if arguments.cameras else {},
            own_sensor=arguments.own_sensor,
        )
        for total, side in zip(whole, sides, strict=True):
            for name, value in vars(side).items():
                setattr(total, name, getattr(total, name) + value)
        rows.append(row(task, *sides))
        if not arguments.json:
            print(_line(rows[-1], header=len(rows) == 1), flush=True)
            for reason in sides[1].refused:
                print(f"    {reason}", flush=True)
    rows.append(row("together", *whole))
    print(json.dumps(rows, indent=2) if arguments.json else _line(rows[-1], header=False))


def _line(cells: dict[str, Any], *, header: bool) -> str:
    name, *rest = cells
    lines = [f"{name:20}" + "".join(f"{key:>16}" for key in rest)] if header else []
    lines.append(f"{cells[name]:20}" + "".join(f"{cells[key]:>16}" for key in rest))
    return "\n".join(lines)


if __name__ == "__main__":
    main()

"""How often a browser is sent the world's poses, and what the viewer costs while it shows them and while nothing happens.

`uv run --extra viewer benchmarks/viewer.py [--connect] [--json]`; drives `robo-sandbox viewer` from headless Chromium and
counts at the page. `--connect` has the world in a sim process, at the speed of the clock.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Page, sync_playwright
from support.processes import SimProcess

TASK = "stack_two"
IDLE_SECONDS = 10.0
PATIENCE = 120.0
# WebGL on a CPU; the sandbox needs a user other than root.
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"]
# The page's worker hands on what came over the websocket: when, how many poses, and the simulated time where it is told.
COUNT = """
window.arrived = [];
const Plain = window.Worker;
window.Worker = class extends Plain {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", event => {
      const messages = (event.data && event.data.messages) || [];
      const poses = messages.filter(one => one.type === "SetPositionMessage" || one.type === "SetOrientationMessage");
      const told = JSON.stringify(messages.filter(one => one.type === "GuiUpdateMessage"));
      const seconds = told.match(/simulated time.*?([0-9.]+) s/);
      window.arrived.push([performance.now() / 1000, poses.length, seconds ? parseFloat(seconds[1]) : null]);
    });
  }
};
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--connect", action="store_true", help="with the world in another process")
    parser.add_argument("--json", action="store_true", help="one document on stdout")
    options = parser.parse_args()
    chromium = next((found for name in ("chromium", "chromium-browser") if (found := shutil.which(name))), None)
    if chromium is None:
        sys.exit("no Chromium on this machine: apt-get install chromium")
    with ExitStack() as opened:
        given = ["--task", TASK]
        if options.connect:
            sim = opened.enter_context(SimProcess("--task", TASK, "--pace", "realtime"))
            given = ["--connect", sim.endpoint]
        url, pid = opened.enter_context(viewer(given))
        playwright = opened.enter_context(sync_playwright())
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        opened.callback(browser.close)
        page = browser.new_page(viewport={"width": 480, "height": 320})
        page.add_init_script(COUNT)
        # A quarter of the pixels: they are drawn on a CPU here.
        page.goto(f"{url}/?fixedDpr=0.5")
        page.locator("xpath=//label[normalize-space()='Prompt']/following::input[1]").wait_for(timeout=1000 * PATIENCE)
        found = {"load": os.getloadavg()[0], "connected": options.connect, **idle(pid), **moving(page, pid)}
    print(
        json.dumps(found, indent=1)
        if options.json
        else "\n".join(f"{name:<24} {value}" for name, value in found.items())
    )
    return 0 if found["poses_hz"] >= 20.0 and found["idle_cpu_percent"] < 3.0 else 1


@contextmanager
def viewer(given: list[str]) -> Iterator[tuple[str, int]]:
    """Start `robo-sandbox viewer`; yield its address and process id."""
    command = [sys.executable, "-c", "from robosandbox.apps.cli import main; main()", "viewer", "--port", "0", *given]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline() if process.stdout else ""
        address = re.search(r"http://[\d.:]+\d", line)
        if address is None:
            raise RuntimeError(f"the viewer did not start: {line!r}")
        yield address.group(), process.pid
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def idle(pid: int) -> dict[str, float]:
    """Return the server's share of a core while a browser looks and nothing happens."""
    time.sleep(3.0)
    begin = cpu_seconds(pid)
    time.sleep(IDLE_SECONDS)
    return {"idle_cpu_percent": round(100.0 * (cpu_seconds(pid) - begin) / IDLE_SECONDS, 2)}


def moving(page: Page, pid: int) -> dict[str, Any]:
    """Run the task; return how the poses arrived at the page, and the server's share of a core."""
    page.evaluate("window.arrived = []")
    cpu, wall = cpu_seconds(pid), time.monotonic()
    page.get_by_role("button", name="Run", exact=True).click()
    page.get_by_text("judged on the simulated state: success").wait_for(timeout=1000 * PATIENCE)
    cpu, wall = cpu_seconds(pid) - cpu, time.monotonic() - wall
    arrived = page.evaluate("window.arrived")
    clock = [(when, seconds) for when, _, seconds in arrived if seconds is not None]
    (begin, first), (end, last) = clock[0], clock[-1]
    times = np.array([when for when, poses, _ in arrived if poses and begin <= when <= end])
    gaps = 1000.0 * np.diff(times)
    return {
        "poses_hz": round(len(times) / (end - begin), 2),
        "poses_per_simulated_s": round(len(times) / (last - first), 2),
        "simulated_s": round(last - first, 2),
        "share_of_real_time": round((last - first) / (end - begin), 3),
        "gap_ms_median": round(float(np.median(gaps)), 1),
        "gap_ms_p95": round(float(np.percentile(gaps, 95)), 1),
        "gap_ms_max": round(float(gaps.max()), 1),
        "server_cpu_percent": round(100.0 * cpu / wall, 1),
    }


def cpu_seconds(pid: int) -> float:
    """Return the CPU time that a process has had."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    sys.exit(main())

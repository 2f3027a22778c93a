"""Whether what runs is what the viewer's box shows, however fast a sentence is typed or pasted.

`uv run --extra viewer benchmarks/viewer_typing.py [--trials N] [--json]`; drives `robo-sandbox viewer` from headless Chromium. Each
sentence is different. What ran is read from the viewer's log, what was shown from the box and from the panel.
"""

from __future__ import annotations

import argparse
import itertools
import json
import queue
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from playwright.sync_api import Page, sync_playwright

TASK = "pick_cube_franka"
PATIENCE = 120.0
# WebGL on a CPU; the sandbox needs a user other than root.
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"]
SPEEDS_MS = (0, 30, 80)
# None of these is in the scene: the sentences are refused at once, and it is their way that is measured.
COLOURS = ("purple", "orange", "pink", "golden", "grey", "brown", "black", "white", "silver", "violet", "cyan", "beige")
THINGS = (
    "teapot",
    "saucer",
    "candle",
    "hammer",
    "sponge",
    "pencil",
    "marble",
    "button",
    "ladle",
    "bottle",
    "spool",
    "brush",
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=20, help="of each way")
    parser.add_argument("--json", action="store_true", help="one document on stdout")
    options = parser.parse_args()
    chromium = next((found for name in ("chromium", "chromium-browser") if (found := shutil.which(name))), None)
    if chromium is None:
        sys.exit("no Chromium on this machine: apt-get install chromium")
    sentences = [f"pick up the {colour} {thing}" for colour, thing in itertools.product(COLOURS, THINGS)]
    random.Random(0).shuffle(sentences)
    given = itertools.cycle(sentences)
    ways = [(how, sent) for how in (*SPEEDS_MS, "paste") for sent in ("Enter", "Run")]
    rows = []
    with viewer() as (url, log), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_page(viewport={"width": 800, "height": 480})
        page.set_default_timeout(1000 * PATIENCE)
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        # A quarter of the pixels: they are drawn on a CPU here.
        page.goto(f"{url}/?fixedDpr=0.5")
        page.get_by_label("Prompt").wait_for()
        for how, sent in ways:
            same = sum(trial(page, log, next(given), how, sent) for _ in range(options.trials))
            rows.append({"typed": how, "sent": sent, "same": same, "trials": options.trials})
            if not options.json:
                pace = "pasted" if how == "paste" else f"{how} ms a key"
                print(f"{pace:<12} {sent:<6} {same:>3} of {options.trials}", flush=True)
        browser.close()
    if options.json:
        print(json.dumps(rows, indent=1))
    return 0 if all(row["same"] == row["trials"] for row in rows) else 1


def trial(page: Page, log: queue.Queue[str], sentence: str, how: int | str, sent: str) -> bool:
    """Type a sentence and send it off; return whether it is what the box shows, what ran, and what the panel says has run."""
    box = page.get_by_label("Prompt")
    box.fill("")
    if isinstance(how, int):
        box.press_sequentially(sentence, delay=how)
    else:
        page.evaluate("text => navigator.clipboard.writeText(text)", sentence)
        box.press("Control+v")
    if sent == "Enter":
        page.keyboard.press("Enter")
    else:
        page.get_by_role("button", name=sent, exact=True).click()
    ran = following(log, "running: ")
    following(log, "refused: ")
    panel = page.get_by_text("“", exact=False).filter(has_text=ran).first
    panel.wait_for()
    return sentence == box.input_value() == ran == panel.inner_text().strip("“”")


def following(log: queue.Queue[str], start: str) -> str:
    """Return the rest of the next line of the log that begins so."""
    while True:
        line = log.get(timeout=PATIENCE)
        if line.startswith(start):
            return line.removeprefix(start)


@contextmanager
def viewer() -> Iterator[tuple[str, queue.Queue[str]]]:
    """Start `robo-sandbox viewer`; yield its address and the lines of its log."""
    command = [
        sys.executable,
        "-c",
        "from robosandbox.apps.cli import main; main()",
        "viewer",
        "--port",
        "0",
        "--task",
        TASK,
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    log: queue.Queue[str] = queue.Queue()

    def read(stream: IO[str]) -> None:
        for line in stream:
            log.put(line.rstrip("\n"))

    try:
        if process.stdout is None or process.stderr is None:
            raise RuntimeError("the viewer's output cannot be read")
        threading.Thread(target=read, args=(process.stderr,), daemon=True).start()
        line = process.stdout.readline()
        address = re.search(r"http://[\d.:]+\d", line)
        if address is None:
            raise RuntimeError(f"the viewer did not start: {line!r}")
        yield address.group(), log
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


if __name__ == "__main__":
    sys.exit(main())

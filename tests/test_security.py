"""Who may do what: a sim is closed by default, and the shipped configurations let in and keep out whom they say."""

import json
import os
import re
import socket
import stat
import struct
import subprocess
import sys
import threading
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import zenoh
from support.kits import Kit, copy_kit, make_certificates, running_kit

from robosandbox.apps.commands.console import EXIT_UNAVAILABLE, EXIT_USAGE
from robosandbox.errors import ForbiddenError, InputError, InvalidArgumentError, ServiceUnavailableError, SkillError
from robosandbox.workcell.zenoh import access
from robosandbox.workcell.zenoh.client import Client, RemoteRobot, connect
from robosandbox.workcell.zenoh.messages import DEFAULT_ENDPOINT
from robosandbox.workcell.zenoh.transport import open_connector, open_listener

EXAMPLES = Path(__file__).resolve().parents[1] / "examples" / "zenoh"
COMMAND = Path(sys.executable).with_name("robo-sandbox")
ODD_NAMES = (
    "**",
    "*",
    "..",
    "../../etc/passwd",
    "a/b",
    "$*",
    "a$b",
    "a#b",
    "a?b=c",
    "höme",
    "",
    " ",
    "\0",
    "x" * 10_000,
)
LINUX = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads the sockets of a process from /proc")
pytestmark = LINUX


# Sockets of a process.


def sockets(pid: int) -> set[tuple[str, str, int, bool]]:
    """Return protocol, local address, local port and whether it listens, of each internet socket of a process."""
    inodes = set()
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        try:
            target = os.readlink(entry)
        except FileNotFoundError:
            continue
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    found = set()
    for protocol in ("tcp", "tcp6", "udp", "udp6"):
        table = Path(f"/proc/{pid}/net/{protocol}")
        for line in table.read_text().splitlines()[1:] if table.exists() else ():
            _, local, _, state, *rest = line.split()
            if rest[5] in inodes:
                address, port = local.split(":")
                found.add((protocol, _address(address), int(port, 16), state == "0A"))
    return found


def _address(text: str) -> str:
    words = [int(text[i : i + 8], 16) for i in range(0, len(text), 8)]
    packed = struct.pack(f"={len(words)}I", *words)
    return socket.inet_ntop(socket.AF_INET if len(words) == 1 else socket.AF_INET6, packed)


def listening(pid: int) -> set[tuple[str, int]]:
    return {(address, port) for protocol, address, port, listens in sockets(pid) if listens and "tcp" in protocol}


# Sims.


@dataclass(frozen=True)
class Sim:
    process: "subprocess.Popen[str]"
    greeting: str

    @property
    def port(self) -> int:
        return next(iter(listening(self.process.pid)))[1]


@contextmanager
def sim(*arguments: str, cwd: Path | None = None) -> Iterator[Sim]:
    """Run a sim process from when it listens; its port is of the system's choice if the endpoint says 0."""
    process = subprocess.Popen(
        [COMMAND, "sim", "--task", "home", "--pace", "fast", *arguments], stdout=subprocess.PIPE, text=True, cwd=cwd
    )
    assert process.stdout is not None
    with process:
        try:
            greeting = process.stdout.readline()
            assert "listening on" in greeting, f"the sim ended with {process.wait()}"
            yield Sim(process, greeting)
        finally:
            process.terminate()


@pytest.fixture(scope="module")
def open_sim() -> Iterator[Client]:
    with sim("--listen", "tcp/127.0.0.1:0") as running, connect(f"tcp/127.0.0.1:{running.port}", timeout=30) as client:
        yield client


# Closed by default.


def test_default_sim_listens_on_loopback_only_and_nothing_is_udp() -> None:
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", 7447)) == 0:
            pytest.skip("another program has the default port")
    with sim() as running:
        assert DEFAULT_ENDPOINT in running.greeting
        assert listening(running.process.pid) == {("127.0.0.1", 7447)}
        with connect(timeout=30) as client:
            client.robot().send("home").wait()
            everything = sockets(running.process.pid)
        assert {protocol for protocol, *_ in everything} == {"tcp"}
        assert {address for _, address, *_ in everything} == {"127.0.0.1"}


def test_client_listens_nowhere() -> None:
    before = sockets(os.getpid())
    session = open_connector(["tcp/127.0.0.1:1"], timeout=0.1)
    try:
        new = sockets(os.getpid()) - before
        assert not [item for item in new if item[3] or "udp" in item[0]]
    finally:
        session.close()


PASSWORD = {"transport": {"auth": {"usrpwd": {"dictionary_file": "users.txt"}}}}
RULES = {"access_control": {"enabled": True, "default_permission": "deny", "rules": [], "subjects": [], "policies": []}}
ONE_WAY_TLS = {"transport": {"link": {"tls": {"listen_certificate": "sim.pem", "listen_private_key": "sim.key"}}}}
MUTUAL_TLS = {"transport": {"link": {"tls": {"enable_mtls": True}}}}


@pytest.mark.parametrize(
    ("listen", "config", "lacks"),
    [
        ("tcp/0.0.0.0:0", {}, ["user/password", "access control"]),
        ("tcp/[::]:0", {}, ["user/password", "access control"]),
        ("udp/0.0.0.0:0", {}, ["user/password", "access control"]),
        ("tcp/0.0.0.0:0", RULES, ["user/password"]),
        ("tcp/0.0.0.0:0", PASSWORD, ["access control"]),
        ("tls/0.0.0.0:0", {**ONE_WAY_TLS, **RULES}, ["client certificates"]),
        ("tls/0.0.0.0:0", MUTUAL_TLS, ["access control"]),
        ("tcp/0.0.0.0:0", {**MUTUAL_TLS, **RULES}, ["user/password"]),
        ("tcp/example.org:0", {}, ["user/password"]),
    ],
)
def test_unprotected_listening_beyond_loopback_is_refused(
    listen: str, config: dict[str, object], lacks: list[str], tmp_path: Path
) -> None:
    file = tmp_path / "config.json5"
    file.write_text(json.dumps(config))
    before = sockets(os.getpid())
    with pytest.raises(InputError, match="can be reached from other machines") as caught:
        open_listener(listen, config_file=file)
    assert all(item in str(caught.value) for item in [*lacks, "examples/zenoh/", "--insecure"])
    assert sockets(os.getpid()) <= before


def test_refusal_is_one_line_and_exit_code_2() -> None:
    ended = subprocess.run([COMMAND, "sim", "--listen", "tcp/0.0.0.0:0"], capture_output=True, text=True, timeout=60)
    assert ended.returncode == EXIT_USAGE and ended.stdout == ""
    assert len(ended.stderr.splitlines()) == 1 and "--insecure" in ended.stderr


def test_insecure_listens_anywhere() -> None:
    session, endpoints = open_listener("tcp/0.0.0.0:0", insecure=True)
    session.close()
    assert endpoints == ("tcp/0.0.0.0:0",)


# The shipped configurations.


def enter(kit: Kit, who: str, *, timeout: float = 30.0) -> Client:
    return connect(*kit.endpoints, zenoh_config=kit.config(who), timeout=timeout, reconnect=5.0)


def altered(kit: Kit, who: str, change: Callable[[str], str]) -> str:
    """Write another version of somebody's configuration and return its name."""
    text = (kit.folder / f"{who}.json5").read_text()
    changed = change(text)
    assert changed != text
    name = f"{who}-{uuid.uuid4().hex[:6]}"
    (kit.folder / f"{name}.json5").write_text(changed)
    return name


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ca") / "certificates"
    make_certificates(EXAMPLES, folder)
    return folder


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("other-ca") / "certificates"
    make_certificates(EXAMPLES, folder)
    return folder


def kit_of(kind: str, folder: Path, certificates: Path) -> AbstractContextManager[Kit]:
    options = ("--task", "home", "--pace", "fast")
    return running_kit(kind, EXAMPLES, folder, certificates=certificates, options=options)


@pytest.fixture(scope="module", params=["password", "tls", "router"])
def kit(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, certificates: Path) -> Iterator[Kit]:
    with kit_of(request.param, tmp_path_factory.mktemp("kit"), certificates) as made:
        yield made


def test_keys_are_private_and_certificates_say_who_and_where(certificates: Path) -> None:
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    assert stat.S_IMODE(certificates.stat().st_mode) == 0o700
    for key in certificates.glob("*.key"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600, key.name
    authority = x509.load_pem_x509_certificate((certificates / "ca.pem").read_bytes())
    for name in ("sim", "router", "operator", "observer"):
        made = x509.load_pem_x509_certificate((certificates / f"{name}.pem").read_bytes())
        made.verify_directly_issued_by(authority)
        assert [item.value for item in made.subject.get_attributes_for_oid(NameOID.COMMON_NAME)] == [name]
    sim_names = x509.load_pem_x509_certificate((certificates / "sim.pem").read_bytes()).extensions
    names = sim_names.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "sim.test"]


def test_making_certificates_again_keeps_what_is_there(certificates: Path) -> None:
    before = {file: file.read_bytes() for file in certificates.iterdir()}
    make_certificates(EXAMPLES, certificates)
    assert {file: file.read_bytes() for file in certificates.iterdir()} == before


def test_shipped_sim_configs_listen_on_every_interface_and_pass_the_check(tmp_path: Path, certificates: Path) -> None:
    for kind, protocol in (("password", "tcp"), ("tls", "tls")):
        folder = copy_kit(kind, EXAMPLES, tmp_path / kind, certificates)
        file = folder / "sim.json5"
        assert f'"{protocol}/0.0.0.0:7447"' in file.read_text()
        file.write_text(file.read_text().replace("0.0.0.0:7447", "0.0.0.0:0"))
        session, endpoints = open_listener(config_file=file)
        session.close()
        assert endpoints == (f"{protocol}/0.0.0.0:0",)


def test_shipped_configs_give_each_role_the_rules_of_the_package() -> None:
    roles = {"observer": access.OBSERVER, "operator": access.OPERATOR}
    for name, sim_rules in (("password/sim", ()), ("tls/sim", ()), ("router/router", access.SIM)):
        config = zenoh.Config.from_file(str(EXAMPLES / f"{name}.json5"))
        control = json.loads(config.get_json("access_control"))
        assert control["enabled"] and control["default_permission"] == "deny", name
        written = {rule["id"]: rule for rule in control["rules"]}
        expected = {**roles, "sim": sim_rules} if sim_rules else roles
        policies = {policy["subjects"][0]: policy["rules"] for policy in control["policies"]}
        assert {role: [written[rule] for rule in rules] for role, rules in policies.items()} == {
            role: [dict(rule) for rule in rules] for role, rules in expected.items()
        }, name
        assert set(written) == {rule["id"] for rules in expected.values() for rule in rules}, name


def test_operator_can_do_everything(kit: Kit) -> None:
    with enter(kit, "operator") as client:
        robot = client.robot()
        goal = robot.send("home")
        assert robot.result("home", goal.id).skill == "home" and goal.wait().skill == "home"
        kept = robot.checkpoint()
        robot.load("home")
        assert robot.truth().objects is not None
        with pytest.raises(InputError, match="checkpoint"):  # forgotten with the load: it arrived and was answered
            robot.reset(checkpoint=kept)


def test_operators_goal_is_followed_by_the_news_that_the_sim_publishes(kit: Kit) -> None:
    with enter(kit, "operator") as client, enter(kit, "observer") as watcher:
        heard: list[str] = []
        final = threading.Event()

        def hear(sample: zenoh.Sample) -> None:
            heard.append(json.loads(sample.payload.to_bytes())["status"])
            if heard[-1] == "succeeded":
                final.set()

        watcher.robot().watch("goal/*/status", hear)
        states = threading.Event()
        watcher.robot().watch("obs/state", lambda _: states.set())
        assert states.wait(20)  # one answer says that the sim knows of this watcher
        client.robot().send("home").wait()
        assert final.wait(20) and "executing" in heard


def test_observer_sees_and_is_told_that_it_may_not_touch(kit: Kit) -> None:
    with enter(kit, "operator") as operator, enter(kit, "observer") as client:
        done = operator.robot().send("home")
        done.wait()
        robot = client.robot()
        assert robot.observe() is not None and len(robot.state().robot.q) and robot.skills
        assert robot.result("home", done.id).status == "succeeded"

        forbidden: dict[str, Callable[[], object]] = {
            "skill/home/send_goal": lambda: robot.send("home"),
            "skill/home/cancel_goal": lambda: robot.cancel(done),
            "reset": lambda: robot.reset(0),
            "load": lambda: robot.load("home"),
            "clock": lambda: robot.step(0.1),
            "checkpoint": robot.checkpoint,
            "truth": robot.truth,
        }
        with ThreadPoolExecutor(len(forbidden)) as pool:
            tries = {suffix: pool.submit(act) for suffix, act in forbidden.items()}
        for suffix, tried in tries.items():
            error = tried.exception()
            assert isinstance(error, ForbiddenError), f"{suffix}: {error!r}"
            assert str(error).startswith(f"{suffix}: ") and "access control" in str(error)
        # Nothing of it has reached the sim.
        assert operator.robot().truth().time >= done.goal.ended


def test_observer_cannot_go_round_the_rules_with_wildcards_or_forgeries(kit: Kit) -> None:
    with enter(kit, "operator") as operator, enter(kit, "observer") as client:
        robot, raw = operator.robot(), client.session
        before = robot.info()
        message = json.dumps({"goal_id": str(uuid.uuid4())})
        for asked in ("**", "robosandbox/**", "robosandbox/*/skill/*/*", "robosandbox/*/skill/home/*", "*/robot/reset"):
            for reply in raw.get(asked, payload=message, timeout=5.0, target=zenoh.QueryTarget.ALL):
                assert reply.ok is not None and "/obs/" in str(reply.ok.key_expr), asked
        heard: list[str] = []
        watch = operator.session.declare_subscriber("robosandbox/*/goal/*/status", lambda s: heard.append(str(s)))
        with (
            raw.liveliness().declare_token("robosandbox/evil/alive"),
            raw.declare_queryable("robosandbox/robot/skill/home/send_goal", lambda q: q.reply(q.key_expr, "stolen")),
        ):
            raw.put(f"robosandbox/robot/goal/{uuid.uuid4()}/status", b"{}")
            # An answer after each: what was sent before it has been dealt with.
            client.robot(robot.id).info()
            robot.info()
            robot.send("home").wait()
            assert "evil" not in operator.robots
        assert not [item for item in heard if item == "{}"]
        watch.undeclare()
        assert robot.info().boot_id == before.boot_id


def all_refused(kit: Kit, *names: str) -> None:
    """Check that nobody of these gets in, and that the operator does."""

    def message(who: str) -> str:
        with pytest.raises(ServiceUnavailableError) as caught:
            enter(kit, who, timeout=2.0).close()
        return str(caught.value)

    with ThreadPoolExecutor(len(names)) as pool:
        for said in pool.map(message, names):
            assert "credentials" in said
    enter(kit, "operator").close()


def test_wrong_user_and_password_are_refused(tmp_path: Path, certificates: Path) -> None:
    with kit_of("password", tmp_path, certificates) as kit:
        all_refused(
            kit,
            altered(kit, "operator", lambda text: text.replace("right horse", "wrong horse")),
            altered(kit, "operator", lambda text: text.replace('"right horse"', '""')),
            altered(kit, "operator", lambda text: text.replace('user: "operator"', 'user: "root"')),
            # Another's password is not one's own.
            altered(kit, "operator", lambda text: text.replace("right horse", "battery staple")),
            altered(kit, "operator", lambda text: re.sub("transport: .*", "", text)),
        )


def test_foreign_certificates_are_refused(tmp_path: Path, certificates: Path, foreign: Path) -> None:
    with kit_of("tls", tmp_path, certificates) as kit:
        own, other = str(certificates), str(foreign)
        all_refused(
            kit,
            # Trusts our authority and shows another's certificate.
            altered(kit, "operator", lambda text: text.replace(f"{own}/operator", f"{other}/operator")),
            # Shows none.
            altered(kit, "operator", lambda text: re.sub("connect_.*|enable_mtls.*", "", text)),
            # Trusts another authority: it is the client that refuses the sim.
            altered(kit, "operator", lambda text: text.replace(f"{own}/ca.pem", f"{other}/ca.pem")),
        )


def test_stranger_at_the_router_is_refused(tmp_path: Path, certificates: Path, foreign: Path) -> None:
    with kit_of("router", tmp_path, certificates) as kit:
        own, other = str(certificates), str(foreign)

        def disguise(text: str) -> str:
            return text.replace(f"{own}/operator", f"{other}/operator").replace("timeout_ms: 5000", "timeout_ms: 2000")

        all_refused(kit, altered(kit, "operator", disguise))


@pytest.mark.slow
def test_agent_with_an_observers_credentials_ends_in_one_line(tmp_path: Path, certificates: Path) -> None:
    with kit_of("password", tmp_path, certificates) as kit:
        ended = subprocess.run(
            [COMMAND, "agent", "go home", "--connect", *kit.endpoints, "--zenoh-config", kit.folder / "observer.json5"],
            capture_output=True,
            text=True,
            timeout=120,
        )
    assert ended.returncode == EXIT_UNAVAILABLE and ended.stdout == ""
    assert len(ended.stderr.splitlines()) == 1 and "access control" in ended.stderr


# Names that are more than names.


@pytest.mark.parametrize("name", ODD_NAMES, ids=ascii)
def test_odd_names_are_refused_by_the_client(open_sim: Client, name: str) -> None:
    robot = open_sim.robot()
    with pytest.raises(InputError, match="no robot"):
        open_sim.robot(name)
    refusals: list[Callable[[], object]] = [
        lambda: robot.send(name),
        lambda: robot.result(name, str(uuid.uuid4())),
        lambda: robot.result("home", name),
        lambda: robot.picture(name),
    ]
    if name:  # an empty one is left out
        refusals.append(lambda: robot.send("home", goal_id=name))
        refusals.append(lambda: robot.picture("scene", format=name))
    for ask in refusals:
        with pytest.raises(InvalidArgumentError):
            ask()
    with pytest.raises(InputError):
        robot.load(name)
    with pytest.raises(InputError):
        robot.reset(checkpoint=name)
    assert robot.send("home").wait().skill == "home"


def raw_errors(robot: RemoteRobot, asked: str, message: dict[str, object]) -> list[str]:
    """Return the codes that a sim answers to a message on a key that a client of one's own might make up."""
    session = robot._client.session
    codes = []
    for reply in session.get(asked, payload=json.dumps(message), timeout=20.0, target=zenoh.QueryTarget.ALL):
        assert reply.err is not None, f"{asked} was answered"
        codes.append(str(json.loads(reply.err.payload.to_bytes())["code"]))
    return codes


@pytest.mark.parametrize("name", ["**", "*", "..", "a$*", "pi$*", "höme", "x" * 10_000, "home "], ids=ascii)
def test_odd_names_are_refused_by_the_sim(open_sim: Client, name: str) -> None:
    robot = open_sim.robot()
    home = f"robosandbox/{robot.id}/skill/home"
    goal = {"goal_id": str(uuid.uuid4())}
    for suffix in ("send_goal", "cancel_goal", "get_result"):
        codes = raw_errors(robot, f"robosandbox/{robot.id}/skill/{name}/{suffix}", goal)
        assert codes and set(codes) <= {"invalid_argument", "invalid_message", "unknown_goal"}
        assert raw_errors(robot, f"{home}/{suffix}", {"goal_id": name}) == ["invalid_message"]
    codes = raw_errors(robot, f"robosandbox/{robot.id}/obs/camera/{name}/rgb", {})
    assert codes and set(codes) == {"invalid_message"}
    with pytest.raises(SkillError):
        robot.result("home", goal["goal_id"])
    assert robot.send("home").wait().skill == "home"


@pytest.mark.parametrize(
    "robot_id", ["**", "*", "..", "a/b", "$*", "a#b", "a?b", "Arm", "ärm", "", "x" * 65, "arm\n"], ids=ascii
)
@pytest.mark.sample(every=4)
def test_odd_robot_ids_are_refused_at_the_start(robot_id: str) -> None:
    from robosandbox.apps.cli import app
    from robosandbox.apps.commands.console import run_app

    assert run_app(app, "robo-sandbox", ["sim", "--robot-id", robot_id]) == EXIT_USAGE


def test_watch_script_shows_an_observer_the_goals_of_others(kit: Kit) -> None:
    command = [sys.executable, EXAMPLES / "watch.py", kit.folder / "observer.json5", *kit.endpoints]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as watcher:
        try:
            assert watcher.stdout is not None and "watching robot" in watcher.stdout.readline()
            assert "robot: at" in watcher.stdout.readline()
            with enter(kit, "operator") as client:
                client.robot().send("home").wait()
                assert any("robot: home: succeeded" in line for line in watcher.stdout)
        finally:
            watcher.kill()

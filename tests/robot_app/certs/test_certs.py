"""A robot's keys, over real sessions: who is no part of it gets nothing, and who may only look moves nothing."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
import zenoh
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from drivers.clock import SimClock
from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.limits import Nav2Limits
from drivers.ports import LinkLost, NavigationStatus
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.topics import RosMap, RosPoseSource
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.topics import IS_ACTIVE, NAVIGATE_TO_POSE
from drivers.watchdog.wire import WatchdogKeys
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from robot_app.certs.certificates import Identity, issue
from robot_app.certs.folder import make_network
from robot_app.certs.zenoh import AGENT, OPERATOR, VIEWER, VIEWERS_MAX, WORKSTATION, ZenohNetwork
from robot_app.config import load_config
from robot_app.remote.messages import VERBS, operator_key
from sim_fakes.wire.fence import Fence
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.ros_publisher import SimRosPublisher
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.robot import SimRobot
from support.waiting import until

DAY_NS = 86_400 * 10**9
KEYS = WatchdogKeys(BridgeKeys())
SEND_GOAL = BridgeKeys().action(NAVIGATE_TO_POSE, "send_goal")
REFUSED = ("navigate_to_pose/_action/cancel_goal", "compute_path_to_pose/_action/send_goal", KEYS.reset)
IS_UP = BridgeKeys().service(IS_ACTIVE)
PATIENT = Nav2Limits(send_s=60.0, plan_s=60.0, result_wait_s=60.0, result_ask_s=60.0, cancel_s=60.0)  # who is answered
QUICK = Nav2Limits(send_s=0.5, plan_s=0.5, result_wait_s=0.3, result_ask_s=0.3, cancel_s=0.3)  # who never is
ANSWERED_S, REFUSED_S = 60.0, 0.5  # an answer ends its wait; a refusal is known to be none by what comes after it


class Room:
    """6 m x 4 m of free floor."""

    def occupancy_grid(self) -> OccupancyGrid:
        return OccupancyGrid(np.zeros((80, 120), np.int8), 0.05, (0.0, 0.0))


def free_ports() -> int:
    """The first of three free ports in a row."""
    for _ in range(50):
        with socket.socket() as one, socket.socket() as two, socket.socket() as three:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
            try:
                two.bind(("127.0.0.1", port + 1))
                three.bind(("127.0.0.1", port + 2))
            except OSError:
                continue
            return int(port)
    raise RuntimeError("no three free ports in a row")


def new_network(folder: Path, port: int) -> ZenohNetwork:
    network = ZenohNetwork("127.0.0.1", port, folder=str(folder / "robot"))
    make_network(folder, network, [], time.time_ns(), days=2)
    return network


class Robot:
    """The shipped bridge configuration, with the simulated Nav2 behind its loopback door."""

    def __init__(self, folder: Path, opened: ExitStack) -> None:
        self.network, self.folder = new_network(folder, free_ports()), folder
        for door in ("bridge.json5", "viewers.json5"):
            opened.enter_context(zenoh.open(zenoh.Config.from_file(str(folder / "robot" / door))))
        self.clock, self.bridge = SimClock(10**18), opened.enter_context(SimBridge(self.network.local_endpoint))
        self.body = SimRobot(Room(), self.clock, Pose2(1.0, 1.0, 0.0))
        grid = Room().occupancy_grid()
        self.nav2 = SimNav2Server(self.bridge, self.clock, self.body, grid)
        self.topics = SimRosPublisher(self.bridge, self.clock, self.body, grid)
        self._opened = opened

    def link(self, who: str) -> ZenohLink:
        """As robot.toml of that machine says."""
        config = load_config(self.folder / who / "robot.toml").zenoh
        return self._opened.enter_context(ZenohLink(LinkConfig((config.endpoint,), tls=config.tls)))

    def navigator(self, who: str, limits: Nav2Limits) -> Nav2Bridge:
        """That machine's navigator, everything started, once it sees that Nav2 is up."""
        link, uuids = self.link(who), np.random.default_rng(1)
        poses, grid = RosPoseSource(link, self.clock), RosMap(link)
        nav = Nav2Bridge(link, self.clock, poses, grid, new_uuid=lambda: uuids.bytes(16), limits=limits)
        for port in (poses, grid, nav):
            port.start()
        Fence(self.bridge, link).wait()  # or the first samples would come before the subscriptions are known
        self.nav2.start()
        self.topics.start()
        until(lambda: nav.unavailable() is None, again=lambda: self.clock.sleep(0.05))
        return nav


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    with ExitStack() as opened:
        yield Robot(tmp_path / "certs", opened)


def known(key: str, answer: bytes, link: ZenohLink) -> None:
    """Wait until the robot's queryable is known at that end and answers."""
    answers: list[tuple[bytes, ...]] = []
    until(lambda: (answer,) in answers, again=lambda: answers.append(link.get(key, b"", 5.0).payloads))


def test_the_workstation_drives_the_robot(robot: Robot) -> None:
    nav = robot.navigator(WORKSTATION, PATIENT)
    assert nav.send(Pose2(2.0, 1.0, 0.0)) is None
    robot.clock.sleep(1.0)
    assert robot.body.pose.x > 1.1
    assert nav.cancel(because="the test is over").status == NavigationStatus.CANCELED


def test_a_viewer_sees_that_nav2_is_up_and_its_goal_does_nothing_and_says_so(robot: Robot) -> None:
    nav = robot.navigator(VIEWER, QUICK)
    refused = nav.send(Pose2(2.0, 1.0, 0.0))
    assert refused is not None and refused.status in (NavigationStatus.LOST, NavigationStatus.STILL_MOVING)
    assert refused.reason
    robot.clock.sleep(1.0)
    assert robot.body.pose == Pose2(1.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("who", "may"),
    [
        (OPERATOR, {"lease", "beat", "release", "ask", "confirm", "propose", "stop", "status", "candidates", "why"}),
        (AGENT, {"propose", "stop", "status", "candidates", "why"}),
        (VIEWER, {"stop", "status", "candidates", "why"}),
    ],
)
def test_what_the_run_answers_is_heard_from_whom_it_may(robot: Robot, who: str, may: set[str]) -> None:
    run, asking = robot.link(WORKSTATION), robot.link(who)
    heard: list[str] = []

    def answering(verb: str) -> Callable[[bytes], bytes]:
        return lambda _: (heard.append(verb), b"heard")[1]

    for verb in VERBS:
        run.answer(operator_key(verb), answering(verb))
    known(operator_key("status"), b"heard", asking)
    for verb in VERBS:
        asking.get(operator_key(verb), b"{}", ANSWERED_S if verb in may else REFUSED_S)
    known(operator_key("status"), b"heard", asking)  # whatever was let through has come before this
    assert set(heard) == may


def test_nobody_but_the_workstation_answers_for_the_operator(robot: Robot) -> None:
    for who in (OPERATOR, AGENT, VIEWER):
        robot.link(who).answer(operator_key("status"), lambda _: b"an impostor")
    robot.link(WORKSTATION).answer(operator_key("status"), lambda _: b"the run")
    known(operator_key("status"), b"the run", robot.link(OPERATOR))


def test_a_viewers_cancel_plan_and_reset_are_not_even_heard(robot: Robot) -> None:
    """Refused queries are put in order by later ones that are answered: one link and one queryable keep the order."""
    heard: list[str] = []
    for key in REFUSED:
        robot.bridge.answer(key, lambda question, key=key: (heard.append(key), question.answer(b"done"))[1])
    robot.bridge.answer(IS_UP, lambda question: question.answer(b"up"))
    operator, viewer = robot.link(WORKSTATION), robot.link(VIEWER)
    for key in REFUSED:
        until(lambda key=key: key in heard, again=lambda key=key: operator.get(key, b"", REFUSED_S) and None)
    known(IS_UP, b"up", viewer)
    for key in REFUSED:
        assert operator.get(key, b"", ANSWERED_S).payloads == (b"done",)
        before = heard.count(key)
        assert viewer.get(key, b"", REFUSED_S).payloads == ()
        assert viewer.get(IS_UP, b"", ANSWERED_S).payloads == (b"up",)
        assert operator.get(key, b"", ANSWERED_S).payloads == (b"done",)
        assert heard.count(key) == before + 1  # the operator's


def test_only_the_workstations_heartbeat_is_heard(robot: Robot) -> None:
    """The viewer's are on their way before its question is answered, and `last` is sent after that: on one link."""
    beats: list[bytes] = []
    robot.bridge.answer(IS_UP, lambda question: question.answer(b"up"))
    with ZenohLink(LinkConfig((robot.network.local_endpoint,))) as onboard:
        onboard.subscribe(KEYS.heartbeat, beats.append)
        operator, viewer = robot.link(WORKSTATION), robot.link(VIEWER)
        until(lambda: bool(beats), again=lambda: operator.put(KEYS.heartbeat, b"operator"))
        known(IS_UP, b"up", viewer)
        for _ in range(20):
            viewer.put(KEYS.heartbeat, b"viewer")
        assert viewer.get(IS_UP, b"", ANSWERED_S).payloads == (b"up",)
        until(lambda: b"last" in beats, again=lambda: operator.put(KEYS.heartbeat, b"last"))
    assert set(beats) == {b"operator", b"last"}


def test_what_is_too_large_has_no_effect_and_gets_no_answer(robot: Robot) -> None:
    sizes: list[int] = []
    robot.bridge.answer(SEND_GOAL, lambda question: (sizes.append(len(question.payload)), question.answer(b"ok"))[1])
    operator = robot.link(WORKSTATION)
    known(SEND_GOAL, b"ok", operator)
    assert operator.get(SEND_GOAL, bytes(20_000), REFUSED_S).payloads == ()
    assert operator.get(SEND_GOAL, bytes(20_000_000), REFUSED_S).payloads == ()
    known(SEND_GOAL, b"ok", operator)  # the link lives on, or is there again
    assert max(sizes) <= 4


@pytest.mark.parametrize("who", [WORKSTATION, VIEWER])
def test_the_certificates_of_another_site_are_refused(robot: Robot, tmp_path: Path, who: str) -> None:
    new_network(tmp_path / "other", robot.network.port)
    theirs = load_config(tmp_path / "other" / who / "robot.toml").zenoh
    mixed = {**theirs.tls, "root_ca_certificate": str(robot.folder / "ca.pem")}
    for tls in (theirs.tls, mixed):
        with (
            pytest.raises(LinkLost, match="Nothing answers at tls/"),
            ZenohLink(LinkConfig((theirs.endpoint,), tls=tls)),
        ):
            pass


def test_no_certificate_and_no_encryption_are_refused(robot: Robot) -> None:
    trusting = {"root_ca_certificate": str(robot.folder / "ca.pem")}
    plain = robot.network.endpoint.replace("tls/", "tcp/")
    for config in (LinkConfig((robot.network.endpoint,), tls=trusting), LinkConfig((plain,))):
        with pytest.raises(LinkLost), ZenohLink(config):
            pass


def test_an_expired_certificate_of_this_very_site_is_refused(robot: Robot, tmp_path: Path) -> None:
    key = serialization.load_pem_private_key((robot.folder / "ca.key").read_bytes(), None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    authority = Identity("ca", x509.load_pem_x509_certificate((robot.folder / "ca.pem").read_bytes()), key)
    tls = {"root_ca_certificate": str(robot.folder / "ca.pem"), "enable_mtls": True}
    for name, begin_ns in (("old", time.time_ns() - 30 * DAY_NS), ("new", time.time_ns())):
        issue(authority, WORKSTATION, [], begin_ns, days=2, server=False).write(tmp_path, name)
        tls |= {
            "connect_certificate": str(tmp_path / f"{name}.pem"),
            "connect_private_key": str(tmp_path / f"{name}.key"),
        }
        link = ZenohLink(LinkConfig((robot.network.endpoint,), tls=dict(tls)))
        if name == "new":
            with link:
                assert link.alive
        else:
            with pytest.raises(LinkLost), link:
                pass


def test_viewers_take_no_place_of_the_robot_or_the_operator(robot: Robot) -> None:
    """As many viewers as their door lets in, and more: the robot's own processes and the operator still come in."""
    refused = 0
    for _ in range(VIEWERS_MAX + 2):
        try:
            robot.link(VIEWER)
        except LinkLost:
            refused += 1
    assert refused >= 1
    assert robot.link(WORKSTATION).alive
    local = robot._opened.enter_context(ZenohLink(LinkConfig((robot.network.local_endpoint,))))
    assert local.alive


def test_a_viewers_certificate_opens_no_other_door(robot: Robot) -> None:
    viewer = load_config(robot.folder / VIEWER / "robot.toml").zenoh
    with pytest.raises(LinkLost), ZenohLink(LinkConfig((robot.network.endpoint,), tls=viewer.tls)):
        pass


def test_a_session_ends_when_its_certificate_expires(robot: Robot) -> None:
    """One that is valid for six seconds more."""
    key = serialization.load_pem_private_key((robot.folder / "ca.key").read_bytes(), None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    authority = Identity("ca", x509.load_pem_x509_certificate((robot.folder / "ca.pem").read_bytes()), key)
    folder = robot.folder / "short"
    folder.mkdir()
    issue(authority, WORKSTATION, [], time.time_ns() - DAY_NS + 6 * 10**9, 1, server=False).write(folder)
    tls = dict(load_config(robot.folder / WORKSTATION / "robot.toml").zenoh.tls)
    tls |= {"connect_certificate": f"{folder}/workstation.pem", "connect_private_key": f"{folder}/workstation.key"}
    tls.pop("close_link_on_expiration")  # it is the robot that ends it
    with ZenohLink(LinkConfig((robot.network.endpoint,), tls=tls)) as link:
        assert link.alive
        until(lambda: not link.alive)

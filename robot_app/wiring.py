"""What the bodies of a robot are made of: one clock, its wires, a recording, a simulation."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from drivers.clock import SystemClock
from drivers.ports import Clock
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from logs.frames.reader import PAIR_TOLERANCE_S
from robot_app.config import Config
from robot_app.config_sections import TopicsSection
from robot_app.simulation import START_NS, Simulation, simulation
from sim_fakes.playback.ports import RecordingPorts
from sim_fakes.playback.roles import PlayedTopics


@dataclass(frozen=True)
class Wire:
    """One end of a Zenoh link: the session, the key names, the topic names and the ROS distribution behind it."""

    link: ZenohLink
    keys: BridgeKeys
    topics: TopicsSection
    distribution: str = "auto"


def nobody_stops() -> str | None:
    return None


@dataclass(frozen=True)
class Wiring:
    """What bodies are made of: the clock that all share, a wire for each kind of robot, a recording."""

    clock: Clock
    wires: dict[str, Wire]
    recording: RecordingPorts | None
    simulation: Simulation | None
    new_uuid: Callable[[], bytes]
    config: Config
    opened: ExitStack  # what a body opens closes with the robot
    stop: Callable[[], str | None] = nobody_stops  # why the operator wants the robot to stop


def open_wiring(config: Config, opened: ExitStack, stop: Callable[[], str | None]) -> Wiring:
    """The clock is the simulation's where a body is simulated (begun at the recording's start), else the wall's."""
    sim, wires, simulated, recording = config.sim, {}, None, None
    if config.ports.uses("replay") and config.replay.recording is not None:
        recording = RecordingPorts(config.replay.recording, _played(config))
    if config.ports.uses("sim"):
        start_ns = recording.start_ns if recording else START_NS
        simulated = simulation(sim.scene, seed=sim.seed, start_ns=start_ns, camera_rate_hz=sim.camera_rate_hz)
        graph = opened.enter_context(simulated.graph)
        wires["sim"] = Wire(opened.enter_context(ZenohLink(graph.link_config)), BridgeKeys(), TopicsSection())
    if config.ports.uses("ros"):
        link = opened.enter_context(ZenohLink(LinkConfig((config.zenoh.endpoint,), tls=config.zenoh.tls)))
        wires["ros"] = Wire(link, BridgeKeys(config.zenoh.namespace), config.topics, config.zenoh.distribution)
    return Wiring(
        clock=simulated.clock if simulated else SystemClock(),
        wires=wires,
        recording=recording,
        simulation=simulated,
        new_uuid=_seeded_uuids(sim.seed) if simulated else lambda: uuid.uuid4().bytes,
        config=config,
        opened=opened,
        stop=stop,
    )


def _played(config: Config) -> PlayedTopics:
    """`[topics]` and `[pairing]` hold for a replayed recording too."""
    topics, pairing = config.topics, config.pairing
    names = {name: getattr(topics, name) for name in TopicsSection.model_fields if name != "battery"}
    tolerance_s = pairing.tolerance_s if "tolerance_s" in pairing.model_fields_set else PAIR_TOLERANCE_S
    return PlayedTopics(
        **names,
        named=frozenset(topics.model_fields_set),
        pair_tolerance_s=tolerance_s,
        depth_offset_s=pairing.depth_offset_s,
        max_tf_gap_s=pairing.max_tf_gap_s,
    )


def _seeded_uuids(seed: int) -> Callable[[], bytes]:
    rng = np.random.default_rng([seed, 0x60A1])
    return lambda: rng.bytes(16)

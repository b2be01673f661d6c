"""The Zenoh session: real routers and sessions on ephemeral ports of this machine."""

from __future__ import annotations

import pytest

from drivers.ports import LinkLost, PortError
from drivers.ros.zenoh_link import LinkConfig, Replies, ZenohLink, open_router
from sim_fakes.wire.sim_bridge import SimBridge


@pytest.fixture
def ends():
    """The workstation's link and the robot's session behind one router."""
    with open_router() as endpoint, ZenohLink(LinkConfig((endpoint,))) as link, SimBridge(endpoint) as bridge:
        yield link, bridge


def test_nobody_at_the_endpoint_is_named_with_the_remedy():
    with open_router() as endpoint:
        pass
    with pytest.raises(LinkLost, match=f"{endpoint}.*zenoh-bridge-ros2dds"), ZenohLink(LinkConfig((endpoint,))):
        pass


def test_what_a_callback_raises_is_raised_again_once(ends, eventually):
    link, bridge = ends

    def fail(payload: bytes) -> None:
        raise ZeroDivisionError("of ours")

    link.subscribe("numbers", fail)
    raised = []

    def sent_and_failed() -> bool:
        bridge.put("numbers", b"0")
        try:
            link.check()
        except PortError as error:
            raised.append(error)
        return bool(raised)

    eventually(sent_and_failed)
    assert "ZeroDivisionError: of ours" in str(raised[0])


def test_a_handler_that_fails_again_and_again_is_counted_not_logged_each_time(ends, eventually, caplog):
    link, bridge = ends
    heard = []

    def fail(payload: bytes) -> None:
        heard.append(payload)
        raise ValueError("every time")

    link.subscribe("numbers", fail)
    eventually(lambda: heard, again=lambda: bridge.put("numbers", b"0"))
    already = len(heard)
    for _ in range(1000 - already):
        bridge.put("numbers", b"0")
    eventually(lambda: len(heard) >= 1000)
    lines = [record.getMessage() for record in caplog.records if "a Zenoh callback failed" in record.getMessage()]
    assert len(lines) == 10 and "(512 times so far)" in lines[-1]


def test_a_handler_that_fails_does_not_end_the_subscription(ends, eventually):
    link, bridge = ends
    heard = []

    def fail_first(payload: bytes) -> None:
        heard.append(payload)
        if len(heard) == 1:
            raise ValueError("once")

    link.subscribe("numbers", fail_first)

    def two() -> bool:
        bridge.put("numbers", b"0")
        return len(heard) >= 2

    eventually(two)


def test_a_question_to_nobody_ends_empty_and_not_by_its_time_out(ends):
    link, _ = ends
    assert link.get("nobody/here", b"", 5.0) == Replies()


def test_a_question_that_is_not_answered_ends_in_its_time(ends, eventually):
    link, bridge = ends
    kept = []
    bridge.answer("slow", kept.append)
    eventually(lambda: link.get("slow", b"", 0.2) == Replies(errors=("Timeout",)))
    assert kept


def test_a_question_under_way_ends_when_the_other_end_dies(ends, eventually):
    link, bridge = ends
    kept, ended = [], []
    bridge.answer("slow", kept.append)
    eventually(lambda: bool(link.get("slow", b"", 0.1).errors))
    link.get_later("slow", b"", 30.0, ended.append)
    eventually(lambda: len(kept) >= 2)
    bridge.close()
    eventually(lambda: bool(ended))
    assert ended == [Replies()]


def test_tokens_that_were_there_first_are_told_and_their_end_too(ends, eventually):
    from drivers.topics import NAVIGATE_TO_POSE

    link, bridge = ends
    bridge.offer(NAVIGATE_TO_POSE)
    told = []
    link.watch_tokens(bridge.keys.action_token(NAVIGATE_TO_POSE), lambda token, there: told.append(there))
    eventually(lambda: told == [True])
    bridge.close()
    eventually(lambda: told == [True, False])


def test_a_message_larger_than_the_link_allows_never_arrives(eventually):
    with open_router() as endpoint, SimBridge(endpoint) as bridge:
        small = LinkConfig((endpoint,), max_message_bytes=100_000)
        with ZenohLink(small) as link:
            heard = []
            link.subscribe("blob", lambda payload: heard.append(len(payload)))

            def small_one_arrives() -> bool:
                bridge.put("blob", bytes(1000))
                return 1000 in heard

            eventually(small_one_arrives)
            bridge.put("blob", bytes(1_000_000))
            eventually(lambda: not link.alive or small_one_arrives())
            assert 1_000_000 not in heard


def test_a_closed_link_says_so(ends):
    link, _ = ends
    link.close()
    assert not link.alive
    with pytest.raises(LinkLost, match="closed"):
        link.get("anything", b"", 1.0)


def test_tls_settings_reach_zenoh():
    config = LinkConfig(("tls/robot:7447",), tls={"enable_mtls": True, "root_ca_certificate": "ca.pem"}).zenoh()
    assert '"enable_mtls":true' in config.get_json("transport/link/tls").replace(" ", "")


def test_a_client_never_scouts_and_never_listens():
    config = LinkConfig(("tcp/127.0.0.1:7447",)).zenoh()
    assert config.get_json("scouting/multicast/enabled") == "false"
    assert config.get_json("listen/endpoints").strip() in ("[]", '{"client":[]}')

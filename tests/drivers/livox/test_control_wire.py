"""Control frames: the golden frames of the reference, both ways, and every bit guarded."""

from __future__ import annotations

import pytest

from drivers.livox import control_wire
from drivers.livox.control_wire import CommandId, ControlFrame, Found
from drivers.livox.wire import LivoxWireError, PacketRefusal
from support import livox_host

FOUND = Found(9, "3JEDK8A0010123", "192.168.1.150", 56100)
GOLDEN = {
    "aa0018000100000000000000000000000000a91f00000000": livox_host.search_request(1),
    "aa002100020000000001000000000000000096a56fd5e7ad010000001a00010001": control_wire.set_request(2, {0x1A: b"\x01"}),
    "aa0020000300000001010000000000000000961932e7d07d0200000000800680": livox_host.get_request(3, [0x8000, 0x8006]),
}
EVERY_KIND = [
    *GOLDEN.values(),
    control_wire.search_ack(4, FOUND),
    control_wire.set_ack(5, 0x22, 0x8006),
    control_wire.get_ack(6, 0, {0x8006: b"\x01"}),
    control_wire.push_request(7, {0x8011: bytes(32), 0x8007: b"\xad\x11\0\0"}),
]


@pytest.mark.parametrize(("golden", "frame"), GOLDEN.items())
def test_golden_frames_encode_and_decode(golden: str, frame: ControlFrame) -> None:
    assert control_wire.encode(frame).hex() == golden
    assert control_wire.decode(bytes.fromhex(golden)) == frame


@pytest.mark.parametrize("frame", EVERY_KIND)
def test_every_kind_of_frame_comes_back_as_it_went(frame: ControlFrame) -> None:
    assert control_wire.decode(control_wire.encode(frame)) == frame


@pytest.mark.parametrize("frame", EVERY_KIND)
def test_no_flipped_bit_is_accepted(frame: ControlFrame) -> None:
    good = control_wire.encode(frame)
    for bit in range(8 * len(good)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        with pytest.raises(LivoxWireError):
            control_wire.decode(bytes(bad))


@pytest.mark.parametrize("frame", EVERY_KIND)
def test_no_truncation_is_accepted(frame: ControlFrame) -> None:
    good = control_wire.encode(frame)
    for length in range(len(good)):
        with pytest.raises(LivoxWireError):
            control_wire.decode(good[:length])


def test_the_contents_of_each_ack_are_read() -> None:
    assert livox_host.parse_search_ack(control_wire.search_ack(1, FOUND).data) == FOUND
    assert control_wire.parse_set_ack(control_wire.set_ack(1, 3, 0x1A).data) == (3, 0x1A)
    assert livox_host.parse_get_ack(control_wire.get_ack(1, 0, {1: b"ab", 2: b""}).data) == (0, {1: b"ab", 2: b""})
    assert control_wire.parse_get_request(livox_host.get_request(1, [5, 0x8011]).data) == [5, 0x8011]
    assert control_wire.parse_endpoint(control_wire.endpoint("10.0.0.7", 56301, 56300)) == ("10.0.0.7", 56301, 56300)


@pytest.mark.parametrize(
    "data",
    [b"", b"\x01\0\0", b"\x02\0\0\0\x1a\0\x01\0\x01", b"\x01\0\0\0\x1a\0\x09\0\x01", b"\x01\0\0\0\x1a\0\x01\0\x01\x02"],
    ids=["empty", "short", "a key missing", "a value cut off", "a rest"],
)
def test_a_key_list_that_does_not_add_up_is_refused(data: bytes) -> None:
    with pytest.raises(LivoxWireError):
        control_wire.parse_values(data)


def test_a_frame_of_an_unknown_sender_is_refused() -> None:
    strange = control_wire.encode(ControlFrame(1, CommandId.GET)._replace(from_lidar=2))  # type: ignore[arg-type]
    with pytest.raises(LivoxWireError) as refused:
        control_wire.decode(strange)
    assert refused.value.refusal is PacketRefusal.TYPE


def test_more_data_than_a_frame_can_carry_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 1400"):
        control_wire.encode(ControlFrame(1, CommandId.SET, bytes(1401)))

"""The watch over outputs, on traces as QEMU writes them; and the device tree without a node."""

from tests.pi.computer import NOTE, PWM, without
from tests.pi.watch import Sent, Trace, Watch

FULL_OFF = Sent(PWM, b"\xfd\x10")
DUTY = Sent(PWM, b"\x06\x00\x00\x00\x04")
"""Output 0 at a quarter."""


def traced(address: int, content: bytes) -> bytes:
    sent = "".join(f"i2c_send send(addr:0x{address:02x}) data:0x{byte:02x}\n" for byte in content)
    event = "i2c_event {}(addr:0x{:02x})\n"
    return (event.format("start", address) + sent + event.format("finish", address)).encode()


def test_messages_are_found_in_a_trace_that_comes_in_pieces() -> None:
    whole = traced(PWM, b"\x00") + traced(PWM, FULL_OFF.message) + traced(NOTE, b"\x00\x01")
    for cut in range(len(whole)):
        trace = Trace()
        found = [*trace.messages(whole[:cut]), *trace.messages(whole[cut:])]
        assert found == [FULL_OFF, Sent(NOTE, b"\x00\x01")]


def test_outputs_that_stay_off_are_no_fault() -> None:
    watch = Watch()
    watch.take(FULL_OFF, {"thrust_pairs": 0})
    watch.may_drive = True
    watch.take(DUTY, {"thrust_pairs": 1})
    watch.take(FULL_OFF, {"thrust_pairs": 0})
    assert watch.line().startswith("ok ")


def test_a_duty_while_no_output_may_be_on_is_a_fault_also_of_a_chip_that_sleeps() -> None:
    watch = Watch()
    watch.take(DUTY, {"thrust_pairs": 0})
    assert watch.line().startswith("FAILED ")


def test_an_output_that_is_on_while_none_may_is_a_fault_whatever_was_sent() -> None:
    watch = Watch()
    watch.take(Sent(0x58, b"\x00\xff"), {"treads": 1})
    watch.take(Sent(0x58, b"\x00\x80"), {"treads": 0})
    assert watch.line().startswith("FAILED ")


def test_an_output_that_is_left_on_is_a_fault() -> None:
    watch = Watch()
    watch.take(FULL_OFF, {"thrust_pairs": 0})
    watch.may_drive = True
    watch.take(DUTY, {"thrust_pairs": 1})
    assert watch.line().startswith("FAILED ")


def test_nothing_seen_is_no_proof() -> None:
    assert Watch().line().startswith("FAILED ")


def test_a_node_of_a_device_tree_is_taken_out_with_what_is_in_it() -> None:
    begin, end, nop = (number.to_bytes(4, "big") for number in (1, 2, 4))
    prop = b"\0\0\0\3" + b"\0\0\0\5" + b"\0\0\0\7" + b"ab\0c\2\0\0\0"
    inner = begin + b"clock\0\0\0" + prop + end
    node = begin + b"bluetooth\0\0\0" + prop + inner + end
    tree = begin + bytes(4) + node + inner + end
    assert without(tree, "bluetooth") == begin + bytes(4) + nop * (len(node) // 4) + inner + end

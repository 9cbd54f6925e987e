"""What a unit makes of a signal is no result."""

import os
import signal
import threading

import pytest

from etc_engine.durable.stop import Stopped, StopRequest, signals_held_back


def swallows() -> str:
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except BaseException:
        return "half a result"
    return "no signal"


def turns_into_an_error() -> str:
    """As compiled code does."""
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except BaseException:
        raise SystemError("returned a result with an exception set") from None
    return "no signal"


@pytest.mark.parametrize("unit", [swallows, turns_into_an_error])
def test_a_unit_that_a_signal_met_leaves_no_result(unit):
    with StopRequest() as stop:
        with pytest.raises(Stopped):
            stop.run(unit)
        assert stop.reason == "SIGTERM"
        with pytest.raises(Stopped):
            stop.run(lambda: "never begun")


def test_errors_and_results_pass_without_a_signal():
    with StopRequest() as stop:
        assert stop.run(lambda: 7) == 7
        with pytest.raises(ZeroDivisionError):
            stop.run(lambda: 1 // 0)
        assert stop.reason == ""


def test_between_units_a_signal_is_noted():
    with StopRequest() as stop:
        assert stop.run(lambda: 7) == 7
        os.kill(os.getpid(), signal.SIGTERM)
        with pytest.raises(Stopped):
            stop.run(lambda: 8)


def test_a_signal_before_anybody_listens_stops_the_first_unit():
    with signals_held_back():
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)  # pytest has threads that do not hold it back
        with StopRequest() as stop, pytest.raises(Stopped):
            stop.run(lambda: "begun")
        assert stop.reason == "SIGTERM"
    assert signal.SIGTERM not in signal.pthread_sigmask(signal.SIG_BLOCK, [])

"""One behaviour, several clients: every scenario is played to each of them.

    PYTHONPATH=client/python/src MESHSMOOTH_CLI=build/release/client/meshsmooth \\
        python3 -m pytest tests/conformance
"""

from __future__ import annotations

import pathlib

import pytest

from players import PLAYERS, SESSIONS, Outcome
from scenario import NAMES, Scenario, expected_result
from scripted_server import mock_server


@pytest.mark.parametrize("player", PLAYERS)
@pytest.mark.parametrize("name", NAMES)
def test_scenario(name: str, player: str, tmp_path: pathlib.Path) -> None:
    scenario = Scenario(name, tmp_path)
    # The examples that have sessions of the C++ client make their own meshes.
    scenario.own_mesh = player == "cpp" and scenario.client["call"] in SESSIONS
    with mock_server(scenario.server_count) as mock:
        scenario.install(mock)
        outcome = PLAYERS[player](scenario, mock.address, tmp_path)
    known = scenario.xfail.get(player)
    try:
        scenario.check()
        check_outcome(scenario, player, outcome)
    except AssertionError:
        if known:
            pytest.xfail(known)
        raise
    assert not known, f"{player} now behaves as expected: remove xfail ({known})"


def check_outcome(scenario: Scenario, player: str, outcome: Outcome) -> None:
    """Fails unless the user sees what the scenario promises."""
    expected = scenario.outcome.get("error")
    if expected is None:
        exit_code = scenario.outcome.get("exit_code", "") if player == "cpp" else ""
        assert outcome.kind == exit_code, outcome.message
        if player != "cpp":  # whose program says less under --quiet
            assert scenario.outcome.get("warning", "") in outcome.message
        if outcome.result is not None:
            assert outcome.result.tobytes() == expected_result(scenario.points).tobytes()
        return
    assert outcome.kind == expected["exit_code" if player == "cpp" else "class"], outcome
    assert outcome.reason == expected["reason"]
    assert expected.get("text", "") in outcome.message

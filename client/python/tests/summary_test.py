"""Summaries as text, HTML, JSON and tables; displays of progress."""

from __future__ import annotations

import dataclasses
import json
import xml.etree.ElementTree
from typing import Any

import pytest
from conftest import cube, run_cli
from meshes import Case

import meshsmooth as ms
from meshsmooth import _progress, _report


@pytest.fixture(scope="module")
def summary(request: pytest.FixtureRequest) -> ms.Summary:
    client: ms.Client = request.getfixturevalue("client")
    return client.smooth(cube(), full=True).summary


def test_text_fits_one_screen(summary: ms.Summary) -> None:
    lines = str(summary).splitlines()
    assert len(lines) <= 24
    assert lines[0].startswith("converged after ")
    assert any(line.startswith("  mean ratio") for line in lines)


def test_text_has_the_command_lines_figures(summary: ms.Summary, tmp_path: Any) -> None:
    points, cells = cube()
    rows = [("tetra", tuple(map(int, row))) for row in cells["tetra"]]
    Case(points, rows).write_vtk(tmp_path / "in.vtk")
    done = run_cli("smooth", tmp_path / "in.vtk", "-o", tmp_path / "out.vtk")
    theirs = [line.split() for line in done.stdout.splitlines() if line.startswith("  ")]
    ours = [line.split() for line in str(summary).splitlines() if line.startswith("  ")]
    for cells_of_line in (line[-2:] for line in theirs if line[-1].replace(".", "").isdigit()):
        assert any(line[-2:] == cells_of_line for line in ours), cells_of_line


def test_values_are_plain(summary: ms.Summary) -> None:
    values = json.loads(summary.to_json())
    assert values == summary.to_dict()
    assert values["quality_after"]["metrics"][0]["metric"] == "mean_ratio"
    with pytest.raises(dataclasses.FrozenInstanceError):
        summary.stop_reason = "other"  # type: ignore[misc]


def test_html_is_well_formed_and_static(summary: ms.Summary) -> None:
    for text in (summary._repr_html_(), summary.quality_before._repr_html_()):
        tree = xml.etree.ElementTree.fromstring(f"<div>{text}</div>")
        tags = {element.tag.rpartition("}")[2] for element in tree.iter()}
        assert "script" not in tags
        assert {"svg", "polygon", "table"} <= tags


def test_table_of_pandas(summary: ms.Summary) -> None:
    pytest.importorskip("pandas", reason="missing package: pandas")
    table = summary.to_pandas()
    before = summary.quality_before.metric("mean_ratio")
    assert before is not None
    assert table.loc["mean_ratio", ("before", "min")] == before.min


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(2e-6, "2 us"), (0.0123, "12.3 ms"), (1.5, "1.5 s"), (125.0, "2 min 05 s")],
)
def test_times_read_well(seconds: float, text: str) -> None:
    assert _report.seconds_text(seconds) == text


def test_histogram_shows_what_is_not_empty() -> None:
    assert _report.draw_histogram((0, 1, 1000)) == " ▁█"
    assert _report.draw_histogram(()) == ""


def test_progress_of_every_display(capsys: pytest.CaptureFixture[str]) -> None:
    report = ms.Progress(state="running", stage="iterate", iteration=3, max_displacement=0.5)
    assert str(report) == "iteration 3, largest move 0.5"
    assert str(ms.Progress(state="queued", queue_position=2)) == "queued at position 2"
    plain = _progress._Plain()
    plain(report)
    plain.close()
    assert capsys.readouterr().err == "meshsmooth: iteration 3, largest move 0.5\n"
    assert _progress.make_display(False) is None
    assert isinstance(_progress.make_display(True), _progress._Plain)  # this is no terminal


@pytest.mark.parametrize("alone", [True, False])
def test_display_on_a_terminal(monkeypatch: pytest.MonkeyPatch, alone: bool) -> None:
    pytest.importorskip("rich", reason="missing package: rich")
    pytest.importorskip("tqdm", reason="missing package: tqdm")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    display = _progress.make_display(True, alone=alone)
    assert isinstance(display, _progress._Rich if alone else _progress._Tqdm)
    display(ms.Progress(state="running", stage="iterate", iteration=3))
    display.close()


def test_display_that_cannot_show_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    for name in ("_Rich", "_Tqdm"):
        monkeypatch.setattr(_progress, name, lambda: 1 / 0)
    assert isinstance(_progress.make_display(True), _progress._Plain)


@pytest.mark.parametrize("package", ["rich", "tqdm"])
def test_progress_of_a_package(package: str) -> None:
    pytest.importorskip(package, reason=f"missing package: {package}")
    display = _progress._Rich() if package == "rich" else _progress._Tqdm()
    display(ms.Progress(state="running", stage="iterate", iteration=3))
    display.close()


def test_progress_true_runs(client: ms.Client) -> None:
    client.smooth(cube(), progress=True)

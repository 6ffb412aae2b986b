"""Simulation, replay, fit and diagnosis from Python, against the command and against each other."""

import ast
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
from tqdm import TqdmWarning

import bowden

PAGE = Path(__file__).resolve().parents[2] / "docs/python.md"


def test_the_first_example_of_the_page_gives_what_its_comments_say(play, tmp_path, monkeypatch):
    example = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
    for name, here in (("train.csv", "train.csv"), ("rig.toml", "rig.toml"), ("heldout.csv", "other.csv")):
        shutil.copy(play / name, tmp_path / here)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    values, comments = [], []
    with warnings.catch_warnings():
        # Outside a notebook tqdm.auto takes the bar for terminals and says that ipywidgets could be there.
        warnings.simplefilter("ignore", TqdmWarning)
        for statement in ast.parse(example).body:
            if isinstance(statement, ast.Expr):
                values.append(eval(compile(ast.Expression(statement.value), str(PAGE), "eval"), names))
                comments.append(example.splitlines()[statement.lineno - 1].partition("# ")[2])
            else:
                exec(compile(ast.Module([statement], []), str(PAGE), "exec"), names)
    verdict, (effect, probability), gap, report, angle, picture = values
    said, (said_effect, said_probability) = (ast.literal_eval(comment) for comment in comments[:2])
    assert (verdict, effect) == (said, said_effect) and probability == pytest.approx(said_probability, abs=5e-4)
    assert isinstance(gap, bowden.Estimate) and f'unit="{gap.unit}"' in comments[2] and gap.value > 0.0
    assert report.read_text().startswith("<!DOCTYPE html>") and picture.axes
    assert angle.shape == (len(bowden.Recording.load("other.csv")),)


def test_python_and_shell_get_the_same_diagnosis(play, play_diagnosis, bowden_command, tmp_path):
    files = [play / "train.csv", "--rig", play / "rig.toml", "--heldout", play / "heldout.csv"]
    subprocess.run([bowden_command, "diagnose", *files, "--out", tmp_path / "shell", "--quiet"], check=True, stdout=subprocess.DEVNULL)
    d = play_diagnosis
    assert d.save(tmp_path / "python") == tmp_path / "python/report.html"
    written = sorted(path.name for path in (tmp_path / "shell").iterdir())
    assert written == sorted(path.name for path in (tmp_path / "python").iterdir())
    for name in written:
        assert (tmp_path / "shell" / name).read_bytes() == (tmp_path / "python" / name).read_bytes(), name
    assert (d.verdict, d.effects[0].id, d.complete) == ("missing_physics", "joint_backlash", True)
    said = json.loads((tmp_path / "shell/diagnosis.json").read_text())
    assert d.to_dict() == said
    assert d.effects[0].parameters["gap_rad"].value == said["effects"][0]["parameters"]["gap_rad"]["value"]
    assert d.channels["theta_out_rad"].after_rmse < 0.5 * d.channels["theta_out_rad"].before_rmse
    assert d.rig["effects.joint_backlash.gap_rad"] == d.effects[0].parameters["gap_rad"].value
    assert d.report(tmp_path / "again.html").read_bytes() == (tmp_path / "shell/report.html").read_bytes()


def test_a_report_that_cannot_be_written_is_refused_in_one_line_and_leaves_nothing(play_diagnosis, tmp_path):
    missing = tmp_path / "none/report.html"
    with pytest.raises(bowden.InputError) as raised:
        play_diagnosis.report(missing)
    assert str(raised.value) == f"{missing}: folder {missing.parent} does not exist; create it first"
    assert (raised.value.file, raised.value.hint) == (str(missing), "create it first")
    with pytest.raises(bowden.InputError, match="is a folder, expected a file name"):
        play_diagnosis.report(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_play_is_found_and_the_diagnosed_rig_replays_a_recording_better(play, play_diagnosis):
    d = play_diagnosis
    assert [effect.id for effect in d.effects] == ["joint_backlash"]
    assert d.effects[0].probability > 0.9
    measured = bowden.Recording.load(play / "heldout.csv")
    before, after = (bowden.replay(measured, rig) for rig in (play / "rig.toml", d.rig))
    rms = [float(np.sqrt(np.mean((measured["theta_out_rad"] - of["theta_out_rad"]) ** 2))) for of in (before, after)]
    assert rms[1] < 0.5 * rms[0]
    assert d.traces["theta_out_rad"].measured.shape == d.traces["theta_out_rad"].t_s.shape


def test_a_fit_finds_the_friction_that_was_simulated(recording, rig):
    fitted = bowden.fit(recording.to_pandas(), rig, progress=False)
    friction = {parameter.parameter: parameter for parameter in fitted.parameters}["sheath.friction_coefficient"]
    assert friction.nominal == rig["sheath.friction_coefficient"]
    assert friction.fitted == pytest.approx(0.15, rel=0.03)
    assert fitted.rig["sheath.friction_coefficient"] == friction.fitted
    assert all(channel.after_rmse <= channel.before_rmse * 1.01 for channel in fitted.channels if channel.unit == "N")


def test_a_simulation_follows_its_arguments(rig):
    one, same, other = (bowden.simulate(rig, motion="sine", seconds=2.0, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one["f1_n"], same["f1_n"]) and not np.array_equal(one["f1_n"], other["f1_n"])
    t_s = np.linspace(0.0, 3.0, 301)
    along = bowden.simulate(rig, reference=(t_s, 0.2 * np.sin(t_s) ** 2), rate_hz=100.0)
    assert along["theta_ref_rad"] == pytest.approx(0.2 * np.sin(along.t_s) ** 2, abs=1e-4)
    for wrong in ({"seconds": 0.0}, {"rate_hz": 1e9}, {"seed": -1}, {"motion": "dance"}):
        with pytest.raises(bowden.InputError):
            bowden.simulate(rig, **wrong)


def test_a_study_made_in_python_equals_the_one_of_a_file(servo):
    listed = bowden.Study.load(servo)
    made = bowden.Study(listed.name)
    made.add_bench("xl330", listed.benches["xl330"])
    gains = {"kp100": None, "kp200": 0.575476, "kp400": 1.150951, "kp800": 2.301902}
    for one in listed.recordings:
        gain = next(value for name, value in gains.items() if name in one.recording.source)
        changed = {} if gain is None else {"controller.gain_duty_per_rad": gain}
        made.add_recording(one.recording.source, heldout=one.heldout, set=changed)
    one, other = (bowden.fit(study, progress=False) for study in (listed, made))
    assert one == other
    assert {parameter.parameter for parameter in one.parameters} >= {"load.mass_kg"}


def test_mistakes_in_what_is_asked_for_are_refused(recording, rig, servo):
    study = bowden.Study("two")
    study.add_bench("left", rig)
    study.add_bench("right", rig)
    for wrong in (
        lambda: bowden.diagnose(recording),
        lambda: bowden.diagnose(recording, rig, heldout=recording),
        lambda: bowden.diagnose(servo, rig),
        lambda: bowden.diagnose(7, rig),
        lambda: bowden.diagnose([7], rig),
        lambda: bowden.diagnose(recording, rig, jobs=0),
        lambda: study.add_recording(recording),
        lambda: study.add_recording(recording, bench="third"),
        lambda: bowden.diagnose(study),
        lambda: bowden.Study.load(servo).add_bench("x", rig),
    ):
        with pytest.raises((bowden.InputError, TypeError)) as raised:
            wrong()
        assert str(raised.value)


def test_repaired_recordings_are_warned_of(recording, rig):
    arrays = {name: values.copy() for name, values in recording.to_arrays().items()}
    arrays["theta_out_rad"][1500] += 1.0
    with pytest.warns(bowden.RepairedWarning, match="set aside"):
        bowden.fit(arrays, rig, progress=False)


def test_ctrl_c_ends_a_diagnosis_with_what_there_is(play):
    stages = []

    def watch(stage: str, done: int, steps: int) -> None:
        # Noted first: the signal may end this call.
        stages.append(stage)
        if stage == "fitting effects" and stages.count(stage) == 1:
            # From another thread, as a terminal would: the main thread waits for the work.
            threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGINT)).start()

    with pytest.warns(bowden.StoppedEarlyWarning):
        d = bowden.diagnose(play / "train.csv", play / "rig.toml", progress=watch)
    assert not d.complete and d.verdict and d.rig.text
    assert "screening effects" in stages


def test_ctrl_c_ends_a_fit_before_its_last_stage(play):
    stages = []

    def watch(stage: str, done: int, steps: int) -> None:
        stages.append(stage)
        if len(stages) == 1:
            threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGINT)).start()

    with pytest.raises(KeyboardInterrupt):
        bowden.fit(play / "train.csv", play / "rig.toml", progress=watch)
    assert set(stages) == {"recalibrating"}


def test_ctrl_c_ends_a_simulation_and_a_replay(rig):
    # Ten hours, and a recording of 25 minutes: both take far longer than the signal.
    t_s = np.arange(1_500_000) / 1000.0
    driven = {"t_s": t_s, "theta_in_rad": 0.3 * np.sin(t_s), "duty": 0.1 * np.cos(t_s), "bus_v": np.full_like(t_s, 24.0)}
    driven["theta_out_rad"] = 0.2 * np.sin(t_s)
    long = bowden.Recording.from_arrays(driven)
    for work in (lambda: bowden.simulate(rig, seconds=36_000.0, rate_hz=1.0), lambda: bowden.replay(long, rig)):
        signalling = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
        over = False
        with pytest.raises(KeyboardInterrupt):
            signalling.start()
            work()
            over = True
            signalling.join()
        assert not over


def test_an_exception_in_a_watcher_ends_the_work_and_is_raised(play):
    def watch(stage: str, done: int, steps: int) -> None:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        bowden.diagnose(play / "train.csv", play / "rig.toml", progress=watch)


def test_other_threads_go_on_while_work_runs(play):
    counted, over = [0], threading.Event()

    def count() -> None:
        while not over.wait(0.001):
            counted[0] += 1

    calls = []

    def watch(stage: str, done: int, steps: int) -> None:
        begun = counted[0]
        calls.append((begun, counted[0]))

    thread = threading.Thread(target=count)
    thread.start()
    try:
        bowden.fit(play / "train.csv", play / "rig.toml", progress=watch)
    finally:
        over.set()
        thread.join()
    # From the end of one call to the begin of the next. A lock that is not released is handed over once, where the next call begins: one
    # turn of the other thread.
    turns = [after[0] - before[1] for before, after in itertools.pairwise(calls)]
    assert max(turns) > 10, turns


def test_progress_shows_a_bar_and_no_progress_shows_nothing(recording, rig, capfd):
    bowden.fit(recording, rig, progress=False)
    assert capfd.readouterr().err == ""
    with warnings.catch_warnings():
        # Outside a notebook tqdm.auto takes the bar for terminals and says that ipywidgets could be there.
        warnings.simplefilter("ignore")
        bowden.diagnose(recording, rig, progress=True)
    assert "%" in capfd.readouterr().err

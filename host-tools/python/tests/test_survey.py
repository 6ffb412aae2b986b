"""Surveys from Python, against the command and on a Ray cluster of which a worker dies."""

import os
import signal
import subprocess
import threading
import warnings
from pathlib import Path

import polars
import pytest

import bowden


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, rig) -> Path:
    """Two benches with two recordings each, one of them damaged."""
    folder = tmp_path_factory.mktemp("recordings")
    rig.save(folder / "bench.toml")
    for seed, (bench, pretension_n) in enumerate((("a", 30.0), ("a", 24.0), ("b", 30.0))):
        (folder / bench).mkdir(exist_ok=True)
        real = rig.with_values({"tendon.pretension_n": pretension_n})
        bowden.simulate(real, motion="multisine", seconds=4.0, rate_hz=250.0, seed=seed).save(folder / bench / f"run-{seed}.csv")
    (folder / "b" / "run-9.csv").write_text("t_s,duty\n0,0\n0,0.5\n")
    return folder


@pytest.fixture(scope="module")
def single(folder, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("single")
    with pytest.warns(bowden.RepairedWarning, match="run-9.csv failed: .*:3: column `t_s`"):
        found = bowden.survey(folder, rig=folder / "bench.toml", out=out, progress=False)
    assert (found.diagnosed, found.kept, found.left, list(found.failed)) == (3, 0, 0, ["b/run-9.csv"])
    table = polars.read_parquet(found.tables["recordings"])
    assert table["status"].to_list() == ["done", "done", "done", "failed"]
    assert table["verdict"].to_list()[1] == "recalibrate"
    assert found.page.read_text().count("<article") == 2
    return out


def test_python_and_shell_get_the_same_survey(folder, single, bowden_command, tmp_path):
    command = [bowden_command, "survey", folder, "--rig", folder / "bench.toml", "--out", tmp_path, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 3 and "b/run-9.csv failed: " in done.stderr, done.stderr
    assert _contents(tmp_path) == _contents(single)


def test_what_is_done_is_kept(folder, single):
    before = _contents(single)
    with pytest.warns(bowden.RepairedWarning):
        found = bowden.survey(folder, rig={"a": folder / "bench.toml", "b": folder / "bench.toml"}, out=single, progress=False)
    assert (found.diagnosed, found.kept) == (0, 3)
    assert _contents(single) == before


def test_ctrl_c_leaves_recordings_and_the_same_call_goes_on_with_them(folder, single, tmp_path):
    sent = []

    def watch(stage: str, done: int, steps: int) -> None:
        if done == 1 and not sent:
            sent.append(done)
            # From another thread, as a terminal would: the main thread waits for the work.
            threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGINT)).start()

    def survey(progress) -> bowden.Survey:
        return bowden.survey(folder, rig=folder / "bench.toml", out=tmp_path, progress=progress, jobs=1)

    with pytest.warns(bowden.StoppedEarlyWarning, match="stopped early: 3 recordings are left; the same call goes on with them"):
        found = survey(watch)
    assert (found.diagnosed, found.kept, found.left, found.failed) == (1, 0, 3, {})
    assert polars.read_parquet(found.tables["recordings"])["status"].to_list() == ["done", "left", "left", "left"]
    with pytest.warns(bowden.RepairedWarning, match="run-9.csv failed"):
        found = survey(False)
    assert (found.diagnosed, found.kept, found.left, list(found.failed)) == (2, 1, 0, ["b/run-9.csv"])
    assert _contents(tmp_path) == _contents(single)


def test_what_cannot_be_a_survey_is_refused(folder, tmp_path):
    for wrong in (
        lambda: bowden.survey(folder / "nowhere", out=tmp_path / "out"),
        lambda: bowden.survey(folder, rig={"c": folder / "bench.toml"}, out=tmp_path / "out"),
        lambda: bowden.survey(folder, rig=folder / "none.toml", out=tmp_path / "out"),
        lambda: bowden.survey(folder, out=tmp_path / "out", progress=False),
        lambda: bowden.survey(folder, out=tmp_path / "out", engine="abacus"),
    ):
        with pytest.raises(bowden.InputError):
            wrong()


def test_a_worker_of_a_cluster_that_dies_loses_nothing(folder, single, tmp_path):
    ray = pytest.importorskip("ray", reason="skipped: Ray is not installed; pip install ray into the environment of the tests")
    import psutil

    killed: list[int] = []
    followed: list[tuple[int, int]] = []

    def kill_one(stage: str, done: int, steps: int) -> None:
        table = tmp_path / "recordings.parquet"
        status = polars.read_parquet(table)["status"].to_list() if table.exists() else ["left"] * steps
        followed.append((done, steps - status.count("left")))
        # Of this process: another one of the machine may use Ray, too.
        own = {child.pid for child in psutil.Process().children(recursive=True)}
        named = [one for one in psutil.process_iter(["cmdline"]) if (one.info["cmdline"] or [""])[0].startswith("ray::_one")]
        workers = [one for one in named if one.pid in own]
        if workers and not killed:
            killed.append(workers[0].pid)
            workers[0].send_signal(signal.SIGKILL)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        try:
            found = bowden.survey(folder, rig=folder / "bench.toml", out=tmp_path, engine="ray", progress=kill_one)
        finally:
            ray.shutdown()
    assert len(killed) == 1
    # Without a result nothing is written: the damaged recording may be the first that ends.
    assert followed in ([(1, 1), (2, 2), (3, 3), (4, 4)], [(1, 0), (2, 2), (3, 3), (4, 4)])
    assert (found.diagnosed, found.left, list(found.failed)) == (3, 0, ["b/run-9.csv"])
    assert _contents(tmp_path) == _contents(single)


def test_without_ray_the_engine_says_what_to_install(folder, monkeypatch, tmp_path):
    import sys

    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(bowden.InputError, match="pip install ray"):
        bowden.survey(folder, rig=folder / "bench.toml", out=tmp_path, engine="ray", progress=False)

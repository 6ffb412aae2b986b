"""Surveys from Python, against the command and on a Ray cluster of which a worker dies."""

import os
import signal
import subprocess
import sys
import threading
import time
import types
import warnings
from collections import Counter
from pathlib import Path

import polars
import pytest

import bowden
from bowden import on_ray


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def _messages(survey: Path) -> dict[str, str]:
    """Recordings of a survey that failed, and why, from its table."""
    failed = polars.read_parquet(survey / "recordings.parquet").filter(polars.col("status") == "failed")
    return dict(zip(failed["recording"], failed["message"], strict=True))


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


def _start(ray) -> None:
    """Ray gives itself 30 s to start, which nothing sets otherwise; beside other work the first start on a machine may take longer."""
    for attempts_left in (2, 1, 0):
        try:
            ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
            return
        except Exception as error:
            ray.shutdown()
            if attempts_left == 0 or "timed out during startup" not in str(error):
                raise


@pytest.fixture(scope="module")
def cluster():
    """Two workers on this machine for all tests that need them, because Ray starts slowly."""
    ray = pytest.importorskip("ray", reason="skipped: Ray is not installed; pip install -r requirements.txt into the environment of the tests")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _start(ray)
    yield
    ray.shutdown()


def _survey_on_ray(folder: Path, out: Path, progress: bowden.ProgressLike = False) -> bowden.Survey:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return bowden.survey(folder, rig=folder / "bench.toml", out=out, engine="ray", progress=progress)


def test_tables_and_page_follow_while_a_cluster_works(folder, single, cluster, tmp_path):
    read: list[tuple[int, int, bool]] = []

    def watch(stage: str, done: int, steps: int) -> None:
        table = tmp_path / "recordings.parquet"
        status = polars.read_parquet(table)["status"].to_list() if table.exists() else ["left"] * steps
        read.append((done, steps - status.count("left"), (tmp_path / "survey.html").exists()))

    _survey_on_ray(folder, tmp_path, watch)
    # Without any result there is nothing to write, and the damaged recording may be the first that ends.
    assert read[0] in ((1, 1, True), (1, 0, False))
    assert read[1:] == [(2, 2, True), (3, 3, True), (4, 4, True)]
    assert _contents(tmp_path) == _contents(single)


def test_a_worker_of_a_cluster_that_dies_loses_nothing(folder, single, cluster, monkeypatch, tmp_path):
    attempts = tmp_path / "attempts"

    def _one(recording, *task):
        from bowden.on_ray import _one as diagnosed

        with attempts.open("a") as file:
            file.write(f"{recording}\n")
        if recording == "a/run-0.csv" and attempts.read_text().count(recording) == 1:
            # While it works, and before the result is handed over.
            threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGKILL)).start()
            diagnosed(recording, *task)
            time.sleep(60)
        return diagnosed(recording, *task)

    monkeypatch.setattr(on_ray, "_one", _one)
    found = _survey_on_ray(folder, tmp_path / "out")
    # First, with the messages: they say why a recording has no result.
    assert found.failed == _messages(single)
    assert (found.diagnosed, found.left) == (3, 0)
    assert found.tables["recordings"].read_bytes() == (single / "recordings.parquet").read_bytes()
    assert _contents(tmp_path / "out") == _contents(single)
    begun = Counter(attempts.read_text().split())
    assert begun["a/run-0.csv"] == 2, "the worker was killed, and its task begun anew"
    assert set(begun) == {"a/run-0.csv", "a/run-1.csv", "b/run-2.csv", "b/run-9.csv"}


def test_a_task_without_a_result_says_whether_workers_crashed_or_what_it_raised(folder, single, cluster, monkeypatch, tmp_path):
    attempts = tmp_path / "attempts"

    def _one(recording, *task):
        from bowden.on_ray import _one as diagnosed

        with attempts.open("a") as file:
            file.write(f"{recording}\n")
        if recording == "a/run-0.csv":
            os.kill(os.getpid(), signal.SIGKILL)
        if recording == "a/run-1.csv":
            import nowhere_installed  # noqa: F401
        return diagnosed(recording, *task)

    monkeypatch.setattr(on_ray, "_one", _one)
    found = _survey_on_ray(folder, tmp_path / "out")
    assert Counter(attempts.read_text().split()) == {"a/run-0.csv": 4, "a/run-1.csv": 1, "b/run-2.csv": 1, "b/run-9.csv": 1}
    assert (found.diagnosed, found.left, list(found.failed)) == (1, 0, ["a/run-0.csv", "a/run-1.csv", "b/run-9.csv"])
    assert found.failed["a/run-0.csv"].startswith(f"{folder / 'a/run-0.csv'}: its worker was lost 4 times (WorkerCrashedError); ")
    raised = f"{folder / 'a/run-1.csv'}: its task failed on the worker (ModuleNotFoundError: No module named 'nowhere_installed'); "
    assert found.failed["a/run-1.csv"].startswith(raised)
    before = polars.read_parquet(single / "recordings.parquet")
    after = polars.read_parquet(found.tables["recordings"])
    assert after["status"].to_list() == ["failed", "failed", "done", "failed"]
    assert after[2:].equals(before[2:])


def test_a_package_that_workers_lack_is_named(folder, cluster, monkeypatch, tmp_path):
    lacking = types.ModuleType("nowhere_installed")
    exec("def _one(recording, path, bench, rig, program):\n    return None, None\n", lacking.__dict__)
    monkeypatch.setitem(sys.modules, "nowhere_installed", lacking)
    monkeypatch.setattr(on_ray, "_one", lacking._one)
    with pytest.raises(bowden.InputError, match="no recording could be diagnosed; the first: ") as refused:
        _survey_on_ray(folder, tmp_path)
    raised = "its task failed on the worker (ModuleNotFoundError: No module named 'nowhere_installed'); correct what is installed there"
    assert refused.value.message.endswith(raised)


class _Panic(BaseException):
    """As the native part raises where it panics."""


def test_a_worker_hands_back_why_there_is_no_result(folder, monkeypatch):
    program = bowden._bowden.survey_program()
    damaged = str(folder / "b/run-9.csv")
    task = ("b/run-9.csv", damaged, "b", str(folder / "bench.toml"))
    result, reason = on_ray._one(*task, program)
    assert result is None and reason.startswith(f"{damaged}:3: column `t_s`")
    result, reason = on_ray._one(*task, "bowden 0.0.1")
    assert result is None and "another version than that of the caller" in reason

    def raises(error: BaseException) -> None:
        def survey_one(*task):
            raise error

        monkeypatch.setattr(bowden._bowden, "survey_one", survey_one)

    raises(_Panic("index out\nof bounds"))
    assert on_ray._one(*task, program) == (
        None,
        f"{damaged}: _Panic: index out of bounds, a fault of bowden and not of the recording; report it with the recording and the rig file",
    )
    raises(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        on_ray._one(*task, program)


def test_without_ray_the_engine_says_what_to_install(folder, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(bowden.InputError, match="needs Ray; pip install ray$"):
        bowden.survey(folder, rig=folder / "bench.toml", out=tmp_path, engine="ray", progress=False)

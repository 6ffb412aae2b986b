"""The package itself: types, documentation, pictures."""

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import bowden
import bowden.plots


def test_types_hold_under_mypy_and_the_stub_is_what_the_module_has(tmp_path):
    assert (Path(bowden.__file__).parent / "py.typed").is_file()
    checks = (["mypy", "--strict", "--ignore-missing-imports", "-p", "bowden"], ["mypy.stubtest", "bowden._bowden"])
    for arguments in checks:
        done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_is_documented():
    for module in (bowden, bowden.plots):
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isclass(value) or inspect.isfunction(value):
                assert inspect.getdoc(value), name
                members = inspect.getmembers(value, lambda one: isinstance(one, property) or inspect.isfunction(one))
                for member, code in members:
                    if not member.startswith("_") and inspect.isclass(value) and member in vars(value):
                        assert inspect.getdoc(code), f"{name}.{member}"


def test_pictures_show_what_they_are_given(play, play_diagnosis):
    d = play_diagnosis
    overview = bowden.plots.overview(d)
    assert len(overview.axes) == 2 * len(d.traces)
    measured = overview.axes[0].lines[2]
    assert list(measured.get_ydata()) == list(next(iter(d.traces.values())).measured)
    some = bowden.plots.overview(d, ["theta_out_rad"])
    assert len(some.axes) == 2
    with pytest.raises(bowden.InputError, match="no trace of f9_n"):
        bowden.plots.overview(d, ["f9_n"])
    said = d.residual_map
    # A colour bar is one more.
    assert len(bowden.plots.residual_map(d).axes) == 2 * len(said.axes) + 1
    bars = bowden.plots.before_after(d).axes[0].patches
    assert len(bars) == 3 * len(d.channels)
    first = next(iter(d.channels.values()))
    after = bars[2 * len(d.channels)].get_width()
    assert after == pytest.approx(first.after_rmse / first.before_rmse)
    loops = bowden.plots.hysteresis(play / "heldout.csv", d.rig, y="theta_out_rad", before=play / "rig.toml")
    assert [line.get_label() for line in loops.axes[0].lines] == ["rig as it was", "simulated", "measured"]
    drawn = bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash", variable="theta_out_rad")
    assert len(drawn.axes[0].lines) >= 2
    for wrong in (
        lambda: bowden.plots.hysteresis(play / "heldout.csv", d.rig, y="duty"),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash"),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash", variable="colour"),
    ):
        with pytest.raises(bowden.InputError):
            wrong()


def test_without_matplotlib_pictures_say_what_to_install(play, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(bowden.InputError, match="pip install matplotlib"):
        bowden.plots.hysteresis(play / "heldout.csv", play / "rig.toml")

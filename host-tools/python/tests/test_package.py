"""The package itself: types, documentation, pictures."""

import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
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
    drawn = bowden.plots.residual_map(d).axes
    # A colour bar is one more.
    assert len(drawn) == 2 * len(said.axes) + 1
    channel = said.channels[-1]
    largest = max(value for bins in channel.before_rmse for value in bins if value is not None)
    filled = next(place for place, value in enumerate(channel.before_rmse[0]) if value is not None)
    for axes, values in ((drawn[0], channel.before_rmse), (drawn[len(said.axes)], channel.after_rmse)):
        cells = np.reshape(axes.collections[0].get_array(), (len(said.channels), -1))
        assert cells[-1, filled] == pytest.approx(values[0][filled] / largest)
    bars = bowden.plots.before_after(d).axes[0].patches
    assert len(bars) == 3 * len(d.channels)
    first = next(iter(d.channels.values()))
    after = bars[2 * len(d.channels)].get_width()
    assert after == pytest.approx(first.after_rmse / first.before_rmse)
    loops = bowden.plots.hysteresis(play / "heldout.csv", d.rig, y="theta_out_rad", before=play / "rig.toml")
    assert [line.get_label() for line in loops.axes[0].lines] == ["rig as it was", "simulated", "measured"]
    _assert_points_on_line(bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash", variable="theta_out_rad"))
    for wrong in (
        lambda: bowden.plots.hysteresis(play / "heldout.csv", d.rig, y="duty"),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash"),
        lambda: bowden.plots.law(play / "heldout.csv", d.rig, effect="joint_backlash", variable="colour"),
    ):
        with pytest.raises(bowden.InputError):
            wrong()


def _assert_points_on_line(figure) -> np.ndarray:
    """What is measured beyond the simulation lies where what the effect adds lies; returns the line, shape `(2, bins)`."""
    points, line = (np.array(one.get_data()) for one in figure.axes[0].lines[:2])
    assert np.array_equal(points[0], line[0]) and len(line[0]) >= 20
    assert np.std(points[1] - line[1]) < 0.2 * np.std(line[1])
    return line


def test_a_law_is_drawn_against_what_was_measured(rig):
    """The bench is simulated with a spring `-0.4 theta^3` that its rig file states by points."""
    thetas = np.linspace(-0.8, 0.8, 81).tolist()
    stated = '\n[[law]]\nname = "spring"\ncomponent = "joint"\nport = "joint_torque_nm"\nvariables = ["theta_out_rad"]\npoints = {}\n'
    with_law, stronger = (bowden.Rig(rig.text + stated.format([[x, -k * x**3] for x in thetas])) for k in (0.4, 0.8))
    recording = bowden.simulate(with_law, motion="sine", seconds=8.0, rate_hz=250.0, seed=3)
    figure = bowden.plots.law(recording, with_law)
    _assert_points_on_line(figure)
    assert figure.axes[0].get_xlabel() == "theta_out_rad"
    # A rig whose law is twice as strong draws a line beside the points.
    with pytest.raises(AssertionError):
        _assert_points_on_line(bowden.plots.law(recording, stronger))


def test_without_matplotlib_pictures_say_what_to_install(play, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(bowden.InputError, match="pip install matplotlib"):
        bowden.plots.hysteresis(play / "heldout.csv", play / "rig.toml")

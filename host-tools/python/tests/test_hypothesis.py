"""Hypotheses of the user as terms of the search."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import bowden

PAGE = Path(__file__).resolve().parents[2] / "docs/python.md"


@pytest.fixture(scope="module")
def lip(virtual_bench, tmp_path_factory):
    """Recordings of a bench with a lip that rubs at one place of the joint's travel, which no effect and no closed form describes."""
    folder = tmp_path_factory.mktemp("lip")
    case = ["--effect", "unlisted_joint", "--seed", "11", "--seconds", "12", "--heldout-seconds", "8"]
    subprocess.run([virtual_bench, "record", *case, "--out", folder], check=True)
    truth = json.loads((folder / "truth.json").read_text())["effect_parameters"]
    assert truth["unlisted_joint.law"] == "RubbingRange"
    return folder, truth


def test_the_example_of_the_page_finds_the_lip(lip, bowden_command, monkeypatch):
    folder, truth = lip
    [example] = [block for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL) if "Hypothesis(" in block]
    monkeypatch.chdir(folder)
    names: dict = {}
    exec(compile(example, str(PAGE), "exec"), names)
    d, tried = names["d"], names["d"].hypotheses[0]
    assert tried.found and tried.beats_catalogue and tried.beats_closed_form, tried.sentence
    # The bench's own numbers: size of the law, its place, and 0.08 rad of half width.
    found = tried.coefficients
    assert found["level_nm"].value == pytest.approx(truth["unlisted_joint.size_nm"], rel=0.2)
    assert found["at_rad"].value == pytest.approx(truth["unlisted_joint.place"], abs=0.01)
    assert found["width_rad"].value == pytest.approx(0.08, abs=0.015)
    low, high = found["at_rad"].interval
    assert low < found["at_rad"].value < high and high - low == pytest.approx(3.92 * found["at_rad"].std)
    assert tried.heldout_loss < 0.5 * tried.heldout_loss_without
    # No listed effect is there: the best of them takes nothing off.
    assert tried.catalogue.heldout_loss > 0.9 * tried.heldout_loss_without
    # A bump whose edges are as steep comes near to the lip, a round one, at more than twice, does not.
    assert 1.2 * tried.heldout_loss < tried.closed_form.heldout_loss < 2.0 * tried.heldout_loss
    assert tried.free_curve.heldout_loss > tried.heldout_loss
    assert d.verdict == "unexplained" and d.unexplained.modelled and "rubbing_lip(theta_out_rad" in d.laws[0].formula
    assert d.to_dict()["hypotheses"][0]["name"] == "rubbing_lip" and "rubbing_lip" in d._native.report_html()
    # The rig needs the function no more: the command simulates its points, and predicts as Python does.
    d.rig.save("lip.toml")
    command = [bowden_command, "replay", "heldout.csv", "--rig", "lip.toml", "--out", "predicted.csv"]
    subprocess.run(command, check=True)
    here, there = bowden.replay("heldout.csv", d.rig), bowden.Recording.load("predicted.csv")
    assert np.array_equal(here["theta_out_rad"], there["theta_out_rad"])
    measured = bowden.Recording.load("heldout.csv")
    left = [np.std(measured["f2_n"] - bowden.replay("heldout.csv", rig)["f2_n"]) for rig in (d.rig, d.rig.without("law"))]
    assert left[0] < 0.8 * left[1]


def test_a_function_of_two_variables_gets_its_coefficient_back(rig):
    """The bench is simulated with a drag `-0.6 theta^2 omega` that its rig file states by points."""
    thetas, omegas = np.linspace(-1.5, 1.5, 61), np.linspace(-8.0, 8.0, 3)
    points = [[x, y, -0.6 * x * x * y] for x in thetas.tolist() for y in omegas.tolist()]
    law = (
        '\n[[law]]\nname = "drag"\ncomponent = "joint"\nport = "joint_torque_nm"\n'
        f'variables = ["theta_out_rad", "omega_out_rad_s"]\npoints = {points}\n'
    )
    with_drag = bowden.Rig(rig.text + law)
    recordings = [bowden.simulate(with_drag, motion="multisine", seconds=6.0, rate_hz=250.0, seed=seed) for seed in (1, 2)]
    hypothesis = bowden.Hypothesis(
        lambda theta_out_rad, omega_out_rad_s, k: -k * theta_out_rad**2 * omega_out_rad_s,
        name="squeezed_film",
        port="joint_torque_nm",
        coefficients={"k": bowden.Coefficient(0.2, 0.0, 10.0, "N·m·s/rad^3")},
    )
    d = bowden.diagnose(recordings[0], rig, heldout=recordings[1], hypotheses=[hypothesis], progress=False)
    [tried] = d.hypotheses
    assert tried.found and tried.variables == ("theta_out_rad", "omega_out_rad_s"), tried.sentence
    assert tried.coefficients["k"].value == pytest.approx(0.6, rel=0.03)
    assert isinstance(d.rig["load.mass_kg"], float) and 'name = "squeezed_film"' in d.rig.text


def _state(function, **changed):
    options = {"port": "joint_torque_nm", "coefficients": {"a": bowden.Coefficient(0.1, -1.0, 1.0)}} | changed
    return bowden.Hypothesis(function, **options)


def test_an_exception_of_the_function_ends_the_search_and_is_its_cause(recording, rig):
    calls = []

    def fails_later(omega_out_rad_s, a):
        calls.append(a)
        if len(calls) > 6:
            raise ZeroDivisionError("no way on")
        return -a * omega_out_rad_s

    with pytest.raises(bowden.InputError, match="fails_later.*ZeroDivisionError: no way on") as raised:
        bowden.diagnose(recording, rig, hypotheses=[_state(fails_later)], progress=False)
    assert isinstance(raised.value.__cause__, ZeroDivisionError)
    assert len(calls) < 40


def test_a_function_point_by_point_equals_one_of_arrays(recording, rig):
    def stop(theta_out_rad, a):
        return -a * (theta_out_rad - 0.2) if theta_out_rad > 0.2 else 0.0

    def stop_of_arrays(theta_out_rad, a):
        return np.where(theta_out_rad > 0.2, -a * (theta_out_rad - 0.2), 0.0)

    one = _state(stop, pointwise=True)
    assert one(0.3, 2.0) == pytest.approx(-0.2)
    short = bowden.Recording.from_arrays({name: values[:1600] for name, values in recording.to_arrays().items()})
    of_points, of_arrays = (
        bowden.diagnose(short, rig, hypotheses=[stated], progress=False).hypotheses[0] for stated in (one, _state(stop_of_arrays))
    )
    assert of_points.heldout_loss == of_arrays.heldout_loss and of_points.coefficients == of_arrays.coefficients
    # Nothing of the kind is there.
    assert not of_points.found and "not in the diagnosed rig" in of_points.sentence


@pytest.mark.parametrize(
    ("function", "changed", "message"),
    [
        (lambda omega_out_rad_s, a: a / 0, {"name": "x"}, "ZeroDivisionError"),
        (lambda omega_out_rad_s, a: np.log(omega_out_rad_s), {"name": "x"}, "NaN at omega_out_rad_s = -1"),
        (lambda omega_out_rad_s, a: np.zeros(3), {"name": "x"}, r"shape \(3,\)"),
        (lambda omega_out_rad_s, a: "text", {"name": "x"}, "ValueError"),
        (lambda omega_out_rad_s, a: 0.0, {}, "lower-case letters"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "joint_backlash"}, "catalogue has that name"),
        (lambda omega_in_rad_s, a: 0.0, {"name": "x"}, "no variable omega_in_rad_s"),
        (lambda colour, a: 0.0, {"name": "x"}, "`colour`; take one of theta_out_rad"),
        (lambda a: 0.0, {"name": "x"}, "0 variables"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "port": "door"}, "no port `door`"),
        (lambda value, a: 0.0, {"name": "x", "port": "reading"}, "needs a channel"),
        (lambda value, a: 0.0, {"name": "x", "port": "reading", "channel": "f9_n"}, "no channel `f9_n`"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "channel": "f1_n"}, "has no channel"),
        (lambda omega_out_rad_s, b: 0.0, {"name": "x"}, "no parameter a"),
        (lambda *all: 0.0, {"name": "x"}, "without a name"),
        (lambda omega_out_rad_s: 0.0, {"name": "x", "coefficients": {}}, "0 coefficients"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "ranges": {"t_s": (0, 1)}}, "no variable t_s"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "ranges": {"omega_out_rad_s": (1, 1)}}, "two numbers that rise"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "coefficients": {"a": bowden.Coefficient(3.0, 0.0, 1.0)}}, "outside"),
        (lambda omega_out_rad_s, a: 0.0, {"name": "x", "coefficients": {"a": bowden.Coefficient(3.0, 5.0, 1.0)}}, "rise"),
    ],
)
def test_what_cannot_be_stated_is_refused(function, changed, message):
    with pytest.raises(bowden.InputError, match=message):
        _state(function, **changed)


def test_a_hypothesis_stated_twice_is_refused(recording, rig):
    one = _state(lambda omega_out_rad_s, a: -a * omega_out_rad_s, name="drag")
    with pytest.raises(bowden.InputError, match="stated twice"):
        bowden.diagnose(recording, rig, hypotheses=[one, one], progress=False)

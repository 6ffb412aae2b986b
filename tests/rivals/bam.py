"""Ranking of the friction models M1 to M6 at the motor, after BAM ("Better Actuator Models").

Equations and procedure of Duclusaud, Passault, Padois, Ly: Extended Friction Models for the Physics Simulation of Servo
Actuators, ICRA 2025 (arXiv 2410.08650), as bam.readthedocs.io gives them under Theory and Fitting: a voltage makes
a motor torque, friction is the stopping torque clipped to a budget, the budget is one of six models, parameters of motor
and friction are found together by CMA-ES on the mean absolute error, and the model with the best validation error wins.

BAM knows no cable: what pulls at the motor's pulley is bowden's simulation with recalibrated parameters, and so are the
channels beyond it. The motor gives the current and the difference of f1 and f3; that difference is taken from the motor
or left to the simulation, whichever validates better. The recorded input angle is given, so the stopping torque is the
one that keeps that motion. CMA-ES gets 3000 evaluations a model instead of 100 000: with the motion given, an evaluation
is a formula without a simulation's chaos.
"""

import warnings
from typing import NamedTuple

import cma
import numpy as np

from case_files import STILL_RAD_S, Answer, Case, Recording, recalibrated, run, split

EVALUATIONS = 3000
ALIKE = 1.01
"""Of models whose validation errors are within this factor of the best, the one with fewest parameters is taken."""

STEP = 0.1
"""First standard deviation of the search, of each parameter's range."""

MODELS = {
    "M1": ["viscous", "coulomb"],
    "M2": ["viscous", "coulomb", "stribeck", "stribeck_speed", "stribeck_exponent"],
    "M3": ["viscous", "coulomb", "load"],
    "M4": ["viscous", "coulomb", "stribeck", "stribeck_speed", "stribeck_exponent", "load", "load_stribeck"],
    "M5": [
        *["viscous", "coulomb", "stribeck", "stribeck_speed", "stribeck_exponent"],
        *["motor_load", "external_load", "motor_load_stribeck", "external_load_stribeck"],
    ],
    "M6": [
        *["viscous", "coulomb", "stribeck", "stribeck_speed", "stribeck_exponent"],
        *["motor_load", "external_load", "motor_load_stribeck", "external_load_stribeck"],
        *["motor_square", "external_square"],
    ],
}
"""Parameters of each model."""

NOMINAL = ["resistance", "torque_constant", "rotor_inertia"]
"""Factors on the rig file's values, 0.5 to 2 of them."""


class Range(NamedTuple):
    """From, to, and where the search begins."""

    low: float
    high: float
    start: float


def ranges(model: str, torque_nm: float) -> dict[str, Range]:
    """Bounds of the search; friction is at most half the largest motor torque."""
    half = 0.5 * torque_nm
    gain = Range(0.0, 0.5, 0.02)
    friction = {
        "viscous": Range(0.0, 0.2, 0.02),
        "coulomb": Range(0.0, half, 0.02 * half),
        "stribeck": Range(0.0, half, 0.02 * half),
        "stribeck_speed": Range(0.02, 2.0, 0.2),
        "stribeck_exponent": Range(0.5, 3.0, 1.0),
        "motor_square": Range(0.0, 0.5 / torque_nm, 0.01 / torque_nm),
        "external_square": Range(0.0, 0.5 / torque_nm, 0.01 / torque_nm),
    }
    found = {name: Range(0.5, 2.0, 1.0) for name in NOMINAL}
    return found | {name: friction.get(name, gain) for name in MODELS[model]}


def budget(p: dict[str, float], speed: np.ndarray, motor: np.ndarray, external: np.ndarray) -> np.ndarray:
    """Largest friction torque, N m, of whichever model the parameters belong to."""
    total = p["viscous"] * np.abs(speed) + p["coulomb"]
    if "load" in p:
        total = total + p["load"] * np.abs(motor - external)
    if "motor_load" in p:
        total = total + np.abs(p["motor_load"] * motor - p["external_load"] * external)
    if "stribeck" not in p:
        return total
    slow = p["stribeck"]
    if "load_stribeck" in p:
        slow = slow + p["load_stribeck"] * np.abs(motor - external)
    if "motor_load_stribeck" in p:
        slow = slow + np.abs(p["motor_load_stribeck"] * motor - p["external_load_stribeck"] * external)
    if "motor_square" in p:
        driven = np.abs(motor) > np.abs(external)
        slow = slow + np.where(driven, p["external_square"] * external**2, p["motor_square"] * motor**2)
    return total + np.exp(-((np.abs(speed) / p["stribeck_speed"]) ** p["stribeck_exponent"])) * slow


def simulate(rig: dict, p: dict[str, float], recording: Recording, load: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Channels at the motor for the recorded input angle and voltage, and for simulated tensions of the input ends."""
    motor, radius = rig["motor"], rig["pulleys"]["input_radius_m"]
    speed = recording["speed_rad_s"]
    constant = p["torque_constant"] * motor["torque_constant_nm_per_a"] * motor["gear_ratio"]
    current = (recording["voltage_v"] - constant * speed) / (p["resistance"] * motor["resistance_ohm"])
    torque = constant * current
    external = -(load["f1_n"] - load["f3_n"]) * radius
    inertia = p["rotor_inertia"] * motor["rotor_inertia_kg_m2"] * motor["gear_ratio"] ** 2
    accelerating = inertia * np.gradient(speed, recording.t_s)
    limit = budget(p, speed, torque, external)
    stopping = np.clip(torque - accelerating + external, -limit, limit)
    friction = np.where(np.abs(speed) > STILL_RAD_S, np.sign(speed) * limit, stopping)
    half = 0.5 * (torque - accelerating - friction) / radius
    middle = 0.5 * (load["f1_n"] + load["f3_n"])
    return {"f1_n": middle + half, "f3_n": middle - half, "i_motor_a": current}


def error(found: dict[str, np.ndarray], case: Case, rows: slice) -> float:
    """Mean absolute error, each channel in its own spread."""
    recorded = case.train
    return float(np.mean([
        np.mean(np.abs(values[rows] - recorded[name][rows])) / recorded[name].std() for name, values in found.items()
    ]))


def searched(
    case: Case, model: str, rows: slice, load: dict[str, np.ndarray], start: dict[str, float] | None = None
) -> dict[str, float]:
    """Parameters with the least error on some rows of the training recording."""
    motor = case.rig["motor"]
    stall = np.abs(case.train["voltage_v"]).max() / motor["resistance_ohm"]
    limits = ranges(model, stall * motor["torque_constant_nm_per_a"] * motor["gear_ratio"])
    names, low = list(limits), np.array([limit.low for limit in limits.values()])
    width = np.array([limit.high for limit in limits.values()]) - low
    first = np.array([limit.start if start is None else start[name] for name, limit in limits.items()])

    def parameters(x: np.ndarray) -> dict[str, float]:
        return dict(zip(names, low + width * np.asarray(x)))

    def loss(x: np.ndarray) -> float:
        return error(simulate(case.rig, parameters(x), case.train, load), case, rows)

    options = {"bounds": [0.0, 1.0], "maxfevals": EVALUATIONS, "seed": 1, "verbose": -9}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found, _ = cma.fmin2(loss, np.clip((first - low) / width, 0.0, 1.0), STEP, options)
    return parameters(found)


def predict(case: Case) -> Answer:
    """Ranks the models on the validating third, and fits the simplest of the best to everything."""
    full, simulated = recalibrated(case)
    load = simulated["train"]
    fit, validate = split(len(case.train))
    ranking = {}
    for model in MODELS:
        p = searched(case, model, fit, load)
        ranking[model] = (error(simulate(case.rig, p, case.train, load), case, validate), p)
    least = min(wrong for wrong, _ in ranking.values())
    alike = [model for model, (wrong, _) in ranking.items() if wrong <= ALIKE * least]
    best = min(alike, key=lambda model: len(MODELS[model]))
    tensions = ["f1_n", "f3_n"]
    at_motor = simulate(case.rig, ranking[best][1], case.train, load)
    of_motor, of_simulation = (
        error({name: found[name] for name in tensions}, case, validate) for found in [at_motor, load]
    )
    p = searched(case, best, slice(None), load, ranking[best][1])
    found = simulate(case.rig, p, case.heldout, simulated["heldout"])
    columns = {name: full[name] for name in case.outputs}
    for name, values in found.items():
        if name not in tensions or of_motor < of_simulation:
            columns[name] = np.interp(case.heldout_t_s, case.heldout.t_s, values)
    order = sorted(ranking, key=lambda model: ranking[model][0])
    chosen = {"model": best, "ranking": ", ".join(f"{model} {ranking[model][0]:.4f}" for model in order)}
    chosen |= {"f1 - f3": "motor" if of_motor < of_simulation else "simulation"}
    chosen |= {name: f"{value:.4g}" for name, value in p.items()}
    return Answer(np.column_stack([columns[name] for name in case.outputs]), chosen)


if __name__ == "__main__":
    run(predict)

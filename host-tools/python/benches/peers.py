"""Speed and error side by side with other software, on this machine: `cargo xtask bench --peers` runs it and writes docs/peers.md.

The system: a DC motor without inductance, two elastic tendons with internal loss, an arm in gravity (four states). The voltage is held for a tenth
of a second at a time. The reference is scipy's DOP853 at a relative tolerance of 1e-12. The error is that of the joint's angle, root mean square over
all samples.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import scipy
import scipy.integrate

import bowden

SECONDS = 20.0
RATE_HZ = 100.0
HELD_S = 0.1
REPEATS = 5
STEPS_S = (5e-3, 2e-3, 1e-3, 5e-4, 2e-4)
FIRST_ORDER_STEPS_S = (*STEPS_S, 1e-4, 5e-5)
MUJOCO_STEPS_S = {"Euler": FIRST_ORDER_STEPS_S, "implicitfast": FIRST_ORDER_STEPS_S, "RK4": (1e-2, *STEPS_S[:-1])}
ROPE_LOSS_S = 5e-4
"""Torque of a stretch rate over that of a stretch, s; the model of bowden's tendons has it built in (model/src/transmission.rs)."""
EQUAL_STEP_S = 1e-3
EQUAL_ERROR_RAD = (1e-3, 1e-4)
RIG = """schema = "bowden-rig/1"
name = "peers"
[motor]
supply_v = 24.0
resistance_ohm = 2.0
inductance_h = 0.0
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5.0e-6
viscous_nm_s_per_rad = 0.02
[pulleys]
input_radius_m = 0.015
output_radius_m = 0.015
[tendon]
length_m = 1.0
axial_stiffness_n = 72900.0
pretension_n = 30.0
[load]
mass_kg = 2.5
arm_m = 0.03
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.004
[simulation]
step_s = STEP
[replay]
inputs = ["duty", "bus_v"]
outputs = ["theta_out_rad"]
"""


@dataclass
class Run:
    """One way to simulate the session."""

    name: str
    setting: str
    error_rad: float
    seconds: list[float]
    """Wall time of every repetition, s."""

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    @property
    def spread(self) -> str:
        return f"{min(self.seconds):.3g} to {max(self.seconds):.3g}"


def timed(work: Callable[[], np.ndarray]) -> tuple[np.ndarray, list[float]]:
    """The result, and the wall time of every repetition after one that does not count."""
    result = work()
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return result, seconds


def rms(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((np.asarray(a) - b) ** 2)))


class Session:
    """Voltages, times, and the equations in plain Python."""

    def __init__(self) -> None:
        self.rig = bowden.Rig(RIG.replace("STEP", "0.001"))
        self.t_s = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
        self.levels = np.random.default_rng(5).uniform(-6.0, 6.0, int(SECONDS / HELD_S))
        self.volts = self.levels[np.minimum((self.t_s / HELD_S + 1e-9).astype(int), len(self.levels) - 1)]
        rig = self.rig
        turns = rig["motor.gear_ratio"]
        self.k_nm = rig["motor.torque_constant_nm_per_a"] * turns / rig["motor.resistance_ohm"]
        self.back = self.k_nm * rig["motor.torque_constant_nm_per_a"] * turns + rig["motor.viscous_nm_s_per_rad"]
        self.j_in = turns**2 * rig["motor.rotor_inertia_kg_m2"]
        self.radius_m = rig["pulleys.input_radius_m"]
        self.stiffness = 2.0 * rig["tendon.axial_stiffness_n"] / rig["tendon.length_m"] * self.radius_m**2
        self.j_out = rig["load.mass_kg"] * rig["load.arm_m"] ** 2
        self.weight = rig["load.mass_kg"] * 9.80665 * rig["load.arm_m"]
        self.drag = rig["load.viscous_nm_s_per_rad"]
        self.loss = ROPE_LOSS_S * self.stiffness

    def slopes(self, y: np.ndarray, volts: float) -> tuple[float, float, float, float]:
        """Slopes of both angles and both speeds."""
        a, b, u, v = y
        pull = self.stiffness * (a - b) + self.loss * (u - v)
        return (
            u,
            v,
            (self.k_nm * volts - self.back * u - pull) / self.j_in,
            (pull - self.drag * v - self.weight * math.sin(b)) / self.j_out,
        )

    def by_scipy(self, method: str, rtol: float) -> np.ndarray:
        """The joint's angle at all samples, integrated from one change of the voltage to the next."""
        state, out = np.zeros(4), []
        per = int(HELD_S * RATE_HZ)
        for index, level in enumerate(self.levels):
            start = index * HELD_S
            ends = start + np.arange(per + 1) / RATE_HZ
            found = scipy.integrate.solve_ivp(
                lambda _t, y, level=level: self.slopes(y, level), (start, ends[-1]), state, method, ends, rtol=rtol, atol=1e-2 * rtol
            )
            out.append(found.y[1, :per])
            state = found.y[:, -1]
        return np.concatenate(out)

    def by_bowden(self, step_s: float) -> Callable[[], np.ndarray]:
        rig = bowden.Rig(RIG.replace("STEP", repr(step_s)))
        bus = np.full_like(self.t_s, self.rig["motor.supply_v"])
        recording = bowden.Recording.from_arrays({"t_s": self.t_s, "duty": self.volts / bus, "bus_v": bus})
        return lambda: bowden.replay(recording, rig)["theta_out_rad"]

    def by_mujoco(self, step_s: float, integrator: int, folder: Path) -> Callable[[], np.ndarray]:
        path = folder / "peers.xml"
        bowden.export_mujoco(self.rig, path)
        model = mujoco.MjModel.from_xml_path(str(path))
        model.opt.timestep = step_s
        model.opt.integrator = integrator
        model.tendon_damping[0] = self.loss / self.radius_m**2
        # Nothing here touches: the solver of constraints has nothing to do.
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        data = mujoco.MjData(model)
        start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        every = round(1.0 / RATE_HZ / step_s)
        control = np.repeat(self.volts, every)[:, None]
        place = 1 + model.joint("joint").qposadr[0]

        def work() -> np.ndarray:
            states, _ = mujoco.rollout.rollout(model, data, start[None, :], control[None, :, :])
            # States are those after each step.
            return np.concatenate(([0.0], states[0, every - 1 :: every, place]))[:-1]

        return work


def by_diffrax(session: Session, rtol: float) -> Callable[[], np.ndarray]:
    """Tsit5 with jumps at the changes of the voltage, compiled."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    levels = jnp.asarray(session.levels)
    jumps = jnp.arange(1, len(session.levels)) * HELD_S

    def slopes(t: float, y: jax.Array, _: None) -> jax.Array:
        a, b, u, v = y
        volts = levels[jnp.clip(jnp.floor(t / HELD_S + 1e-12).astype(int), 0, len(session.levels) - 1)]
        pull = session.stiffness * (a - b) + session.loss * (u - v)
        return jnp.array(
            [
                u,
                v,
                (session.k_nm * volts - session.back * u - pull) / session.j_in,
                (pull - session.drag * v - session.weight * jnp.sin(b)) / session.j_out,
            ]
        )

    controller = diffrax.ClipStepSizeController(diffrax.PIDController(rtol=rtol, atol=1e-2 * rtol), jump_ts=jumps)

    @jax.jit
    def solve() -> jax.Array:
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(slopes),
            diffrax.Tsit5(),
            0.0,
            SECONDS,
            1e-3,
            jnp.zeros(4),
            saveat=diffrax.SaveAt(ts=jnp.asarray(session.t_s)),
            stepsize_controller=controller,
            max_steps=1_000_000,
        )
        return solution.ys[:, 1]

    return lambda: np.asarray(solve().block_until_ready())


def at_error(runs: list[Run], error_rad: float) -> float | None:
    """Wall time at which a family of runs has this error, between the two runs around it; `None` where none gets there."""
    ordered = sorted(runs, key=lambda run: run.error_rad)
    if not ordered or ordered[0].error_rad > error_rad:
        return None
    if ordered[-1].error_rad <= error_rad:
        return min(run.median for run in runs)
    for fine, coarse in zip(ordered, ordered[1:], strict=False):
        if fine.error_rad <= error_rad <= coarse.error_rad:
            part = math.log(error_rad / fine.error_rad) / math.log(coarse.error_rad / fine.error_rad)
            return math.exp((1.0 - part) * math.log(fine.median) + part * math.log(coarse.median))
    return None


def measure(folder: Path) -> dict[str, list[Run]]:
    session = Session()
    reference = session.by_scipy("DOP853", 1e-12)
    families: dict[str, list[Run]] = {}

    def add(name: str, setting: str, work: Callable[[], np.ndarray]) -> None:
        found, seconds = timed(work)
        families.setdefault(name, []).append(Run(name, setting, rms(found, reference), seconds))
        print(f"{name}, {setting}: {families[name][-1].error_rad:.2e} rad, {families[name][-1].median:.4g} s", flush=True)

    for step_s in STEPS_S:
        add("bowden", f"step {step_s:g} s", session.by_bowden(step_s))
    for label, integrator in (("Euler", 0), ("RK4", 1), ("implicitfast", 3)):
        for step_s in MUJOCO_STEPS_S[label]:
            add(f"MuJoCo {label}", f"step {step_s:g} s", session.by_mujoco(step_s, integrator, folder))
    for rtol in (1e-3, 1e-5, 1e-7):
        for method in ("RK45", "LSODA"):
            add(f"solve_ivp {method}", f"rtol {rtol:g}", lambda method=method, rtol=rtol: session.by_scipy(method, rtol))
        add("diffrax Tsit5", f"rtol {rtol:g}", by_diffrax(session, rtol))
    return families


def page(families: dict[str, list[Run]], files: list[dict], ticks: list[dict], rivals: str, provenance: str) -> str:
    import diffrax
    import jax

    ours = {run.setting: run for run in families["bowden"]}
    equal = f"step {EQUAL_STEP_S:g} s"
    lines = [
        "# Side by side",
        "",
        f"Written by `cargo xtask bench --peers`{provenance} on {platform.machine()}, Python {platform.python_version()}; MuJoCo "
        f"{mujoco.__version__}, scipy {scipy.__version__}, diffrax {diffrax.__version__}, jax {jax.__version__}. One thread each but for what a library starts "
        f"by itself; wall time, median of {REPEATS} and their range, on a machine that other work may have shared.",
        "",
        "The system is a DC motor without inductance, two elastic tendons and an arm in gravity, driven for "
        f"{SECONDS:g} s by a voltage that changes every {HELD_S:g} s. The MuJoCo model is what `bowden export mujoco` writes, with the loss of the tendons as "
        "their damping. The error is that of the joint's angle (RMS) against scipy's DOP853 at a relative tolerance of 1e-12.",
        "",
        "bowden's integrator is of second order here, and of first where friction sticks. A step longer than the elastic joint allows is divided.",
        "",
        "## At equal error",
        "",
        "| software | " + " | ".join(f"{error:g} rad: s for {SECONDS:g} s" for error in EQUAL_ERROR_RAD) + " | over bowden |",
        "|---|" + "---|" * (len(EQUAL_ERROR_RAD) + 1),
    ]
    own = [at_error(families["bowden"], error) for error in EQUAL_ERROR_RAD]
    for name, runs in families.items():
        times = [at_error(runs, error) for error in EQUAL_ERROR_RAD]
        shown = ["not reached" if one is None else f"{one:.3g}" for one in times]
        ratios = ["" if one is None or base is None else f"{one / base:.3g}" for one, base in zip(times, own, strict=True)]
        lines.append(f"| {name} | " + " | ".join(shown) + f" | {', '.join(ratio or '-' for ratio in ratios)} |")
    lines += ["", f"## At equal step, {EQUAL_STEP_S:g} s", "", "| software | steps a second | range | error, rad | over bowden |", "|---|---|---|---|---|"]
    steps = SECONDS / EQUAL_STEP_S
    for name, runs in families.items():
        for run in runs:
            if run.setting == equal:
                low, high = steps / max(run.seconds), steps / min(run.seconds)
                ratio = ours[equal].median / run.median
                lines.append(f"| {name} | {steps / run.median:.3g} | {low:.3g} to {high:.3g} | {run.error_rad:.1e} | {ratio:.3g} |")
    lines += ["", "## All runs", "", "| software | setting | error, rad | s | range, s |", "|---|---|---|---|---|"]
    for runs in families.values():
        lines += [f"| {run.name} | {run.setting} | {run.error_rad:.1e} | {run.median:.3g} | {run.spread} |" for run in runs]
    if files:
        lines += [
            "",
            "## MCAP",
            "",
            "A recording of 100,000 rows of 13 columns, written and read; the plain `mcap` crate with the same chunks and compression.",
            "",
            "| what | s | range, s | bytes |",
            "|---|---|---|---|",
        ]
        for one in files:
            took = one["seconds"]
            lines.append(f"| {one['what']} | {statistics.median(took):.3g} | {min(took):.3g} to {max(took):.3g} | {one['bytes']:,} |")
    if ticks:
        lines += [
            "",
            "## Control tick",
            "",
            "On this machine: the fixed-point tick with all its checks, and an f32 cascade of position, speed and current loops with nothing beside it.",
            "",
            "| what | ns a tick | range, ns |",
            "|---|---|---|",
        ]
        for one in ticks:
            lines.append(f"| {one['tick']} | {statistics.median(one['ns']):.1f} | {min(one['ns']):.1f} to {max(one['ns']):.1f} |")
    if rivals:
        lines += ["", "## Diagnosis", "", *rivals.strip().splitlines()]
    lines.append("")
    return "\n".join(lines)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--folder", type=Path, required=True, help="for what is written on the way")
    arguments.add_argument("--page", type=Path, required=True, help="page to write")
    arguments.add_argument("--files", type=Path, help="what the benchmarks of MCAP and of the control tick have printed, lines of JSON")
    arguments.add_argument("--rivals", type=Path, help="the part of the diagnosis, Markdown")
    arguments.add_argument("--provenance", default="", help="commit, for the page")
    given = arguments.parse_args()
    said = given.files.read_text(encoding="utf-8").splitlines() if given.files else []
    figures = [json.loads(line) for line in said if line.startswith("{")]
    files = [one for one in figures if "what" in one]
    ticks = [one for one in figures if "tick" in one]
    rivals = given.rivals.read_text(encoding="utf-8") if given.rivals else ""
    families = measure(given.folder)
    given.page.write_text(page(families, files, ticks, rivals, given.provenance), encoding="utf-8")
    print(given.page)


if __name__ == "__main__":
    main()

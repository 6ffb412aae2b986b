"""Each rival on a system whose answer is known: what fails here would not be fair to it."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

import bam
import discrepancy
import narx
import sindy
from case_files import (
    RATE_HZ,
    Case,
    Recording,
    confined,
    first_that_stays,
    held_sign,
    low_pass,
    prepared,
    relative_error,
    split,
)

RIG = {
    "motor": {
        "resistance_ohm": 2.0,
        "torque_constant_nm_per_a": 0.03,
        "gear_ratio": 30.0,
        "rotor_inertia_kg_m2": 5e-6,
    },
    "pulleys": {"input_radius_m": 0.015, "output_radius_m": 0.015},
}


def motion(seconds: float, seed: int) -> Recording:
    """Input angle and voltage of a random multisine at 1 kHz, at rest to begin with, as the rivals get them."""
    t_s = np.arange(round(1000.0 * seconds)) / 1000.0
    random = np.random.default_rng(seed)
    start = np.clip(t_s - 0.5, 0.0, 1.0)

    def wave(size: float) -> np.ndarray:
        frequencies, phases = random.uniform(0.2, 1.5, 5), random.uniform(0.0, 2.0 * np.pi, 5)
        return size * start * np.sin(2.0 * np.pi * np.outer(t_s, frequencies) + phases).mean(axis=1)

    raw = {"theta_in_rad": wave(1.0), "duty": wave(0.2), "bus_v": np.full(len(t_s), 24.0)}
    return prepared(Recording(t_s, raw))


def case(simulate, folder: Path = Path()) -> tuple[Case, np.ndarray]:
    """A case whose outputs `simulate` gives, and what was held out."""
    train, heldout = motion(30.0, 1), motion(15.0, 2)
    outputs = simulate(train)
    train.channels |= outputs
    answer = simulate(heldout)
    start = {name: np.full(3, values[0]) for name, values in answer.items()}
    found = Case(folder, RIG, train, heldout, Recording(np.arange(3.0), start), heldout.t_s, list(outputs))
    return found, np.column_stack([answer[name] for name in outputs])


def second_order(recording: Recording) -> dict[str, np.ndarray]:
    """y'' + 2 ζ ω y' + ω² y = ω² u with ω = 8 rad/s and ζ = 0.4, in steps of 1 ms; y' is recorded as well."""
    omega, damping, steps = 8.0, 0.4, 10
    y, rate = np.zeros(len(recording)), np.zeros(len(recording))
    angle = recording["theta_in_rad"]
    for row in range(1, len(recording)):
        a, b = y[row - 1], rate[row - 1]
        for step in range(steps):
            u = angle[row - 1] + (angle[row] - angle[row - 1]) * step / steps
            b += 1e-3 * (omega**2 * (u - a) - 2.0 * damping * omega * b)
            a += 1e-3 * b
        y[row], rate[row] = a, b
    return {"y": y, "rate": rate}


def relaxation(recording: Recording) -> dict[str, np.ndarray]:
    """y' = 5 (2 u + 0.5 sign(v) − y), in steps: a system of one state with friction."""
    keep = np.exp(-5.0 / RATE_HZ)
    wanted = 2.0 * recording["theta_in_rad"] + 0.5 * recording["sign_v"]
    y = np.zeros(len(recording))
    for row in range(1, len(recording)):
        y[row] = keep * y[row - 1] + (1.0 - keep) * wanted[row]
    return {"y": y}


class Sindy(unittest.TestCase):
    def test_a_state_with_friction_is_predicted_freely(self):
        known, answer = case(relaxation)
        said = sindy.predict(known)
        self.assertLess(relative_error(said.prediction, answer), 0.01, said.chosen)
        self.assertIn("sign(v)", said.chosen["y"])

    def test_a_second_order_system_is_found_with_its_coefficients(self):
        known, answer = case(second_order)
        x = known.train.table(known.outputs)
        u = known.train.table(["theta_in_rad"])
        model = sindy.fitted(x, u, 1.0 / RATE_HZ, sindy.Settings(False, 1, 0.5, 5))
        # Columns: 1, y, y', u. Steps of 1 ms and the smoother leave some per cent.
        expected = [[0.0, 0.0, 1.0, 0.0], [0.0, -64.0, -6.4, 64.0]]
        np.testing.assert_allclose(model.coefficients(), expected, rtol=0.03, atol=1e-9)
        rows = sindy.free_run(model, answer[0], known.heldout.table(["theta_in_rad"]), 1.0 / RATE_HZ, 100.0)
        self.assertLess(relative_error(rows, answer), 0.02)

    def test_the_equations_are_those_of_the_package(self):
        known, _ = case(second_order)
        x = known.train.table(known.outputs)
        u = known.train.table(["theta_in_rad", "speed_rad_s"])
        for settings in [sindy.Settings(False, 2, 0.02, 11), sindy.Settings(False, 3, 0.001, None)]:
            model = sindy.fitted(x, u, 1.0 / RATE_HZ, settings)
            rate = sindy.right_side(model)
            ours = np.array([rate(a, b) for a, b in zip(x[::100], u[::100])])
            np.testing.assert_allclose(ours, model.predict(x[::100], u=u[::100]), atol=1e-9)


class Narx(unittest.TestCase):
    def test_a_second_order_system_is_predicted_freely(self):
        known, answer = case(second_order)
        said = narx.predict(known)
        self.assertLess(relative_error(said.prediction, answer), 0.05, said.chosen)

    def test_friction_needs_sign_v(self):
        known, answer = case(relaxation)
        said = narx.predict(known)
        self.assertLess(relative_error(said.prediction, answer), 0.01, said.chosen)


class Bam(unittest.TestCase):
    TRUE = {name: 1.0 for name in bam.NOMINAL} | {"viscous": 0.03, "coulomb": 0.02, "load": 0.15}

    def test_the_right_model_and_its_parameters_are_found(self):
        # Tensions that the arm's weight makes: 2.5 kg at 30 mm on pulleys of 15 mm.
        def load(recording: Recording) -> dict[str, np.ndarray]:
            pull = 2.5 * 9.81 * np.sin(recording["theta_in_rad"])
            return {"f1_n": 30.0 + pull, "f3_n": 30.0 - pull}

        known, _ = case(lambda recording: bam.simulate(RIG, self.TRUE, recording, load(recording)))
        tensions = load(known.train)
        found = bam.searched(known, "M3", slice(None), tensions)
        self.assertAlmostEqual(found["load"], 0.15, delta=0.01)
        self.assertAlmostEqual(found["coulomb"], 0.02, delta=0.01)
        right = bam.error(bam.simulate(RIG, found, known.train, tensions), known, slice(None))
        without = bam.searched(known, "M1", slice(None), tensions)
        wrong = bam.error(bam.simulate(RIG, without, known.train, tensions), known, slice(None))
        self.assertLess(right, 0.002)
        self.assertGreater(wrong, 5.0 * right)

    def test_budgets_by_hand(self):
        speed, motor, external = np.array([0.5]), np.array([2.0]), np.array([-1.0])
        p = {"viscous": 0.1, "coulomb": 0.2, "stribeck": 0.4, "stribeck_speed": 0.5, "stribeck_exponent": 2.0}
        slow = np.exp(-1.0)
        # K_v |v| + K_c = 0.05 + 0.2; |τ_m − τ_e| = 3; |0.1·2 − 0.3·(−1)| = 0.5; |τ_m| > |τ_e|, so 0.7·(−1)².
        loads = {"motor_load": 0.1, "external_load": 0.3}
        slow_loads = {"motor_load_stribeck": 0.2, "external_load_stribeck": 0.1}
        for more, expected in [
            ({}, 0.25 + 0.4 * slow),
            ({"load": 0.1, "load_stribeck": 0.2}, 0.25 + 0.3 + (0.4 + 0.6) * slow),
            (loads | slow_loads, 0.25 + 0.5 + (0.4 + 0.5) * slow),
            (loads | slow_loads | {"motor_square": 9.0, "external_square": 0.7}, 0.75 + (0.9 + 0.7) * slow),
        ]:
            found = bam.budget(p | more, speed, motor, external)
            np.testing.assert_allclose(found, expected, err_msg=str(more))
        np.testing.assert_allclose(bam.budget({"viscous": 0.1, "coulomb": 0.2}, speed, motor, external), 0.25)

    def test_at_rest_friction_takes_what_it_can_of_the_difference(self):
        still = Recording(
            np.arange(5.0),
            {"theta_in_rad": np.full(5, 0.5), "speed_rad_s": np.zeros(5), "voltage_v": np.full(5, 1.0)},
        )
        load = {"f1_n": np.full(5, 40.0), "f3_n": np.full(5, 20.0)}
        # 1 V over 2 Ω through 0.9 N m/A is 0.45 N m; the tendons take 0.3 N m, so 0.15 N m are left over.
        for coulomb, expected_nm in [(0.1, 0.35), (0.2, 0.3)]:
            p = {name: 1.0 for name in bam.NOMINAL} | {"viscous": 0.0, "coulomb": coulomb}
            found = {name: values[0] for name, values in bam.simulate(RIG, p, still, load).items()}
            self.assertAlmostEqual(0.015 * (found["f1_n"] - found["f3_n"]), expected_nm, places=12)
            self.assertAlmostEqual(found["f1_n"] + found["f3_n"], 60.0, places=12)
            self.assertAlmostEqual(found["i_motor_a"], 0.5, places=12)


class Discrepancy(unittest.TestCase):
    def test_a_missing_spring_is_made_up_for_and_noise_is_not_learnt(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            noise = np.random.default_rng(3)

            def simulate(recording: Recording) -> dict[str, np.ndarray]:
                angle = recording["theta_in_rad"]
                own = {"spring_n": 3.0 * angle + 2.0 * angle**3, "nothing_n": angle}
                return {name: values + 0.01 * noise.normal(size=len(angle)) for name, values in own.items()}

            known, answer = case(simulate, folder)
            for name, recording in [("train", known.train), ("heldout", known.heldout)]:
                t_s = np.arange(10 * len(recording)) / 1000.0
                angle = np.interp(t_s, recording.t_s, recording["theta_in_rad"])
                table = np.column_stack([t_s, 3.0 * angle, angle])
                header = "t_s,spring_n,nothing_n"
                np.savetxt(folder / f"recalibrated-{name}.csv", table, delimiter=",", header=header, comments="")
            known.heldout_t_s = np.arange(10 * len(known.heldout)) / 1000.0
            said = discrepancy.predict(known)
            left = np.sqrt(np.mean((said.prediction[::10] - answer) ** 2, axis=0))
            # Noise of 0.01 is in the answer itself; the cubic's part is 0.1.
            self.assertLess(left.max(), 0.015, said.chosen)


class CaseFiles(unittest.TestCase):
    def test_a_sign_is_held_where_the_speed_is_lost(self):
        speed = np.array([0.0, 0.5, 0.001, -0.001, -0.5, 0.0])
        np.testing.assert_array_equal(held_sign(speed, 0.01), [0, 1, 1, 1, -1, -1])

    def test_a_run_that_leaves_the_training_data_stays_at_its_last_good_value(self):
        train = np.array([[0.0, 0.0], [1.0, 1.0]])
        prediction = np.array([[0.5, 0.5], [3.9, 0.6], [4.1, 0.7], [0.5, np.nan]])
        kept, rows = confined(prediction, train)
        self.assertEqual(rows, [2, 3])
        np.testing.assert_array_equal(kept, [[0.5, 0.5], [3.9, 0.6], [3.9, 0.7], [3.9, 0.7]])

    def test_settings_that_diverge_make_room_for_the_next(self):
        known, _ = case(relaxation)
        runs = {"far": np.linspace(0.0, 1e6, len(known.heldout)), "near": np.zeros(len(known.heldout))}
        values, settings, diverged_s = first_that_stays(known, 0, ["far", "near"], runs.__getitem__)
        self.assertEqual((settings, values.max()), ("near", 0.0))
        self.assertEqual(diverged_s, known.heldout.t_s[1])
        self.assertEqual(first_that_stays(known, 0, ["far"], runs.__getitem__)[1], "far")
        self.assertIsNone(first_that_stays(known, 0, ["near", "far"], runs.__getitem__)[2])

    def test_the_low_pass_neither_delays_nor_scales(self):
        t_s = np.arange(4000) / 1000.0
        wave = np.sin(2.0 * np.pi * t_s)
        np.testing.assert_allclose(low_pass(wave, 1000.0, 20.0)[500:-500], wave[500:-500], atol=1e-4)

    def test_fit_and_validation_part_the_rows(self):
        rows = [np.arange(100)[part] for part in split(100)]
        self.assertEqual([len(part) for part in rows], [66, 34])
        np.testing.assert_array_equal(np.concatenate(rows), np.arange(100))


if __name__ == "__main__":
    unittest.main()

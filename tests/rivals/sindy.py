"""PySINDy: sparse regression on a library of functions of an output and the inputs, for each output.

Settings are those of its own practical tips (docs/tips.rst of dynamicslab/pysindy): smoothed finite differences for
noisy data, a small library that grows, STLSQ with its ridge term, regularisation chosen by validation, prior knowledge
in the library (here sign(v)); and all variables scaled, which its maintainers advise where magnitudes differ (issue
491). Both of the package's forms stand to choice, x' = f(x, u) and x[k+1] = f(x[k], u[k]). One state for each output:
with all six in one model no free run was better than a constant. The equations are the package's; x' is integrated here by
Runge-Kutta, because `simulate` asks its solver for 1e-12, far below what is recorded.
"""

import itertools
import warnings
from typing import NamedTuple

import numpy as np
import pysindy

from case_files import (
    REGRESSORS,
    Answer,
    Case,
    Recording,
    advanced,
    bounds,
    confined,
    folds,
    relative_error,
    run,
)


class Settings(NamedTuple):
    """One candidate."""

    signed: bool
    """Whether sign(v) is an input."""
    degree: int
    threshold: float
    window: int | None
    """Samples of the derivative's smoother; none for x[k+1] = f(x[k], u[k])."""

    def inputs(self, recording: Recording) -> np.ndarray:
        """Columns of the inputs; x[k+1] is given the inputs of its own row."""
        table = recording.table(REGRESSORS if self.signed else REGRESSORS[:-1])
        return advanced(table) if self.window is None else table

    def __str__(self) -> str:
        form = "x[k+1]" if self.window is None else f"x', window {self.window}"
        return f"{form}, degree {self.degree}, threshold {self.threshold:g}{', sign(v)' if self.signed else ''}"


CANDIDATES = [
    *itertools.starmap(Settings, itertools.product([False, True], [1, 2, 3], [0.001, 0.02], [None])),
    # 11 is the package's default window.
    *itertools.starmap(Settings, itertools.product([False, True], [1, 2], [0.02], [5, 11])),
]


class Scale:
    """Zero mean and unit deviation."""

    def __init__(self, table: np.ndarray):
        self.mean = table.mean(axis=0)
        spread = table.std(axis=0)
        self.spread = np.where(spread > 0.0, spread, 1.0)

    def of(self, table: np.ndarray) -> np.ndarray:
        return (table - self.mean) / self.spread

    def back(self, table: np.ndarray) -> np.ndarray:
        return table * self.spread + self.mean


def fitted(x: np.ndarray, u: np.ndarray, dt: float, settings: Settings):
    """The package's model."""
    parts = {
        "optimizer": pysindy.STLSQ(threshold=settings.threshold),
        "feature_library": pysindy.PolynomialLibrary(degree=settings.degree),
    }
    if settings.window is None:
        model = pysindy.DiscreteSINDy(**parts)
    else:
        smoother = {"window_length": settings.window, "polyorder": 3}
        derivative = pysindy.SmoothedFiniteDifference(smoother_kws=smoother)
        model = pysindy.SINDy(differentiation_method=derivative, **parts)
    with warnings.catch_warnings():
        # An equation that loses all its terms, or a matrix of poor condition, shows in the validation.
        warnings.simplefilter("ignore")
        return model.fit(x, t=dt, u=u)


def right_side(model):
    """The model's equations as a function of one state and its inputs."""
    powers, coefficients = model.feature_library.powers_, model.coefficients()
    factors = [np.repeat(np.arange(len(row)), row) for row in powers]
    degree = max(len(row) for row in factors)
    width = powers.shape[1]
    # A product of `degree` variables each, the last of them a one where the power is lower.
    index = np.array([np.concatenate([row, np.full(degree - len(row), width)]) for row in factors], dtype=int)

    def rate(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return coefficients @ np.concatenate([x, u, [1.0]])[index].prod(axis=1)

    return rate


def free_run(model, start: np.ndarray, u: np.ndarray, dt: float, reach: float) -> np.ndarray:
    """Runs from `start`; rows are not numbers once a scaled state is beyond `reach`."""
    rate = right_side(model)
    discrete = isinstance(model, pysindy.DiscreteSINDy)
    states = np.full((len(u), len(start)), np.nan)
    x = states[0] = start
    for row in range(1, len(u)):
        before, after = u[row - 1], u[row]
        a = rate(x, before)
        if discrete:
            x = a
        else:
            middle = 0.5 * (before + after)
            b = rate(x + 0.5 * dt * a, middle)
            c = rate(x + 0.5 * dt * b, middle)
            d = rate(x + dt * c, after)
            x = x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        if not np.abs(x).max() < reach:
            break
        states[row] = x
    return states


def predict(case: Case) -> Answer:
    """Free run on the held-out inputs, each output with the settings whose worse fold is best: a model that is good on
    one stretch may diverge on another."""
    recorded = case.train.table(case.outputs)
    dt = float(np.median(np.diff(case.train.t_s)))
    scale = Scale(recorded)
    reach = float(np.abs(scale.of(np.vstack(bounds(recorded)))).max())
    x, start = scale.of(recorded), scale.of(case.initial_state())
    answer = Answer(np.empty((len(case.heldout), 0)), {})
    for output in range(len(case.outputs)):
        own = x[:, [output]]
        errors = {}
        for settings in CANDIDATES:
            table = settings.inputs(case.train)
            u = Scale(table).of(table)
            errors[settings] = 0.0
            for fit, validate in folds(len(x)):
                model = fitted(own[fit], u[fit], dt, settings)
                states, _ = confined(free_run(model, own[validate][0], u[validate], dt, reach), own)
                errors[settings] = max(errors[settings], relative_error(states, own[validate]))
        terms = {}

        def run_on_heldout(settings: Settings) -> np.ndarray:
            table = settings.inputs(case.train)
            inputs = Scale(table)
            model = fitted(own, inputs.of(table), dt, settings)
            terms[settings] = np.count_nonzero(model.coefficients())
            states = free_run(model, start[[output]], inputs.of(settings.inputs(case.heldout)), dt, reach)
            return states[:, 0] * scale.spread[output] + scale.mean[output]

        answer.take(case, output, errors, run_on_heldout, terms)
    return answer


if __name__ == "__main__":
    run(predict)

"""SysIdentPy: a polynomial NARX model of each output, with sign(v) as an input made by hand.

The package's own case study of a hysteretic damper (chapter 10 of its book, docs/en/book/10-Case-Studies.md of
wilsonrljr/sysidentpy) is the nearest to a cable in its sheath: FROLS with least squares, order by information
criterion, polynomials of degree 3, one lag, all channels divided by their largest value, and sign(v), without which
that model diverges. The rate is reduced as in its electromechanical tutorial. Degree, lags, and whether old outputs are
used at all (its NFIR models cannot diverge) are chosen by validation.
"""

import itertools
import warnings
from typing import NamedTuple

import numpy as np
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

from case_files import REGRESSORS, Answer, Case, advanced, confined, relative_error, run, split

TERMS = 25
"""Most terms of a model; the information criterion takes fewer where they do."""


class Settings(NamedTuple):
    """One candidate."""

    degree: int
    lags: int
    kind: str

    def __str__(self) -> str:
        return f"{'NARX' if self.kind == 'NARMAX' else self.kind}, degree {self.degree}, {self.lags} lags"


CANDIDATES = [
    Settings(degree, lags, kind)
    for (degree, lags), kind in itertools.product([(1, 2), (2, 1), (2, 2), (3, 1)], ["NARMAX", "NFIR"])
]


def fitted(x: np.ndarray, y: np.ndarray, settings: Settings) -> FROLS:
    """The package's model."""
    model = FROLS(
        order_selection=True,
        n_info_values=TERMS,
        info_criteria="aic",
        ylag=settings.lags,
        xlag=[list(range(1, settings.lags + 1))] * x.shape[1],
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=settings.degree),
        model_type=settings.kind,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(X=x, y=y)
    return model


def free_run(model: FROLS, x: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Predicts from inputs and as many old outputs as the model has lags."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # What overflows has diverged and is counted.
        warnings.simplefilter("ignore")
        return model.predict(X=x, y=start)


def predict(case: Case) -> Answer:
    """Free run on the held-out inputs, each output with the settings that validate best."""
    # The package's first lag is the row before; with inputs a row earlier it is the present one.
    inputs, outputs = advanced(case.train.table(REGRESSORS)), case.train.table(case.outputs)
    heldout, start = advanced(case.heldout.table(REGRESSORS)), case.initial_state()
    x_scale, y_scale = np.abs(inputs).max(axis=0), np.abs(outputs).max(axis=0)
    x_scale[x_scale == 0.0] = 1.0
    x, y = inputs / x_scale, outputs / y_scale
    fit, validate = split(len(x))
    answer = Answer(np.empty((len(case.heldout), 0)), {})
    for output in range(len(case.outputs)):
        own = y[:, [output]]
        errors = {}
        for settings in CANDIDATES:
            model = fitted(x[fit], own[fit], settings)
            rows, _ = confined(free_run(model, x[validate], own[validate][: settings.lags]), own)
            errors[settings] = relative_error(rows, own[validate])
        terms = {}

        def run_on_heldout(settings: Settings) -> np.ndarray:
            model = fitted(x, own, settings)
            terms[settings] = len(model.final_model)
            first = np.full((settings.lags, 1), start[output] / y_scale[output])
            return free_run(model, heldout / x_scale, first)[:, 0] * y_scale[output]

        answer.take(case, output, errors, run_on_heldout, terms)
    return answer


if __name__ == "__main__":
    run(predict)

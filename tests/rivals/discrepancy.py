"""scikit-learn: a Gaussian process of what the recalibrated simulation leaves over, added to that simulation.

The simulation is bowden's own, fitted and replayed before this runs: `recalibrated-train.csv` and
`recalibrated-heldout.csv`. Settings follow the user guide on Gaussian processes: a constant times an RBF
kernel with a length for each variable, plus a WhiteKernel that learns the noise; variables scaled, `normalize_y`. The
cost grows with the cube of the rows: the kernel is learnt on some of them and then held for more.
"""

import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.preprocessing import StandardScaler

from case_files import REGRESSORS, Answer, Case, Recording, recalibrated, run, split

LEARNING_ROWS = 300
"""Rows that the kernel is learnt on."""

ROWS = 1200
"""Rows that the process is conditioned on."""

CANDIDATES = ["nothing", "the inputs", "the inputs and the simulated value"]
"""What the discrepancy may depend on."""


def variables(of: str, inputs: Recording, simulated: np.ndarray) -> np.ndarray:
    """Columns that the process sees."""
    table = inputs.table(REGRESSORS)
    return np.column_stack([table, simulated]) if of == CANDIDATES[2] else table


def spread_over(rows: int, wanted: int) -> np.ndarray:
    """So many rows, evenly."""
    return np.unique(np.linspace(0, rows - 1, min(rows, wanted)).astype(int))


def fitted(z: np.ndarray, y: np.ndarray) -> GaussianProcessRegressor:
    """The package's regressor."""
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(z.shape[1]), (1e-1, 1e2)) + WhiteKernel(0.1, (1e-4, 1e1))
    learning, all_rows = spread_over(len(y), LEARNING_ROWS), spread_over(len(y), ROWS)
    with warnings.catch_warnings():
        # A variable that does not matter has its length at the bound.
        warnings.simplefilter("ignore", ConvergenceWarning)
        learnt = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0).fit(z[learning], y[learning])
    final = GaussianProcessRegressor(learnt.kernel_, normalize_y=True, optimizer=None)
    return final.fit(z[all_rows], y[all_rows])


def predict(case: Case) -> Answer:
    """The simulation at its own rate plus the process."""
    full, simulated = recalibrated(case)
    fit, validate = split(len(case.train))
    prediction, chosen = [], {}
    for output in case.outputs:
        left = case.train[output] - simulated["train"][output]
        best = (float(np.sqrt(np.mean(left[validate] ** 2))), CANDIDATES[0])
        for of in CANDIDATES[1:]:
            z = variables(of, case.train, simulated["train"][output])
            scaler = StandardScaler().fit(z)
            z = scaler.transform(z)
            found = fitted(z[fit], left[fit]).predict(z[validate])
            best = min(best, (float(np.sqrt(np.mean((left[validate] - found) ** 2))), of))
        of = chosen[output] = best[1]
        if of == CANDIDATES[0]:
            prediction.append(full[output])
            continue
        z = variables(of, case.train, simulated["train"][output])
        scaler = StandardScaler().fit(z)
        model = fitted(scaler.transform(z), left)
        ahead = scaler.transform(variables(of, case.heldout, simulated["heldout"][output]))
        found = np.interp(case.heldout_t_s, case.heldout.t_s, model.predict(ahead))
        prediction.append(full[output] + found)
    return Answer(np.column_stack(prediction), chosen)


if __name__ == "__main__":
    run(predict)

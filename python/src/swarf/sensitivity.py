"""How much of an output's variance each varied quantity explains, by SALib."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError, needs
from swarf.forces import table


def sensitivity(data: Any, output: str = "cutting_force", names: list[str] | None = None, seed: int = 0):
    """First-order sensitivity indices from the cuts of a study as they are.

    S_i = Var(E(y|x_i))/Var(y), by random balance designs on given data (RBD-FAST), with bootstrapped
    intervals. Indices of a few dozen cuts are rough; see their intervals.

    Parameters
    ----------
    data
        A study or a table, of a Sobol or Latin hypercube design over ranges.
    output
        Of which output.
    names
        Varied columns; those of the study without.
    seed
        Of the bootstrap.

    Returns
    -------
    pandas.DataFrame
        ``S1`` and half its 95 % interval ``S1_conf``, a row for each quantity.

    Notes
    -----
    Tarantola, Gatelli and Mara (2006), "Random balance designs for the estimation of first order global
    sensitivity indices", Reliab. Eng. Syst. Saf. 91:717–727, with the bias correction of Tissot and Prieur
    (2012).
    """
    analyze = needs("SALib.analyze.rbd_fast", "fit")
    chosen = list(names) if names is not None else list(getattr(data, "varied", []))
    if not chosen:
        raise SwarfError("tell the names of the varied columns")
    rows = table(data, [*chosen, output])
    values = rows[chosen].to_numpy(float)
    if len(rows) < 20 or np.any(np.ptp(values, axis=0) == 0.0):
        raise SwarfError(
            f"sensitivity needs 20 cuts or more in which all of {chosen} vary; there are {len(rows)}"
        )
    bounds = np.column_stack([values.min(axis=0), values.max(axis=0)]).tolist()
    problem = {"num_vars": len(chosen), "names": chosen, "bounds": bounds}
    # The method looks at harmonics of a sine over the sorted sample; more than a tenth of it they must not
    # be.
    harmonics = int(np.clip(len(rows) // 10, 2, 10))
    found = analyze.analyze(problem, values, rows[output].to_numpy(float), M=harmonics, seed=seed)
    return pd.DataFrame({"S1": found["S1"], "S1_conf": found["S1_conf"]}, index=chosen)

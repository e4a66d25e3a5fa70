"""Wear of the rake face by Usui's law, from the profiles that a cut has written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError


def usui(pressure: Any, sliding_speed: Any, temperature: Any, a: float, b: float) -> Any:
    """Depth worn in a time by Usui's law: dw/dt = A σ v exp(−B/T).

    Parameters
    ----------
    pressure
        Contact pressure σ (Pa); tension wears nothing.
    sliding_speed
        v (m/s), at least 0.
    temperature
        T (K), above 0.
    a
        A (1/Pa), of the pair of tool and workpiece.
    b
        B (K), of the same pair.

    Returns
    -------
    numpy.ndarray
        Wear rate (m/s).

    Notes
    -----
    Usui, Shirakashi and Kitagawa (1984), "Analytical prediction of cutting tool wear", Wear 100:129–151.
    """
    pressure, temperature = np.asarray(pressure, float), np.asarray(temperature, float)
    return a * np.maximum(pressure, 0.0) * np.asarray(sliding_speed, float) * np.exp(-b / temperature)


def rake_wear(result: Any, a: float, b: float) -> pd.DataFrame:
    """Usui's wear rate along the rake face, as the mean over the steady frames of a cut.

    The chip's mean speed V h/t, from cutting speed, feed and chip thickness, is taken for the sliding speed.
    Contact pressure and temperature are those of the points next to the face, which is hotter than they are.

    Parameters
    ----------
    result
        A `swarf.Result` that kept its frames.
    a, b
        Constants of the pair of tool and workpiece (1/Pa, K); see `usui`.

    Returns
    -------
    pandas.DataFrame
        ``wear_rate`` (m/s), its ``scatter`` over the frames, ``pressure`` (Pa) and ``temperature`` (K), over
        the distance from the edge (m).
    """
    profiles = [result.profile("rake", index) for index in range(result.profiles["rake"])]
    first = int(result.steady.start / float(result.history["travel"].iloc[-1]) * len(profiles))
    kept = [profile for profile in profiles[max(first, 1) :] if len(profile)]
    thickness = result.steady.chip_thickness.mean
    if not kept or not thickness > 0.0:
        raise SwarfError("there is no steady chip on the rake face yet: let the tool go on")
    sliding = result.cut.speed * result.cut.feed / thickness
    parts = []
    for number, profile in enumerate(kept):
        part = profile[["distance from edge (m)", "contact_pressure (Pa)", "temperature (K)"]].set_axis(
            ["distance", "pressure", "temperature"], axis=1
        )
        rate = usui(part["pressure"], sliding, part["temperature"], a, b)
        parts.append(part.assign(wear_rate=rate, frame=number))
    rows = pd.concat(parts)
    # Bins of all frames lie on one lattice; a rounding of their places shall not part them.
    cell = np.diff(np.unique(kept[-1]["distance from edge (m)"])).min(initial=np.inf)
    rows["distance"] = (rows["distance"] / cell).round(3) * cell if np.isfinite(cell) else rows["distance"]
    grouped = rows.groupby("distance")
    found = grouped[["wear_rate", "pressure", "temperature"]].mean()
    # Where the chip touches in some frames only, nothing is worn in the others.
    share = grouped.size() / len(kept)
    found["wear_rate"] *= share
    found["scatter"] = grouped["wear_rate"].std(ddof=1)
    return found[["wear_rate", "scatter", "pressure", "temperature"]]

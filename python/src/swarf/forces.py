"""What force models need, from cuts: Kienzle's constants, edge and cutting coefficients, oblique and milling
forces.

Forces are taken per width of cut. Tables are those of `swarf.Study`, or any with the columns ``feed`` (m),
``workpiece.width`` (m), ``cutting_force`` and ``thrust_force`` (N).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError, needs


@dataclass(frozen=True)
class Value:
    """A fitted value with its uncertainty.

    Attributes
    ----------
    value
        The estimate.
    error
        Standard error; nan where the fit leaves no degree of freedom.
    low, high
        Ends of the confidence interval.
    unit
        Of all four.
    """

    value: float
    error: float
    low: float
    high: float
    unit: str = ""

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.value:.5g}{unit} [{self.low:.4g}, {self.high:.4g}]"


@dataclass(frozen=True)
class Kienzle:
    """Constants of F = k_c1.1 b h^(1 − m_c), h and b in mm, F in N.

    Attributes
    ----------
    kc11
        Specific force at a chip of 1 mm by 1 mm (N/mm²).
    mc
        Exponent (-).
    scatter
        Standard deviation of the forces' logarithm around the law (-).
    feeds
        Smallest and largest feed of the fit (mm).
    """

    kc11: Value
    mc: Value
    scatter: float
    feeds: tuple[float, float]

    def force(self, feed: Any, width: Any = 1e-3) -> Any:
        """Force (N) at feeds and widths (m)."""
        h, b = np.asarray(feed) * 1e3, np.asarray(width) * 1e3
        return self.kc11.value * b * h ** (1.0 - self.mc.value)

    def __str__(self) -> str:
        low, high = self.feeds
        return f"k_c1.1 = {self.kc11}, m_c = {self.mc} for feeds of {low:g} to {high:g} mm"


def kienzle(data: Any, output: str = "cutting_force", confidence: float = 0.95) -> Kienzle:
    """Kienzle's constants of forces over feeds.

    ln(F/(b h)) = ln k_c1.1 − m_c ln h, by least squares, with Student's intervals.

    Parameters
    ----------
    data
        A study or a table; its cuts differ in the feed and, if it should be averaged over, in more.
    output
        ``cutting_force`` or ``thrust_force``.
    confidence
        Level of the intervals (-).

    Returns
    -------
    Kienzle
        At least two different feeds are needed.

    Notes
    -----
    Kienzle (1952), "Die Bestimmung von Kräften und Leistungen an spanenden Werkzeugen", VDI-Z 94:299–305.
    """
    rows = table(data, ["feed", "workpiece.width", output])
    h, b = rows["feed"].to_numpy() * 1e3, rows["workpiece.width"].to_numpy() * 1e3
    force = rows[output].to_numpy()
    if len(np.unique(h)) < 2 or np.any(force <= 0.0):
        raise SwarfError(
            f"Kienzle's law needs forces above 0 at two feeds or more; there are {len(np.unique(h))} feeds, "
            f"the least {output} is {force.min() if len(force) else float('nan'):.4g} N"
        )
    design = np.column_stack([np.ones_like(h), -np.log(h)])
    values, errors, quantile, scatter = _least_squares(design, np.log(force / (b * h)), confidence)
    span = quantile * errors
    kc11 = float(np.exp(values[0]))
    main = Value(
        kc11,
        kc11 * float(errors[0]),
        float(np.exp(values[0] - span[0])),
        float(np.exp(values[0] + span[0])),
        "N/mm²",
    )
    exponent = Value(
        float(values[1]), float(errors[1]), float(values[1] - span[1]), float(values[1] + span[1])
    )
    return Kienzle(main, exponent, scatter, (float(h.min()), float(h.max())))


@dataclass(frozen=True)
class Coefficients:
    """Cutting and edge coefficients of F/b = K_c h + K_e.

    Attributes
    ----------
    tangential, feed, radial
        Cutting coefficients K_tc, K_fc, K_rc (Pa): along the speed, normal to the machined surface, across.
    tangential_edge, feed_edge, radial_edge
        Edge coefficients K_te, K_fe, K_re (N/m).
    """

    tangential: Value
    feed: Value
    tangential_edge: Value
    feed_edge: Value
    radial: Value = Value(0.0, 0.0, 0.0, 0.0, "Pa")
    radial_edge: Value = Value(0.0, 0.0, 0.0, 0.0, "N/m")

    def __str__(self) -> str:
        def mega(v: Value) -> str:
            return f"{v.value * 1e-6:.4g} ± {v.error * 1e-6:.2g} N/mm²"

        def milli(v: Value) -> str:
            return f"{v.value * 1e-3:.4g} ± {v.error * 1e-3:.2g} N/mm"

        return (
            f"K_tc = {mega(self.tangential)}, K_fc = {mega(self.feed)}, "
            f"K_te = {milli(self.tangential_edge)}, K_fe = {milli(self.feed_edge)}"
        )


def cutting_coefficients(data: Any, confidence: float = 0.95) -> Coefficients:
    """Cutting and edge coefficients of orthogonal cuts, by straight lines over the feed.

    F_c/b = K_tc h + K_te and F_t/b = K_fc h + K_fe, with F_t the thrust.

    Parameters
    ----------
    data
        A study or a table.
    confidence
        Level of the intervals (-).

    Notes
    -----
    Altintas (2012), Manufacturing Automation, 2nd edition, section 2.2.
    """
    rows = table(data, ["feed", "workpiece.width", "cutting_force", "thrust_force"])
    h, b = rows["feed"].to_numpy(), rows["workpiece.width"].to_numpy()
    if len(np.unique(h)) < 2:
        raise SwarfError(f"edge coefficients need two feeds or more; there are {len(np.unique(h))}")
    design = np.column_stack([h, np.ones_like(h)])
    found: list[Value] = []
    for output in ("cutting_force", "thrust_force"):
        values, errors, quantile, _ = _least_squares(design, rows[output].to_numpy() / b, confidence)
        for value, error, unit in zip(values, errors, ("Pa", "N/m")):
            span = quantile * float(error)
            found.append(Value(float(value), float(error), float(value) - span, float(value) + span, unit))
    return Coefficients(found[0], found[2], found[1], found[3])


@dataclass(frozen=True)
class ShearPlane:
    """The shear plane of an orthogonal cut: what the transformation to oblique cuts takes over.

    Attributes
    ----------
    shear_stress
        On the plane, τ (Pa).
    shear_angle
        φ (rad).
    friction_angle
        β (rad), on the rake face.
    rake
        α (rad).
    """

    shear_stress: float
    shear_angle: float
    friction_angle: float
    rake: float


def shear_plane(data: Any, edges: Coefficients | None = None) -> ShearPlane:
    """Mean shear plane of orthogonal cuts of one rake angle.

    With F_c and F_t less the edge forces, β = α + atan(F_t/F_c), tan φ = r cos α/(1 − r sin α) with the chip
    thickness ratio r, and τ = (F_c cos φ − F_t sin φ) sin φ/(b h).

    Parameters
    ----------
    data
        A study or a table, with ``tool.rake_angle`` (rad) and ``chip_thickness`` (m) too.
    edges
        Whose edge coefficients are taken off; those of the same cuts without.
    """
    names = ["feed", "workpiece.width", "cutting_force", "thrust_force", "tool.rake_angle", "chip_thickness"]
    rows = table(data, names)
    edges = edges or cutting_coefficients(rows)
    h, b = rows["feed"].to_numpy(), rows["workpiece.width"].to_numpy()
    rake = rows["tool.rake_angle"].to_numpy()
    if np.ptp(rake) > 1e-9:
        raise SwarfError("a shear plane is that of one rake angle; the cuts differ in tool.rake_angle")
    along = rows["cutting_force"].to_numpy() - edges.tangential_edge.value * b
    normal = rows["thrust_force"].to_numpy() - edges.feed_edge.value * b
    ratio = h / rows["chip_thickness"].to_numpy()
    phi = np.arctan2(ratio * np.cos(rake), 1.0 - ratio * np.sin(rake))
    tau = (along * np.cos(phi) - normal * np.sin(phi)) * np.sin(phi) / (b * h)
    beta = rake + np.arctan2(normal, along)
    return ShearPlane(
        float(tau.mean()), float(phi.mean()), float(beta.mean()), float(rake[0]) if len(rake) else 0.0
    )


def oblique(
    plane: ShearPlane, inclination: float, edges: Coefficients, chip_flow: float | None = None
) -> Coefficients:
    """Cutting coefficients of an oblique cut from an orthogonal one.

    K_tc = τ/sin φ (cos(β − α) + tan i tan η sin β)/c, K_fc = τ/(sin φ cos i) sin(β − α)/c and
    K_rc = τ/sin φ (cos(β − α) tan i − tan η sin β)/c, with c² = cos²(φ + β − α) + tan² η sin² β, the normal
    friction angle tan β = tan β_a cos η in place of β, and η = i by Stabler's rule.

    Parameters
    ----------
    plane
        Of the orthogonal cut.
    inclination
        Angle of the edge to the normal of the speed, i (rad); a helix angle in milling.
    edges
        Whose edge coefficients are taken over.
    chip_flow
        η (rad), if not i.

    Notes
    -----
    Armarego and Brown (1969); Budak, Altintas and Armarego (1996), "Prediction of milling force coefficients
    from orthogonal cutting data", J. Manuf. Sci. Eng. 118:216–224.
    """
    eta = inclination if chip_flow is None else chip_flow
    phi, rake = plane.shear_angle, plane.rake
    beta = np.arctan(np.tan(plane.friction_angle) * np.cos(eta))
    c = np.hypot(np.cos(phi + beta - rake), np.tan(eta) * np.sin(beta))
    base = plane.shear_stress / (np.sin(phi) * c)
    tangential = base * (np.cos(beta - rake) + np.tan(inclination) * np.tan(eta) * np.sin(beta))
    feed = base * np.sin(beta - rake) / np.cos(inclination)
    radial = base * (np.cos(beta - rake) * np.tan(inclination) - np.tan(eta) * np.sin(beta))

    def sure(value: float) -> Value:
        return Value(float(value), float("nan"), float("nan"), float("nan"), "Pa")

    return Coefficients(
        sure(tangential), sure(feed), edges.tangential_edge, edges.feed_edge, sure(radial), edges.radial_edge
    )


def milling_forces(
    coefficients: Coefficients,
    *,
    diameter: float,
    teeth: int,
    feed_per_tooth: float,
    depth: float,
    entry: float = 0.0,
    exit: float = np.pi,
    helix: float = 0.0,
    steps: int = 720,
    slices: int = 50,
) -> pd.DataFrame:
    """Forces of an end mill over one revolution, by the mechanistic model.

    A slice of a tooth at angle φ from the normal of the feed cuts h = f_z sin φ and takes dF = (K_c h + K_e)
    dz along its speed, towards its axis and along the axis; F_x is along the feed, F_y normal to it, F_z
    along the axis.

    Parameters
    ----------
    coefficients
        Their ``tangential`` acts along the speed, ``feed`` along the radius, ``radial`` along the axis.
    diameter, depth
        Of the mill and axial depth of cut (m).
    teeth
        Their number, evenly spaced.
    feed_per_tooth
        f_z (m).
    entry, exit
        Angles between which a tooth cuts (rad): 0 to π for a slot.
    helix
        Helix angle (rad).
    steps, slices
        Angles in a revolution, and slices over the depth.

    Returns
    -------
    pandas.DataFrame
        ``Fx``, ``Fy``, ``Fz`` (N) on the workpiece's axes and ``torque`` (N m), over the angle (rad).

    Notes
    -----
    Altintas (2012), Manufacturing Automation, 2nd edition, section 2.8.
    """
    angle = (np.arange(steps) + 0.5) * 2.0 * np.pi / steps
    height = (np.arange(slices) + 0.5) * depth / slices
    lag = 2.0 * height * np.tan(helix) / diameter
    pitch = 2.0 * np.pi * np.arange(teeth) / teeth
    phi = (angle[:, None, None] - pitch[None, :, None] - lag[None, None, :]) % (2.0 * np.pi)
    cuts = (phi >= entry) & (phi <= exit)
    chip = feed_per_tooth * np.sin(phi)
    area, edge = cuts * chip * (depth / slices), cuts * (depth / slices)
    k = coefficients
    tangential = k.tangential.value * area + k.tangential_edge.value * edge
    radial = k.feed.value * area + k.feed_edge.value * edge
    axial = k.radial.value * area + k.radial_edge.value * edge
    total = {
        "Fx": -tangential * np.cos(phi) - radial * np.sin(phi),
        "Fy": tangential * np.sin(phi) - radial * np.cos(phi),
        "Fz": axial,
        "torque": tangential * diameter / 2.0,
    }
    found = {name: values.sum(axis=(1, 2)) for name, values in total.items()}
    return pd.DataFrame(found, index=pd.Index(angle, name="angle (rad)"))


def table(data: Any, columns: list[str]) -> pd.DataFrame:
    """The rows of a study that did not fail, or a table as it is, with the columns that are needed."""
    rows = data.good if hasattr(data, "good") else pd.DataFrame(data)
    missing = [name for name in columns if name not in rows]
    if missing:
        raise SwarfError(f"the table lacks {', '.join(missing)}")
    return rows.dropna(subset=columns)


def _least_squares(
    design: np.ndarray, values: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Estimates, standard errors, Student's quantile and residual deviation of a linear fit."""
    stats = needs("scipy.stats", "fit")
    # Columns of one size: a feed is a few 1e-4 m beside a constant of 1.
    scale = np.linalg.norm(design, axis=0)
    solution, *_ = np.linalg.lstsq(design / scale, values, rcond=None)
    free = len(values) - design.shape[1]
    residual = values - design @ (solution / scale)
    if free <= 0:
        nothing = np.full(design.shape[1], np.nan)
        return solution / scale, nothing, float("nan"), float("nan")
    variance = float(residual @ residual) / free
    covariance = variance * np.linalg.inv((design / scale).T @ (design / scale))
    errors = np.sqrt(np.diag(covariance)) / scale
    quantile = float(stats.t.ppf(0.5 + confidence / 2.0, free))
    return solution / scale, errors, quantile, float(np.sqrt(variance))

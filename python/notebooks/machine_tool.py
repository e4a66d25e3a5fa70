# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A machine tool that chatters
#
# A surrogate answers in microseconds, so a master can step it with a machine's vibration. Here the machine
# is one mass
# on a spring, normal to the surface; the thrust pushes the tool away, and the tool meets the waves that it
# left one
# revolution ago.

# %%
import numpy as np
import pandas as pd

import swarf

CUTS = 16
cut = swarf.Cut(
    "AISI 1045",
    speed="180 m/min",
    feed="0.1 mm",
    rake="5 deg",
    edge_radius="30 um",
    friction=0.3,
    heat="conduction",
    settings={"numerics.speed": "fast"},
)
study = swarf.study(
    cut, feed=(0.05, 0.15, "mm"), speed=(150, 210, "m/min"), n=CUTS, travel="5 feeds", folder="machine"
)
made = study.surrogate("swarf-surrogate.fmu")
made.errors

# %% [markdown]
# The law's slope tells where chatter starts: a width of cut above 2 k ζ (1 + ζ) over the slope of the
# thrust per width
# is unstable at some speed of the spindle.

# %%
MASS, FREQUENCY, DAMPING = 2.0, 400.0, 0.03  # kg, Hz, share of the critical
stiffness = MASS * (2 * np.pi * FREQUENCY) ** 2
middle = made.ranges.mean(axis=1)
step = 1e-6
near = made.predict([{**middle, "feed": middle["feed"] - step}, {**middle, "feed": middle["feed"] + step}])
slope = abs(np.diff(near["thrust_force"])[0]) / (2 * step) / 1e-3  # N/m for each m of width
limit = 2 * stiffness * DAMPING * (1 + DAMPING) / slope
print(f"slope {slope * 1e-6:.3g} N/mm², widths above {limit * 1e3:.3g} mm may chatter")


# %%
def turn(width: float, revolutions: int = 12) -> pd.Series:
    """Deflection of the tool (m) over time, after a small push."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(str(made.path))
    number = {v.name: v.valueReference for v in description.modelVariables}
    unit = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(made.path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    unit.instantiate()
    # The waves of one revolution fit the worst case: a quarter of a wave is left over.
    speed, period = middle["tool_velocity"], 5.75 / FREQUENCY
    values = {
        "tool_velocity": speed,
        "feed": middle["feed"],
        "friction": middle["friction"],
        "workpiece.width": width,
        "workpiece.revolution_length": speed * period,
    }
    unit.setReal([number[name] for name in values], list(values.values()))
    unit.setupExperiment()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    still = unit.getReal([number["thrust_force"]])[0] / stiffness
    dt = 1 / FREQUENCY / 200
    place, velocity, found = still, 1e-3, []
    for count in range(int(revolutions * period / dt)):
        unit.setReal([number["feed"]], [middle["feed"] - (place - still)])
        unit.doStep(count * dt, dt)
        force = unit.getReal([number["thrust_force"]])[0]
        damping = 2 * DAMPING * np.sqrt(stiffness * MASS) * velocity
        velocity += dt * (force - stiffness * place - damping) / MASS
        place += dt * velocity
        found.append(place - still)
    unit.terminate()
    unit.freeInstance()
    return pd.Series(found, index=np.arange(len(found)) * dt)


# %% [markdown]
# At half of that width waves die away; at four times they grow.

# %%
waves = pd.DataFrame({"half the limit": turn(0.5 * limit), "four times the limit": turn(4 * limit)}) * 1e6
waves.plot(xlabel="time (s)", ylabel="deflection (µm)")

# %%
last = waves.iloc[-len(waves) // 6 :].abs().max()
last

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
# # Friction and edge radius from measured forces
#
# Here the "measured" forces are simulated ones with a known answer, so that the calibration can be judged:
# friction
# 0.3 and an edge radius of 30 µm. Put a table of your own in their place.

# %%
import pandas as pd

import swarf
from swarf.calibration import calibrate

TRAVEL, POINTS = "6 feeds", 12
cut = swarf.Cut(
    "AISI 1045",
    speed="180 m/min",
    feed="0.1 mm",
    rake="5 deg",
    heat="conduction",
    settings={"numerics.speed": "fast"},
)

rows = []
for feed, speed in ((0.08e-3, 3.0), (0.12e-3, 3.0), (0.16e-3, 4.0)):
    real = cut.replace(feed=feed, speed=speed, friction=0.3, edge_radius="30 um")
    steady = real.run(travel=TRAVEL, frames=0).steady
    rows.append((feed, speed, steady.cutting_force.mean, steady.thrust_force.mean))
measured = pd.DataFrame(rows, columns=["feed", "speed", "cutting_force", "thrust_force"])
measured

# %% [markdown]
# A design of points in the box of friction and radius is run for each cut; least squares on quadratics
# through them
# give the answer, twice, the second time in a smaller box. A draft's forces scatter by a percent or two,
# which is
# what limits this.

# %%
found = calibrate(
    cut,
    measured,
    {"friction": (0.1, 0.6), "edge_radius": (10, 60, "um")},
    n=POINTS,
    travel=TRAVEL,
    folder="calibration",
)
print(found)
found.table

# %%
found.correlation

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
# # From a sweep of the feed to Kienzle's law and milling forces
#
# Five feeds, one force each. The price is told first; a study that was ended goes on where it was.

# %%
import numpy as np

import swarf
from swarf import forces

FEEDS = ["0.08 mm", "0.11 mm", "0.15 mm", "0.2 mm", "0.27 mm"]
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
study = swarf.study(cut, feed=FEEDS, travel="6 feeds", folder="kienzle")
study.frame[["feed", "cutting_force", "cutting_force scatter", "thrust_force", "cpu_seconds"]]

# %% [markdown]
# k_c1.1 and m_c with their intervals. Points per feed are the same for each feed, so the band of the force
# is, too:
# it moves k_c1.1 as a whole and leaves m_c nearly alone.

# %%
law = forces.kienzle(study)
print(law)
print("thrust:", forces.kienzle(study, "thrust_force"))

# %% [markdown]
# The same forces as straight lines: what the chip takes, and what the edge takes whatever the feed.

# %%
coefficients = forces.cutting_coefficients(study)
print(coefficients)

# %% [markdown]
# Taken over to an oblique edge, they give the forces of a mill with a helix of 30°.

# %%
plane = forces.shear_plane(study)
helix = np.radians(30)
mill = forces.milling_forces(
    forces.oblique(plane, helix, coefficients),
    diameter=10e-3,
    teeth=2,
    feed_per_tooth=0.1e-3,
    depth=5e-3,
    helix=helix,
)
mill[["Fx", "Fy", "Fz"]].plot(ylabel="force (N)")

# %%
study.report("kienzle.html")

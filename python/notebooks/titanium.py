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
# # Segmented chips of titanium
#
# With the law of Sima and Özel Ti-6Al-4V softens with strain, and its chip breaks up into segments. Shear
# bands need
# points: 15 over the feed is little. `numerics.speed` = `exact` keeps them sharp.

# %%
import swarf

POINTS, TRAVEL = 15, "8 feeds"
cut = swarf.Cut(
    "Ti-6Al-4V",
    speed="120 m/min",
    feed="0.1 mm",
    friction=0.2,
    heat="adiabatic",
    points_per_feed=POINTS,
    settings={"material.law": "johnson_cook_tanh", "numerics.speed": "exact"},
)
print(cut.estimate(TRAVEL))

# %%
result = cut.run(travel=TRAVEL)
print(result.steady)
result.plot("plastic_strain")

# %% [markdown]
# The force swings with the segments: its extremes within a step, and the FMU's own count of shear bands.

# %%
result.history[["travel", "cutting_force", "cutting_force_min", "cutting_force_max"]].plot(x="travel")

# %%
result.segmentation.tail()

# %%
result.report("titanium.html")

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
# # A first cut
#
# What does it take to cut steel at 180 m/min and 0.1 mm of feed? `DRAFT` keeps this notebook short; take it
# away for
# figures to rely on, and look at the bands either way.

# %%
import swarf

DRAFT = {"accuracy": "draft", "settings": {"numerics.speed": "fast"}}
cut = swarf.Cut(
    "AISI 1045",
    speed="180 m/min",
    feed="0.1 mm",
    rake="5 deg",
    edge_radius="30 um",
    friction=0.3,
    heat="conduction",
    **DRAFT,
)
print(cut.estimate("6 feeds"))

# %% [markdown]
# The estimate costs nothing. The run can be stopped at any time and gives what there is.

# %%
result = cut.run(travel="6 feeds")
print(result.steady.cutting_force)
result.steady.table()

# %% [markdown]
# The chip, and the force on the way: how much it swings decides how far the tool must go.

# %%
result.plot("temperature")

# %%
result.plot("cutting_force")

# %% [markdown]
# Pressure and temperature along the rake face, as the FMU has written them with each frame.

# %%
result.profile("rake").head()

# %% [markdown]
# A page to pass on.

# %%
result.report("cut.html")

"""A first flight: rendered, flown through twice, compared with its truth, and looked into.

  python first_flight.py FOLDER
"""
import subprocess
import sys
from pathlib import Path

import numpy as np

import deepuav

folder = Path(sys.argv[1])
flight = folder / "flight"

# %% A drone's flight with its exact path; the command line comes with the package.
if not flight.exists():
    command = [sys.executable, "-m", "deepuav", "simulate", "--flight", "orbit", "--frames", "80", "--out", flight]
    subprocess.run(command, check=True)

# %% SLAM over it, as `deepuav run` does.
result = deepuav.run(flight, out=folder / "run", use="camera")
for found in result.maps:
    print(f"map {found.id}: {found.keyframes} keyframes, {found.landmarks} landmarks, {found.gauge}")

# %% How far off is it?
error = deepuav.evaluate(flight, folder / "run/trajectory.txt", align="sim3")
print(f"ATE {error.ate_m.rmse:.3f} m over {error.pairs} poses, scale {error.scale:.3f}")

# %% The map, from its file.
world = deepuav.Map.load(folder / "run/map.deepuav")
low, high = np.percentile(world.points, [5, 95], axis=0)
print(f"{len(world.points)} points, most of them within {np.round(high - low, 2)}")

# %% What do the first and a later image have in common?
images = sorted((flight / "mav0/cam0/data").iterdir())
matches = deepuav.match(images[0], images[min(10, len(images) - 1)])
print(f"{len(matches.score)} matches, the median score is {np.median(matches.score):.2f}")

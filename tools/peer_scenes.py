"""The scenes of tools/peers, and the volumes that they need."""

import subprocess
import sys

from peer_renderers import CLOUD, DENSITY, HEAD, ISOVALUE, SIZE, TOOLS, tool

MARCHED = """[volume]
path = "cloud256.npy"
spacing = [0.0078125, 0.0078125, 0.0078125]
{content}
[[light]]
type = "environment"
radiance = [0.5, 0.5, 0.5]
[[light]]
type = "directional"
direction = [-3.0, -3.0, -2.0]
irradiance = [3.0, 3.0, 3.0]
[camera]
eye = [0.8, 0.6, 3.2]
target = [0.0, 0.0, 0.0]
fov_y = 40.0
[render]
size = [512, 512]
"""
MEDIUM = f"""[medium]
density = {DENSITY}
[[medium.transfer]]
value = 0.0
opacity = 0.0
[[medium.transfer]]
value = 1.0
opacity = 1.0"""
SURFACE = f"""[[surfaces.iso]]
value = {ISOVALUE}"""

# Mitsuba interpolates extinctions, Isolume values, which is the same on a straight line that holds all values: those
# above air, up to what bone hides. The less there is of that, the less has Mitsuba to reject.
AIR, DENSE, BONE = 38, 110, 92
IN_FLESH = f"""[volume]
path = "head.npy"
spacing = [1.57774, 0.995861, 1.00797]
[medium]
density = 0.13
[[medium.transfer]]
value = 0
opacity = 0.0
color = [0.98, 0.84, 0.74]
[[medium.transfer]]
value = {DENSE - AIR}
opacity = 1.0
color = [0.98, 0.84, 0.74]
[surfaces]
light = "full"
normals = "analytic"
[[surfaces.iso]]
value = {BONE - AIR}
shading = "lambert"
color = [0.86, 0.80, 0.68]
[[light]]
type = "directional"
direction = [0.5, 0.7, -0.6]
irradiance = [4.2, 3.9, 3.4]
[[light]]
type = "environment"
radiance = [0.13, 0.16, 0.21]
[camera]
eye = [215, -530, 25]
target = [2, 0, 5]
up = [0, 0, 1]
fov_y = 27
[render]
size = [{SIZE}, {SIZE}]
"""


def make_cloud(folder):
    if not (folder / CLOUD).exists():
        subprocess.run([sys.executable, TOOLS / "make_cloud", folder], stdout=subprocess.DEVNULL, check=True)


def make_dense_cloud(folder):
    import numpy as np

    if not (folder / "cloud256.npy").exists():
        cloud = tool("make_cloud")
        np.save(folder / "cloud256.npy", cloud.cloud(256).astype(np.float32))
    (folder / "march.toml").write_text(MARCHED.format(content=MEDIUM))
    (folder / "surface.toml").write_text(MARCHED.format(content=SURFACE))


def make_head(folder):
    """Slices from the neck up."""
    import nrrd
    import numpy as np

    values, _ = nrrd.read(str(TOOLS / "sample/vismale.nrrd"))
    np.save(folder / "head.npy", np.ascontiguousarray(np.clip(values.T[::-1], AIR, DENSE) - AIR))
    (folder / HEAD).write_text(IN_FLESH)

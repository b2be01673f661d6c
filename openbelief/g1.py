"""The Unitree G1's body: where its camera and lidar sit, and how its colour camera looks (priors: calibrate yours).

From g1_29dof_rev_1_0.urdf, with torso_link 0.835 m above the floor on a standing robot. `base_link` lies on the floor
under the robot, x forward, y left.
"""

from __future__ import annotations

import numpy as np

from openbelief.observation import Intrinsics
from openbelief.pose import T_CAMERA_LINK_OPTICAL, quaternion_from_rpy, transform

TORSO_HEIGHT_M = 0.83513  # puts the camera 1.265 m above the floor
BODY_RADIUS_M = 0.25  # shoulders and elbows of a G1 that stands with its arms down

# base_link -> camera_link (x forward): the D435i looks 47.6 degrees down
T_BASE_CAMERA_LINK = transform([0.0576235, 0.01753, TORSO_HEIGHT_M + 0.42987], quaternion_from_rpy(0, 0.8307767, 0))
T_BASE_CAMERA = T_BASE_CAMERA_LINK @ T_CAMERA_LINK_OPTICAL
# base_link -> livox_frame: the MID-360 hangs upside down
T_BASE_LIDAR = transform([0.0002835, 0.00003, TORSO_HEIGHT_M + 0.428434], quaternion_from_rpy(np.pi, 0.0511207, 0))

# D435i colour, 640x480: aligned RGB-D sees no more than the colour camera's 42.5 degrees of height
COLOR_VERTICAL_FOV = np.deg2rad(42.5)
_FOCAL_PX = float(240 / np.tan(COLOR_VERTICAL_FOV / 2))
COLOR_INTRINSICS = Intrinsics(width=640, height=480, fx=_FOCAL_PX, fy=_FOCAL_PX, cx=319.5, cy=239.5)

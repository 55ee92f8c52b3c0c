"""Ray-cast scenes with exact edge truth, and the noise of range scanners.

A scene is a list of solids, `renderScene` what a camera sees of it, and each noise model turns that into what a scanner
would deliver. Coordinates are those of the camera, x to the right, y down, z away from the viewer, in any one unit.
"""

from .cameras import Camera, abwCamera, kinectCamera, orthographicCamera, perceptronCamera, pinholeCamera
from .rendering import Rendering, renderScene
from .scans import Scan, abwNoise, gaussianNoise, kinectNoise, perceptronNoise, triangulationNoise
from .scenes import curvedScene, demoScene, planePair, polyhedraScene, roof, step, twoCylinders
from .solids import Solid, box, cone, cylinder, plane, polyhedron, sphere

__all__ = [
    "Camera",
    "Rendering",
    "Scan",
    "Solid",
    "abwCamera",
    "abwNoise",
    "box",
    "cone",
    "curvedScene",
    "cylinder",
    "demoScene",
    "gaussianNoise",
    "kinectCamera",
    "kinectNoise",
    "orthographicCamera",
    "perceptronCamera",
    "perceptronNoise",
    "pinholeCamera",
    "plane",
    "planePair",
    "polyhedraScene",
    "polyhedron",
    "renderScene",
    "roof",
    "sphere",
    "step",
    "triangulationNoise",
    "twoCylinders",
]

"""How far every pixel is from the nearest edge, and which edge that is.

python samples/distance_map.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]
"""

import cv2
import numpy as np
from common import load, parser, sheet, write

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    edges = rangeedge.detectEdges(src, **geometry)
    distance, nearest = rangeedge.distanceTransformWithLabels(edges)
    print(f"up to {distance.max():.1f} pixels from an edge")

    write(
        args.out,
        "distance_map.png",
        sheet(
            ("distance to the nearest edge, a line every 10 pixels", contoured(distance)),
            ("direction to the nearest edge", directions(nearest)),
        ),
    )


def contoured(distance):
    picture = rangeedge.colorizeDistance(distance)
    step = np.floor(distance / 10)
    line = np.zeros(distance.shape, bool)
    line[:, 1:] |= step[:, 1:] != step[:, :-1]
    line[1:] |= step[1:] != step[:-1]
    picture[line] = 200
    return picture


def directions(nearest):
    """Hue by the direction to the nearest edge, as optical flow is shown."""
    y, x = np.indices(nearest.shape, np.float32)
    to_y, to_x = np.unravel_index(np.maximum(nearest, 0), nearest.shape)
    angle = cv2.phase(to_x - x, to_y - y, angleInDegrees=True) / 2
    half, full = (np.full(nearest.shape, level, np.uint8) for level in (130, 230))
    hsv = cv2.merge([angle.astype(np.uint8), half, full])
    picture = cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)
    picture[nearest == np.arange(nearest.size).reshape(nearest.shape)] = 0
    return picture


if __name__ == "__main__":
    main()

"""The detector once more, slowly: what the kernels compute, written for reading.

Geometry is done on points and tangents in space, fits by linear algebra on the samples themselves, with nothing
carried over from one step to the next. Only splitting is done in the precision of the image, as the kernels do it.

`curves` has the curves of segments and the noise of fits, `lines` range images and their scan lines, `approximation`
splits and merges these, `edges` measures what is between two segments, `neighbours` joins that from line to line and
makes maps of it.
"""

from .approximation import midpoint, split
from .edges import edge_points
from .lines import Image
from .neighbours import edge_strength

__all__ = ["Image", "edge_points", "edge_strength", "midpoint", "split"]

"""The named constants, in families as OpenCV's."""

# Directions of scan lines (bits).
DIR_ROWS = 1
DIR_COLS = 2
DIR_DIAG45 = 4  # from lower left to upper right
DIR_DIAG135 = 8  # from upper left to lower right
DIR_ALL = DIR_ROWS | DIR_COLS | DIR_DIAG45 | DIR_DIAG135

# How the curve of a segment is found.
FIT_LSQ = 0  # least squares over all pixels, a quadratic only where it is significant
FIT_INTERP = 1  # through both end points and the midpoint

# Where strengths are measured.
MEASURE_MIDPOINT = 0  # both curves at the edge position
MEASURE_ENDPOINT = 1  # extrapolated from the end point of either segment

# How directions are combined into one crease angle.
CREASE_MAX = 0  # the largest of the directional angles
CREASE_NORMAL = 1  # the angle between the two surface normals

# What an edge pixel is (bits of `kind`).
EDGE_JUMP = 1
EDGE_CONVEX = 2
EDGE_CONCAVE = 4
EDGE_OCCLUDING = 8  # nearer side of a jump
EDGE_OCCLUDED = 16  # farther side of a jump
EDGE_BOUNDARY = 32  # valid pixel beside an invalid one

# What `cleanDepth` has done to a pixel (bits).
CLEAN_SMOOTHED = 1
CLEAN_REMOVED = 2
CLEAN_FILLED = 4

# How an edge map is thinned.
THIN_SKELETON = 0  # skeleton after Zhang and Suen
THIN_LEE = 1  # skeleton after Lee, Kashyap and Chu
THIN_ITERATIVE = 2  # thinning after Guo and Hall
THIN_MEDIAL = 3  # along the middle of every band

# How salience weighs a distance.
SALIENCE_MULTIPLICATIVE = 0  # min |p - q| / s(q)
SALIENCE_ADDITIVE = 1  # sqrt(min |p - q|^2 + f(q)), f = lambda^2 (1 / s^2 - 1)

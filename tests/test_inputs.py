"""What people have and what they expect of it: one line each, read right or refused in words that name the way out."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
import tifffile
from numpy.testing import assert_allclose, assert_array_equal

import rangeedge
from rangeedge import imreadRange
from rangeedge.io.geotiff import METRES_PER_DEGREE
from rangeedge.io.pictures import read_png

NAN = np.nan
ROWS, COLS = 6, 9
MILLIMETRES = (1000 + np.arange(ROWS * COLS, dtype=np.uint16)).reshape(ROWS, COLS)
MILLIMETRES[1, 2] = 0
DEPTH = (MILLIMETRES / 1000).astype(np.float32)
HOLES = np.where(MILLIMETRES == 0, np.float32(NAN), DEPTH)
HEIGHTS = (MILLIMETRES.astype(np.int16) - 1020).astype(np.int16)  # some are below zero
_V, _U = np.indices((ROWS, COLS))
POINTS = np.stack([(_U - 4) * DEPTH / 50, (_V - 2) * DEPTH / 50, HOLES], axis=-1).astype(np.float32)
POINTS[1, 2] = NAN


class Input(NamedTuple):
    kind: str
    content: bytes | None  # None: what makes it is not installed
    right: np.ndarray | str  # the array that it holds, or part of the reason for which it is refused
    geometry: dict[str, Any] = {}  # noqa: RUF012


def text(*lines: Any, ending: str = "\n") -> bytes:
    return "".join(f"{line}{ending}" for line in lines).encode()


def encoded(suffix: str, array: np.ndarray) -> bytes:
    return cv2.imencode(suffix, array)[1].tobytes()


# TIFF


def tiff(array: np.ndarray, **options: Any) -> bytes | None:
    stream = io.BytesIO()
    try:
        tifffile.imwrite(stream, array, **{"photometric": "minisblack", **options})
    except (ImportError, ValueError, KeyError):  # a compression that needs imagecodecs
        return None
    return stream.getvalue()


def pages(*arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    with tifffile.TiffWriter(stream) as writer:
        for array, reduced in arrays:
            writer.write(array, photometric="minisblack", subfiletype=int(reduced))
    return stream.getvalue()


def nodata(value: str) -> tuple[Any, ...]:
    return (42113, "s", 0, value, True)


def geo(*keys: tuple[int, int], scale=(0.5, 0.25, 0.0), tie=(0, 0, 0, 1000.0, 2000.0, 0)) -> list[tuple[Any, ...]]:
    directory = [1, 1, 0, len(keys), *(word for key, value in keys for word in (key, 0, 1, value))]
    return [(33550, "d", 3, scale, True), (33922, "d", 6, tie, True), (34735, "H", len(directory), directory, True)]


def holes_of(value: Any) -> np.ndarray:
    """DEPTH, or MILLIMETRES for an integer, with a value of no data."""
    return np.where(MILLIMETRES == 0, value, DEPTH if isinstance(value, np.floating) else MILLIMETRES)


LOWEST = np.finfo(np.float32).min
MIDDLE = np.deg2rad(60 - 3 / 3600)  # latitude of the middle of an image whose upper border is at 60 degrees
SECONDS = {"scale": (1 / 3600, 1 / 3600, 0), "tie": (0, 0, 0, 10, 60, 0)}
SECOND = METRES_PER_DEGREE / 3600
TURNED = (34264, "d", 16, (3, 4, 0, 7, 4, -3, 0, 9, *[0] * 7, 1), True)
CENTIMETRES = np.where(MILLIMETRES == 0, np.int16(-9999), HEIGHTS)
UNHURT = np.where(MILLIMETRES == 0, np.int16(-32768), HEIGHTS)
METADATA = '<Item name="OFFSET" sample="0" role="offset">7</Item><Item name="SCALE" role="scale">0.5</Item>'
SCALE = (42112, "s", 0, f"<GDALMetadata>{METADATA}</GDALMetadata>", True)
UNHURT_METRES = np.where(MILLIMETRES == 0, NAN, HEIGHTS / 2 + 7)
POINTS64 = POINTS.astype(float)
CONTIG = {"planarconfig": "contig"}
HALF_CELLS = {"pixelSize": (0.5, 0.25), "heightMap": True}
MAIN_TIFF = [
    Input("TIFF uint16", tiff(MILLIMETRES), MILLIMETRES),
    Input("TIFF float32 of holes", tiff(HOLES), HOLES),
    Input("TIFF float64", tiff(DEPTH.astype(float)), DEPTH.astype(float)),
    Input("TIFF float16", tiff(DEPTH.astype(np.float16)), DEPTH.astype(np.float16)),
    Input("TIFF int16", tiff(HEIGHTS), HEIGHTS),
    Input("TIFF int32", tiff(HEIGHTS.astype(np.int32)), HEIGHTS.astype(np.int32)),
    Input("TIFF uint32", tiff(MILLIMETRES.astype(np.uint32)), MILLIMETRES.astype(np.uint32)),
    Input("TIFF big-endian", tiff(HOLES, byteorder=">"), HOLES),
    Input("BigTIFF", tiff(HOLES, bigtiff=True), HOLES),
    Input("TIFF in tiles", tiff(np.pad(HOLES, ((0, 30), (0, 20))), tile=(16, 16)), np.pad(HOLES, ((0, 30), (0, 20)))),
    Input("TIFF in strips of two rows", tiff(HOLES, rowsperstrip=2), HOLES),
    Input("TIFF deflate", tiff(HOLES, compression="deflate"), HOLES),
    Input("TIFF deflate, predictor, int16", tiff(HEIGHTS, compression="deflate", predictor=2), HEIGHTS),
    Input("TIFF deflate, float predictor", tiff(HOLES, compression="deflate", predictor=3), HOLES),
    Input("TIFF PackBits", tiff(MILLIMETRES, compression="packbits"), MILLIMETRES),
    Input("TIFF LZMA", tiff(HOLES, compression="lzma"), HOLES),
    Input("TIFF LZW by OpenCV", encoded(".tiff", HOLES), HOLES),
    Input("TIFF LZW, predictor", tiff(MILLIMETRES, compression="lzw", predictor=2), MILLIMETRES),
    Input("TIFF ZSTD", tiff(HOLES, compression="zstd"), HOLES),
    Input("TIFF LERC", tiff(DEPTH, compression="lerc"), DEPTH),
    Input("TIFF LERC with holes", tiff(HOLES, compression="lerc"), HOLES),
    Input(
        "TIFF LERC and ZSTD",
        tiff(DEPTH, compression="lerc", compressionargs={"compression": "zstd"}),
        DEPTH,
    ),
    Input("TIFF x, y, z LERC", tiff(np.nan_to_num(POINTS), compression="lerc", **CONTIG), np.nan_to_num(POINTS)),
    Input("TIFF JPEG XL", tiff(MILLIMETRES, compression="jpegxl"), "compressed by JPEG XL"),
    Input("TIFF x, y, z interleaved (MVTec 3D-AD)", tiff(POINTS, planarconfig="contig"), POINTS),
    Input("TIFF x, y, z in planes", tiff(np.moveaxis(POINTS, 2, 0), planarconfig="separate"), POINTS),
    Input("TIFF x, y, z LZW, predictor", tiff(POINTS, compression="lzw", predictor=3, **CONTIG), POINTS),
    Input("TIFF x, y, z float64 deflate", tiff(POINTS64, compression="zlib", **CONTIG), POINTS64),
    Input("TIFF with overviews", pages((HOLES, False), (HOLES[::2, ::2], True)), HOLES),
    Input("TIFF of several images", pages((HOLES, False), (HOLES, False), (HOLES, False)), "holds 3 images"),
    Input("TIFF float RGB", tiff(np.abs(np.nan_to_num(POINTS)), photometric="rgb"), "holds colours"),
    Input("TIFF x, y, z called RGB by tifffile", tiff(POINTS, photometric="rgb"), POINTS),
    Input("TIFF x, y, z called RGB by others", tiff(POINTS, photometric="rgb", software="HAL"), "holds colours"),
    Input("TIFF x, y, z by cv2.imwrite", encoded(".tiff", POINTS), "pass them as an array|compressed by method 34676"),
    Input(
        "TIFF ZSTD, x, y, z in planes",
        tiff(np.moveaxis(POINTS, 2, 0), planarconfig="separate", compression="zstd"),
        POINTS,
    ),
    Input("TIFF 8 bits", tiff(MILLIMETRES.astype(np.uint8)), "8 bits"),
    Input("TIFF two channels", tiff(np.dstack([DEPTH, DEPTH]), planarconfig="contig"), "2 channels"),
    Input("TIFF JPEG 8 bits", tiff(MILLIMETRES.astype(np.uint8), compression="jpeg"), "8 bits"),
    Input("GDAL nodata -9999", tiff(holes_of(np.float32(-9999)), extratags=[nodata("-9999")]), HOLES),
    Input("GDAL nodata -3.4e38", tiff(holes_of(LOWEST), extratags=[nodata("-3.4028234663852886e+38")]), HOLES),
    Input("-3.4e38 without a tag", tiff(holes_of(LOWEST)), HOLES),
    Input("GDAL nodata nan", tiff(HOLES, extratags=[nodata("nan")]), HOLES),
    Input("GDAL nodata 65535", tiff(holes_of(np.uint16(65535)), extratags=[nodata("65535")]), MILLIMETRES),
    Input("GDAL nodata -9999, int16", tiff(CENTIMETRES, extratags=[nodata("-9999")]), UNHURT),
    Input("GDAL nodata out of range", tiff(MILLIMETRES, extratags=[nodata("-9999")]), MILLIMETRES),
    Input("GDAL nodata garbled", tiff(DEPTH, extratags=[nodata("none")]), "GDAL_NODATA holds 'none'"),
    Input("GeoTIFF in metres", tiff(HOLES, extratags=geo((1024, 1), (1025, 1))), HOLES, HALF_CELLS),
    Input("GeoTIFF int16", tiff(HEIGHTS, extratags=geo((1024, 1))), HEIGHTS, {**HALF_CELLS, "depthFactor": 1.0}),
    Input(
        "GeoTIFF in degrees (SRTM)",
        tiff(HOLES, extratags=geo((1024, 2), **SECONDS)),
        HOLES,
        {"pixelSize": (SECOND * np.cos(MIDDLE), SECOND), "heightMap": True},
    ),
    Input("GeoTIFF turned", tiff(HOLES, extratags=[TURNED]), HOLES, {"pixelSize": (5, 5), "heightMap": True}),
    Input("GDAL scale and offset", tiff(CENTIMETRES, extratags=[nodata("-9999"), SCALE]), UNHURT_METRES),
    Input(
        "GDAL scale garbled", tiff(CENTIMETRES, extratags=[(42112, "s", 0, 'role="scale">a<', True)]), "scale is 'a'"
    ),
    Input("pixel scale without a place", tiff(HOLES, extratags=geo()[:1]), HOLES),
]

# EXR


def exr(*parts: dict[str, np.ndarray], compression: str = "ZIP") -> bytes | None:
    try:
        import OpenEXR
    except ImportError:
        return None
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": OpenEXR.scanlineimage}
    stream = io.BytesIO()
    whole = [OpenEXR.Part({**header, "name": f"part{i}"}, part) for i, part in enumerate(parts)]
    OpenEXR.File(whole).write(stream)
    return stream.getvalue()


BLENDER = np.where(MILLIMETRES == 0, np.float32(1e10), DEPTH)
HALF = HOLES.astype(np.float16)
RGB = {colour: HOLES * k for k, colour in enumerate("RGB", 1)}
LAYERS = {"View.Depth.V": HOLES, "View.Mist.Z": DEPTH, **{f"View.Normal.{axis}": DEPTH for axis in "XYZ"}}
EXR = [
    Input("EXR Z", exr({"Z": HOLES}), HOLES),
    Input("EXR Z of Blender, 1e10 behind", exr({**RGB, "A": HOLES, "Z": BLENDER}), HOLES),
    Input("EXR half", exr({"Z": HALF}), HALF.astype(np.float32)),
    Input("EXR PIZ", exr({"Y": HOLES}, compression="PIZ"), HOLES),
    Input("EXR V alone", exr({"V": HOLES}), HOLES),
    Input("EXR grey as R = G = B", exr(dict.fromkeys("RGB", HOLES)), HOLES),
    Input("EXR colours", exr(RGB), "render the depth pass"),
    Input("EXR X, Y, Z", exr(dict(zip("XYZ", np.moveaxis(POINTS, 2, 0).copy(), strict=True))), POINTS),
    Input("EXR in parts", exr(RGB, {"Depth.Z": HOLES}), HOLES),
    Input("EXR layers", exr(LAYERS), HOLES),
    Input("EXR two depths", exr({"left.Z": DEPTH, "right.Z": DEPTH}), "left.Z, right.Z is meant"),
]

# Pictures and arrays


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(rows: int, cols: int, pixels: bytes, interlaced: int = 0) -> bytes:
    header = struct.pack(">IIBBBBB", cols, rows, 16, 0, 0, 0, interlaced)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


def png_in_passes(pixels: np.ndarray) -> bytes:
    """Interlaced after Adam M. Costello."""
    parts = [
        *(pixels[::8, ::8], pixels[::8, 4::8], pixels[4::8, ::4], pixels[::4, 2::4]),
        *(pixels[2::4, ::2], pixels[::2, 1::2], pixels[1::2]),
    ]
    lines = b"".join(b"\0" + row.astype(">u2").tobytes() for part in parts if part.size for row in part)
    return png(*pixels.shape, lines, interlaced=1)


def grid(*cells: str) -> bytes:
    head = (f"ncols {COLS}", f"NROWS {ROWS}", "xllcorner 100", "yllcorner 200", *cells, "NODATA_value -9999")
    return text(*head, *(" ".join(map(str, row)) for row in CENTIMETRES))


HEIGHTS64 = np.where(CENTIMETRES == -9999, NAN, CENTIMETRES)


def npy(array: np.ndarray, **options: Any) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


PNG = encoded(".png", MILLIMETRES)
UPWARD = HOLES[::-1].astype("<f4").tobytes()
RECORDS = np.zeros((ROWS, COLS), [("z", "<f4"), ("x", "<f4"), ("rgb", "<u4"), ("y", "<f4")])
for _axis in "xyz":
    RECORDS[_axis] = POINTS[..., "xyz".index(_axis)]
K = np.array([[50.0, 0, 4], [0, 50, 2], [0, 0, 1]])

PICTURES = [
    Input("PNG uint16", PNG, MILLIMETRES),
    Input("PNG colours", encoded(".png", np.dstack([MILLIMETRES] * 3)), "holds colours"),
    Input("PNG 8 bits", encoded(".png", MILLIMETRES.astype(np.uint8)), "8 bits are too coarse"),
    Input("PNG with a flipped bit", PNG[:60] + bytes([PNG[60] ^ 1]) + PNG[61:], "check sum"),
    Input("PNG that promises more", png(ROWS + 1, COLS, bytes(ROWS * (1 + 2 * COLS))), "truncated: 114 bytes"),
    Input("PNG of 2^30 pixels", png(2**15, 2**15, b""), "pixels are more than"),
    Input("JPEG", encoded(".jpg", MILLIMETRES.astype(np.uint8)), "a JPEG"),
    Input("BMP", encoded(".bmp", MILLIMETRES.astype(np.uint8)), "8 bits"),
    Input("PGM 16 bits", encoded(".pgm", MILLIMETRES), MILLIMETRES),
    Input("PGM 12 bits, comment", b"P5 # by hand\n9 6\n4095\n" + MILLIMETRES.astype(">u2").tobytes(), MILLIMETRES),
    Input("PGM as text", text("P2", "9 6", "65535", *(" ".join(map(str, row)) for row in MILLIMETRES)), MILLIMETRES),
    Input("PGM beyond its top", b"P5 9 6\n1010\n" + MILLIMETRES.astype(">u2").tobytes(), "outside of 0 to 1010"),
    Input("PGM with a smaller size", b"P5 9 4\n65535\n" + MILLIMETRES.astype(">u2").tobytes(), "where 72 are needed"),
    Input("PFM", b"Pf\n9 6\n-1.0\n" + UPWARD, HOLES),
    Input("PFM with a comment", b"Pf\n# depth in metres\n9 6\n-1.0\n" + UPWARD, HOLES),
    Input("PFM with CR LF", b"Pf\r\n9 6\r\n-1.0\r\n" + UPWARD, HOLES),
    Input("PFM with a trailing byte", b"Pf\n9 6\n-1.0\n" + UPWARD + b"\n", HOLES),
    Input("PFM colours", b"PF\n9 6\n-1.0\n" + UPWARD * 3, "holds colours"),
    Input("NPY float32", npy(HOLES), HOLES),
    Input("NPY (H, W, 1)", npy(HOLES[..., None]), HOLES),
    Input("NPY records of PointCloud2", npy(RECORDS), POINTS),
    Input("NPY (N, 3)", npy(np.zeros((500, 3))), "organized cloud"),
    Input("NPY objects", npy(np.array([{}, {}]), allow_pickle=True), "no range image"),
    Input("NPY bool", npy(HOLES > 0), "shape"),
    Input("NPZ with K", npz(depth=HOLES, K=K), HOLES, {"K": K}),
    Input("NPZ of several", npz(left=HOLES, right=HOLES), "none of its arrays"),
    Input("pickle", b"\x80\x04\x95rest", "a pickle"),
    Input("gzip", b"\x1f\x8b\x08\x00", "unpack it first"),
    Input("HDF5", b"\x89HDF\r\n\x1a\n", "numpy.save"),
    Input("LAS", b"LASF" + bytes(200), "unorganized"),
    Input("nothing", b"", "it is empty"),
    Input("ASCII grid", grid("cellsize 0.5"), HEIGHTS64, {"pixelSize": (0.5, 0.5), "heightMap": True}),
    Input("ASCII grid of oblong cells", grid("DX 0.5", "DY 0.25"), HEIGHTS64, HALF_CELLS),
    Input("ASCII grid without its cells", grid(), "no proper CELLSIZE"),
    Input("PNG interlaced", png_in_passes(MILLIMETRES), MILLIMETRES),
    Input("a poem", text("Roses are", "red", "violets"), "none of PNG"),
]

# Clouds


def lzf(data: bytes) -> bytes:
    """LZF without any repetition."""
    runs = [data[i : i + 32] for i in range(0, len(data), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def pcd(data: str, body: bytes, ending: str = "\n", **changes: Any) -> bytes:
    lines = {
        **{"VERSION": ".7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": COLS},
        **{"HEIGHT": ROWS, "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": ROWS * COLS, **changes, "DATA": data},
    }
    present = [f"{key} {value}" for key, value in lines.items() if value is not None]
    return text("# .PCD v.7 - Point Cloud Data file format", *present, ending=ending) + body


def ply(*lines: str, body: bytes, ending: str = "\n", encoding: str = "binary_little_endian") -> bytes:
    return text("ply", f"format {encoding} 1.0", *lines, "end_header", ending=ending) + body


XYZ = ("property float x", "property float y", "property float z")
SIZE = (f"obj_info num_cols {COLS}", f"obj_info num_rows {ROWS}")
VERTICES = f"element vertex {ROWS * COLS}"
FLAT = POINTS.reshape(-1, 3)
PLAIN = POINTS.tobytes()
PLANES = np.moveaxis(POINTS, 2, 0).tobytes()


def rows(nan: str) -> bytes:
    """Points as text, one a line."""
    return text(*(" ".join(nan if np.isnan(v) else repr(float(v)) for v in point) for point in FLAT))


OTHER_ORDER = np.zeros(ROWS * COLS, [("intensity", "<u2"), ("z", "<f8"), ("x", "<f4"), ("y", "<f8")])
for _axis in "xyz":
    OTHER_ORDER[_axis] = FLAT[:, "xyz".index(_axis)]

SHORTS = np.nan_to_num(FLAT * 1000).astype("<i2")
PACKED = struct.pack("<II", len(lzf(PLANES)), len(PLANES)) + lzf(PLANES)
MIXED = {"FIELDS": "intensity z x y", "SIZE": "2 8 4 8", "TYPE": "U F F F", "COUNT": "1 1 1 1"}
OLD = {"VERSION": None, "FIELDS": None, "COLUMNS": "x y z", "VIEWPOINT": None}
BACKWARD = ("property double z", "property float y", "property float x")
BACKWARD_BODY = b"".join(struct.pack(">dff", z, y, x) for x, y, z in FLAT)

CLOUDS = [
    Input("PCD binary", pcd("binary", PLAIN), POINTS),
    Input("PCD compressed", pcd("binary_compressed", PACKED), POINTS),
    Input("PCD ascii", pcd("ascii", rows("nan")), POINTS),
    *(
        Input(f"PCD ascii, {nan}", pcd("ascii", rows(nan)), POINTS)
        for nan in ("1.#QNAN", "-1.#IND", "-nan(ind)", "nan(0x8000000000000)", "1.#INF", "-1.#IO", "-NaN", "inf")
    ),
    Input("PCD ascii, decimal commas", pcd("ascii", rows("nan").replace(b".", b",")), r"holds '[^']+' where a number"),
    Input("PCD with CR LF", pcd("binary", PLAIN, ending="\r\n"), POINTS),
    Input("PCD with lone CR", pcd("binary", PLAIN, ending="\r"), POINTS),
    Input("PCD ascii, 0.5", pcd("ascii", rows("nan"), **OLD), POINTS),
    Input("PCD z x y as doubles", pcd("binary", OTHER_ORDER.tobytes(), **MIXED), POINTS),
    Input(
        "PCD int16",
        pcd("binary", SHORTS.tobytes(), SIZE="2 2 2", TYPE="I I I"),
        SHORTS.reshape(POINTS.shape).astype("f4"),
    ),
    Input("PCD unorganized", pcd("binary", PLAIN, WIDTH=ROWS * COLS, HEIGHT=1), "save the organized cloud"),
    Input("PCD cut", pcd("binary", PLAIN[:-1]), "truncated"),
    Input("PCD without x", pcd("binary", PLAIN, FIELDS="range azimuth ring"), "no x, y and z but range, azimuth, ring"),
    Input("PLY", ply(*SIZE, VERTICES, *XYZ, body=PLAIN), POINTS),
    Input("PLY with CR LF", ply(*SIZE, VERTICES, *XYZ, body=PLAIN, ending="\r\n"), POINTS),
    Input("PLY with lone CR", ply(*SIZE, VERTICES, *XYZ, body=PLAIN, ending="\r"), POINTS),
    Input(
        "PLY ascii, lone CR",
        ply(*SIZE, VERTICES, *XYZ, body=rows("nan(ind)").replace(b"\n", b"\r"), ending="\r", encoding="ascii"),
        POINTS,
    ),
    Input(
        "PLY z y x big-endian",
        ply(*SIZE, VERTICES, *BACKWARD, body=BACKWARD_BODY, encoding="binary_big_endian"),
        POINTS,
    ),
    Input("PLY unorganized", ply(VERTICES, *XYZ, body=PLAIN), "unorganized"),
    Input("XYZ text", rows("nan"), "no known text format|none of PNG"),
]

INPUTS = [*MAIN_TIFF, *EXR, *PICTURES, *CLOUDS]


def test_there_are_many():
    assert len(INPUTS) >= 100
    assert len({entry.kind for entry in INPUTS}) == len(INPUTS)


@pytest.mark.parametrize("name", ["input.png", "input.txt"])
@pytest.mark.parametrize("entry", INPUTS, ids=lambda entry: entry.kind)
def test_inputs(tmp_path, capfd, entry, name):
    """Whatever the file is called; and nothing but the exception says what is wrong."""
    if entry.content is None:
        pytest.skip("what writes it is not installed")
    path = tmp_path / name
    path.write_bytes(entry.content)
    if isinstance(entry.right, str):
        with pytest.raises(rangeedge.error, match=entry.right) as caught:
            imreadRange(path)
        assert repr(str(path)) in str(caught.value)
    else:
        image = imreadRange(path)
        assert image.src.dtype == entry.right.dtype
        assert image.src.flags.writeable
        assert image.src.flags.aligned
        assert_array_equal(image.src, entry.right)
        assert image.geometry.keys() == entry.geometry.keys()
        for key, value in entry.geometry.items():
            assert_allclose(image.geometry[key], value)
    assert capfd.readouterr() == ("", "")


def read(tmp_path, content):
    path = tmp_path / "input"
    path.write_bytes(content)
    return imreadRange(path)


def test_viewpoint_of_pcd(tmp_path):
    image = read(tmp_path, pcd("binary", PLAIN, VIEWPOINT="1 2 3 0 0 0 2"))
    assert image.viewpoint == (1, 2, 3, 0, 0, 0, 1)
    assert read(tmp_path, pcd("binary", PLAIN)).viewpoint == (0, 0, 0, 1, 0, 0, 0)
    assert read(tmp_path, pcd("binary", PLAIN, VIEWPOINT="1 2 3 0 0 0 0")).viewpoint == (1, 2, 3, 1, 0, 0, 0)
    assert read(tmp_path, pcd("binary", PLAIN, VIEWPOINT=None)).viewpoint is None
    for bad in ("", "1 2 3", "1 2 3 4 5 6 x", "nan 0 0 1 0 0 0"):
        with pytest.raises(rangeedge.error, match=r"VIEWPOINT|where a number is needed"):
            read(tmp_path, pcd("binary", PLAIN, VIEWPOINT=bad))


def test_georeference_of_geotiff(tmp_path):
    corner = read(tmp_path, tiff(HOLES, extratags=geo((1025, 1))))
    assert_allclose(corner.georeference, [[0.5, 0, 1000.25], [0, -0.25, 1999.875]])
    centre = read(tmp_path, tiff(HOLES, extratags=geo((1025, 2), tie=(2, 4, 0, 1000.0, 2000.0, 0))))
    assert_allclose(centre.georeference @ (2, 4, 1), [1000, 2000])
    assert_allclose(centre.georeference @ (4, 8, 1), [1001, 1999])
    assert read(tmp_path, tiff(HOLES)).georeference is None
    assert corner.epsg is None


@pytest.mark.parametrize(
    ("keys", "code"),
    [(((1024, 1), (3072, 32633)), 32633), (((1024, 2), (2048, 4326)), 4326), (((3072, 32767), (2048, 4258)), 4258)],
)
def test_reference_system_of_geotiff(keys, code, tmp_path):
    tie = (0, 0, 0, 10.0, 50.0, 0)
    image = read(tmp_path, tiff(HOLES, extratags=geo(*keys, scale=(1e-5, 1e-5, 0), tie=tie)))
    assert image.epsg == image.withGeometry(pixelSize=1).epsg == code


def test_range_images_are_pairs_that_remember_more():
    image = rangeedge.RangeImage(DEPTH, {"K": K}, viewpoint=(1.0, 2, 3, 1, 0, 0, 0))
    src, geometry = image
    assert src is DEPTH
    assert geometry is image.geometry
    assert image._replace(geometry={}).viewpoint == image.viewpoint
    assert rangeedge.RangeImage(DEPTH).geometry == {}


def test_interlaced_pictures_are_those_of_others():
    picture = np.random.default_rng(0).integers(0, 65536, (13, 21), dtype=np.uint16)
    for part in (picture, picture[:1, :1], picture[:5, :2]):
        assert_array_equal(cv2.imdecode(np.frombuffer(png_in_passes(part), np.uint8), cv2.IMREAD_UNCHANGED), part)
        assert_array_equal(read_png(png_in_passes(part)), part)

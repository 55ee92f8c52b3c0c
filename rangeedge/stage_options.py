"""The options of the stages after detection: seeds, regions, closing of gaps, cleaning, chains."""

from __future__ import annotations

from dataclasses import dataclass

from . import _check
from ._option import Options, declared, option
from ._option_checks import below_one, real, whole


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Seeding(Options):
    """How seeds are found."""

    minDistance: float = option(
        3.0,
        real(0, above=True),
        "float",
        "Least distance of a seed's peak from an edge, > 0.",
        unit="pixels",
        group="seeds",
    )
    separation: float = option(
        0.65,
        below_one,
        "float",
        "Share of the lower of two peaks to which the way between them must drop for both to count, in (0, 1).",
        group="seeds",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Growing(Seeding):
    """How seeds are found and regions grow from them."""

    tolerance: float = option(
        3.0,
        real(0, above=True),
        "float",
        "How far a pixel may lie off its surface, > 0.",
        unit="standard deviations",
        group="regions",
    )
    smoothAngle: float = option(
        8.0,
        real(0, 30),
        "float",
        "Angle below which surfaces that meet without an edge go on into each other, from 0 to 30.",
        unit="degrees",
        group="regions",
    )
    minArea: int = option(
        100,
        whole(1),
        "int",
        "Least area of a region.",
        unit="pixels",
        group="regions",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Closing(Options):
    """How far gaps between edges are closed."""

    tolerance: float = option(
        3.0,
        real(0, above=True),
        "float",
        "How far a pixel may lie off its surface.",
        unit="standard deviations",
    )
    share: float = option(
        0.5,
        real(0, 1, above=True),
        "float",
        "Share of the pixels of a surface that must lie within `tolerance`, in (0, 1].",
    )
    maxGap: int = option(
        120,
        whole(0),
        "int",
        "Longest gap to close.",
        unit="pixels",
    )
    minArea: int = option(
        50,
        whole(1),
        "int",
        "Parts of fewer pixels are no surfaces; no edge is drawn around them.",
        unit="pixels",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Cleaning(Options):
    """What is done to depths."""

    maxHole: int = option(
        24,
        whole(0),
        "int",
        "Widest hole to fill: where a disc of this diameter without data fits in, the hole stays; 0 fills none.",
        unit="pixels",
        group="cleaning",
    )
    radius: float = option(
        6.0,
        real(0, 100),
        "float",
        "Standard deviation of the weights with which noise is averaged over a surface, from 0, which leaves it, to"
        " 100.",
        unit="pixels",
        group="cleaning",
    )
    removeFlying: bool = option(
        True,
        _check.boolean,
        "bool",
        "Whether to remove flying pixels (`flyingPixels`), which are holes then.",
        group="cleaning",
        flagged="remove pixels that hang between two surfaces, which are holes then (default: yes)",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Linking(Options):
    """How edge points are joined into chains."""

    bridge: float = option(
        6.0,
        real(0),
        "float",
        "Widest gap of a line that is bridged where kind and direction agree on its two sides: a hole, or a junction"
        " through which an edge runs on; 0 bridges none.",
        unit="pixels",
        group="chains",
    )
    cornerAngle: float = option(
        8.0,
        real(0, 180, above=True),
        "float",
        "A chain ends at a corner, where it turns abruptly by more; 180 follows outlines around corners.",
        unit="degrees",
        group="chains",
    )

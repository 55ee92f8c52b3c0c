"""How noisy a range image is, as a function of depth: a model by sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ._check import error, named, number, public


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of a measured length as a function of depth.

    NoiseModel([a[, b[, c[, correlation]]]])

    sigma(z) = a + b z + c z^2, all in the unit of the range image. Calling the model evaluates it.

    Parameters
    ----------
    a, b, c : float
        Coefficients, such that sigma is nowhere negative in the range measured. A triangulating sensor has only `c`
        (its noise is constant in inverse depth), a time-of-flight sensor mainly `a`.
    correlation : float
        How much larger the deviation is over several pixels than between neighbours; 1 for white noise, about 2 for
        a Kinect, whose matching windows make neighbours err together. Fits count with `correlation` times sigma.

    Raises
    ------
    rangeedge.error
        If a coefficient is not finite, all are zero, or `correlation` is below 1.

    Examples
    --------
    >>> from rangeedge import NoiseModel
    >>> NoiseModel(c=0.0014)(2.0)
    0.0056
    >>> NoiseModel.kinect1()
    NoiseModel(c=0.001425, correlation=2)
    """

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    correlation: float = 1.0

    @named("NoiseModel")
    def __post_init__(self) -> None:
        for name in ("a", "b", "c"):
            number(name, getattr(self, name))
        number("correlation", self.correlation, 1)
        if self.a == self.b == self.c == 0:
            raise error("one of `a`, `b`, `c` must differ from 0")

    def __repr__(self) -> str:
        told = {name: value for name, value in vars(self).items() if value != (name == "correlation")}
        return f"NoiseModel({', '.join(f'{name}={value:.4g}' for name, value in told.items())})"

    def __call__(self, z: Any) -> Any:
        return self.a + (self.b + self.c * z) * z

    @classmethod
    def kinect1(cls) -> NoiseModel:
        """Kinect v1 and Xtion, metres: 1.425e-3 z^2 (Khoshelham and Oude Elberink 2012)."""
        return cls(c=1.425e-3, correlation=2.0)

    @classmethod
    def kinect2(cls) -> NoiseModel:
        """Kinect v2, metres, facing surfaces: 1.5 mm - 0.5 mm z + 0.3 mm z^2 (Fankhauser et al. 2015)."""
        return cls(1.5e-3, -0.5e-3, 0.3e-3, correlation=2.0)

    @classmethod
    @public
    def stereo(cls, focalLength: float, baseline: float, subpixel: float = 0.08) -> NoiseModel:
        """Stereo and active stereo: z^2 subpixel / (focalLength baseline), with the focal length in pixels.

        `subpixel` is the deviation of the disparity in pixels, `baseline` a length in the unit of the image.
        """
        focalLength = number("focalLength", focalLength, 0, above=True)
        baseline = number("baseline", baseline, 0, above=True)
        return cls(c=number("subpixel", subpixel, 0, above=True) / (focalLength * baseline))

"""Methods with their parameters, and what options have to choose from.

What is unset stays unset: the server's default holds, in brackets here.

Made by scripts/tables from proto/declaration; do not edit.
"""
# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

Form = Literal["jacobi", "gauss-seidel", "asynchronous"]
Weighting = Literal["uniform", "inverse-edge-length", "edge-length", "ball-volume"]
Window = Literal["nuttall", "hamming"]
Goal = Literal["average", "balanced", "worst"]
Target = Literal["automatic", "ideal", "input", "reference"]
Start = Literal["cold", "warm"]
Boundary = Literal["fixed", "slide", "free"]
Tangled = Literal["repair", "refuse"]
Detail = Literal["full", "brief"]
Metric = Literal["mean_ratio", "scaled_jacobian", "radius_ratio", "min_dihedral_angle", "max_dihedral_angle", "min_angle", "max_angle"]
Backend = Literal["auto", "cpu", "cuda"]
Priority = Literal["batch", "normal", "interactive"]
MethodName = Literal["optimize", "laplacian", "smart-laplacian", "taubin", "hc-laplacian", "windowed-sinc", "move", "weighted-laplacian"]


@dataclass(frozen=True, kw_only=True)
class Optimize:
    """Moves each node down the energy of the elements around it; a valid mesh stays valid.

    Attributes:
        goal: elements to improve: all, the worst, or both [balanced].
        target: shape that elements aim at [automatic].
        stay: weight that holds nodes at their input positions, 0 or more [0].
    """

    goal: Goal | None = None
    target: Target | None = None
    stay: float | None = None

    _name: ClassVar[str] = "optimize"
    _iterations: ClassVar[int] = 1000


@dataclass(frozen=True, kw_only=True)
class Laplacian:
    """Moves each node towards the weighted mean of its neighbours.

    Attributes:
        weighting: weights of the neighbours [uniform].
        relaxation: share of the step that is taken, (0, 1] [1].
    """

    weighting: Weighting | None = None
    relaxation: float | None = None

    _name: ClassVar[str] = "laplacian"
    _iterations: ClassVar[int] = 1000


@dataclass(frozen=True, kw_only=True)
class SmartLaplacian:
    """A Laplacian step that is taken only if the worst mean ratio around the node does not fall.

    Attributes:
        weighting: weights of the neighbours [uniform].
        relaxation: share of the step that is taken, (0, 1] [1].
    """

    weighting: Weighting | None = None
    relaxation: float | None = None

    _name: ClassVar[str] = "smart_laplacian"
    _iterations: ClassVar[int] = 1000


@dataclass(frozen=True, kw_only=True)
class Taubin:
    """A step with lambda, then one with mu: keeps the volume of a surface.

    Attributes:
        lambda_: factor of the first step, (0, 1] [0.6307].
        mu: factor of the second step, below -lambda [-0.6732].
    """

    lambda_: float | None = None
    mu: float | None = None

    _name: ClassVar[str] = "taubin"
    _iterations: ClassVar[int] = 20


@dataclass(frozen=True, kw_only=True)
class HcLaplacian:
    """Averages, then pushes nodes back towards their original and previous positions.

    Attributes:
        alpha: weight of the original position, [0, 1] [0].
        beta: share of the node's own difference, [0, 1] [0.5].
    """

    alpha: float | None = None
    beta: float | None = None

    _name: ClassVar[str] = "hc_laplacian"
    _iterations: ClassVar[int] = 10


@dataclass(frozen=True, kw_only=True)
class WindowedSinc:
    """A low-pass filter of as many terms as iterations: keeps the volume of a surface.

    Attributes:
        window: window of the filter's series [nuttall].
        pass_band: eigenvalue of the ring operator below which the shape stays, [0.001, 2] [0.1].
    """

    window: Window | None = None
    pass_band: float | None = None

    _name: ClassVar[str] = "windowed_sinc"
    _iterations: ClassVar[int] = 20


@dataclass(frozen=True, kw_only=True)
class Move:
    """The method of `move`: some nodes go to given positions, the mesh follows and stays valid.

    Attributes:
        target: shape that elements aim at: "ideal", or the one that they have in the mesh [theirs].
        least_step: smallest share of the motion that is tried, (0, 1] [1/64].
        start: start of the solver: "warm" continues the last warm motions of a session, which are
            small steps, in fewer iterations; the bits then depend on them [cold].
    """

    target: Target | None = None
    least_step: float | None = None
    start: Start | None = None

    _name: ClassVar[str] = "move"
    _iterations: ClassVar[int] = 10000


Method = Optimize | Laplacian | SmartLaplacian | Taubin | HcLaplacian | WindowedSinc | Move

NAMED_METHODS: dict[str, Method] = {
    method._name.replace("_", "-"): method
    for method in (Optimize(), Laplacian(), SmartLaplacian(), Taubin(), HcLaplacian(), WindowedSinc(), Move())
}
NAMED_METHODS["weighted-laplacian"] = Laplacian(weighting="inverse-edge-length")
# Fields that are called otherwise on the wire.
WIRE_NAMES = {"relaxation": "relaxation_factor", "lambda_": "lambda"}

"""Motions of a session as functions of PyTorch, for shape optimization and training.

    from meshsmooth import torch as ms_torch
    session = ms.Client().session(mesh, boundary="slide")
    points = ms_torch.move(session, wall, wall_points)
    objective(points).backward()  # wall_points.grad

Both modes of differentiation and second derivatives work. Tensors may be on any device; what is
computed is in the precision of the session's mesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike

from ._job_options import JobOptions
from ._session import Session

if TYPE_CHECKING:
    from typing_extensions import Unpack

Tensor = torch.Tensor


def move(
    session: Session, nodes: ArrayLike, positions: Tensor, **options: Unpack[JobOptions]
) -> Tensor:
    """Returns the positions of all nodes, [nodes, 2 or 3], as `Session.move`.

    Its derivatives are those of `Session.jvp` and `Session.vjp`: of the linear prediction, without
    the sweeps that follow.

    Args:
        session: of the mesh.
        nodes: prescribed nodes: indices, each once, or a boolean mask.
        positions: where they shall lie, in their order, [n, 2 or 3]; or positions of all nodes.
        **options: as of `Session.move`.
    """
    motion = _Motion(session, np.asarray(nodes), options)
    moved: Tensor = _Move.apply(motion.of_prescribed(positions), motion)
    return moved


def predict(
    session: Session, nodes: ArrayLike, displacements: Tensor, **options: Unpack[JobOptions]
) -> Tensor:
    """Returns the displacements of all nodes before sweeps, [nodes, 2 or 3], as `Session.jvp`.

    They are linear in those of the prescribed nodes, and the derivatives exact. Nothing keeps
    elements valid.

    Args:
        session: of the mesh.
        nodes: prescribed nodes: indices, each once, or a boolean mask.
        displacements: theirs, in their order, [n, 2 or 3]; or those of all nodes.
        **options: as of `Session.move`; those of sweeps do not count.
    """
    motion = _Motion(session, np.asarray(nodes), options)
    moved: Tensor = _Tangents.apply(motion.of_prescribed(displacements), motion)
    return moved


class _Motion(NamedTuple):
    session: Session
    nodes: Any
    options: JobOptions

    def of_prescribed(self, vectors: Tensor) -> Tensor:
        nodes = self.nodes.nonzero()[0] if self.nodes.dtype == bool else self.nodes
        if len(vectors) != len(self.session.positions) or len(vectors) == len(nodes):
            return vectors
        chosen: Tensor = vectors[torch.as_tensor(nodes, device=vectors.device)]
        return chosen

    def run(self, step: Any, vectors: Tensor) -> Tensor:
        result = step(self.nodes, vectors.detach().cpu().numpy(), **self.options)
        return torch.as_tensor(result, dtype=vectors.dtype, device=vectors.device)


class _Move(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, positions: Tensor, motion: _Motion) -> Tensor:
        ctx.motion = motion
        return motion.run(motion.session.move, positions)

    @staticmethod
    def backward(ctx: Any, cotangents: Tensor) -> Any:
        return _Cotangents.apply(cotangents, ctx.motion), None

    @staticmethod
    def jvp(ctx: Any, tangents: Tensor, _: None) -> Any:
        return _Tangents.apply(tangents, ctx.motion)


class _Tangents(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, tangents: Tensor, motion: _Motion) -> Tensor:
        ctx.motion = motion
        return motion.run(motion.session.jvp, tangents)

    @staticmethod
    def backward(ctx: Any, cotangents: Tensor) -> Any:
        return _Cotangents.apply(cotangents, ctx.motion), None

    @staticmethod
    def jvp(ctx: Any, tangents: Tensor, _: None) -> Any:
        return _Tangents.apply(tangents, ctx.motion)


class _Cotangents(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, cotangents: Tensor, motion: _Motion) -> Tensor:
        ctx.motion = motion
        return motion.run(motion.session.vjp, cotangents)

    @staticmethod
    def backward(ctx: Any, tangents: Tensor) -> Any:
        return _Tangents.apply(tangents, ctx.motion), None

    @staticmethod
    def jvp(ctx: Any, cotangents: Tensor, _: None) -> Any:
        return _Cotangents.apply(cotangents, ctx.motion)

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
from ._prescribed import rows_among_all
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
    moved: Tensor = _Step.apply(motion.of_prescribed(positions), motion, "move")
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
    moved: Tensor = _Step.apply(motion.of_prescribed(displacements), motion, "jvp")
    return moved


class _Motion(NamedTuple):
    session: Session
    nodes: Any
    options: JobOptions

    def of_prescribed(self, vectors: Tensor) -> Tensor:
        rows = rows_among_all(vectors.shape, len(self.session.positions), self.nodes)
        if rows is None:
            return vectors
        chosen: Tensor = vectors[torch.as_tensor(rows, device=vectors.device)]
        return chosen


class _Step(torch.autograd.Function):
    """A step of a session by its name; `jvp` and `vjp` are each other's derivatives in reverse."""

    @staticmethod
    def forward(ctx: Any, vectors: Tensor, motion: _Motion, name: str) -> Tensor:
        ctx.motion, ctx.name = motion, name
        step = getattr(motion.session, name)
        result = step(motion.nodes, vectors.detach().cpu().numpy(), **motion.options)
        return torch.as_tensor(result, dtype=vectors.dtype, device=vectors.device)

    @staticmethod
    def backward(ctx: Any, cotangents: Tensor) -> Any:
        name = "jvp" if ctx.name == "vjp" else "vjp"
        return _Step.apply(cotangents, ctx.motion, name), None, None

    @staticmethod
    def jvp(ctx: Any, tangents: Tensor, *_: None) -> Any:
        name = "vjp" if ctx.name == "vjp" else "jvp"
        return _Step.apply(tangents, ctx.motion, name)

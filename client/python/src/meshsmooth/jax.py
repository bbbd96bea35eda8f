"""Motions of a session as functions of JAX, for shape optimization and training.

    from meshsmooth import jax as ms_jax
    session = ms.Client().session(mesh, boundary="slide")
    gradient = jax.grad(lambda x: objective(ms_jax.move(session, wall, x)))(wall_points)

Both modes of differentiation and second derivatives work, under `jax.jit` too; `jax.vmap` runs one
motion after the other. What is computed is in the precision of the session's mesh, results are in
that of the arrays: `jax_enable_x64` for float64.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import numpy as np
from jax.custom_derivatives import linear_call
from numpy.typing import ArrayLike

from ._job_options import JobOptions
from ._prescribed import rows_among_all
from ._session import Session

if TYPE_CHECKING:
    from typing_extensions import Unpack


def move(
    session: Session, nodes: ArrayLike, positions: Any, **options: Unpack[JobOptions]
) -> Any:
    """Returns the positions of all nodes, [nodes, 2 or 3], as `Session.move`.

    Its derivatives are those of `Session.jvp` and `Session.vjp`: of the linear prediction, without
    the sweeps that follow.

    Args:
        session: of the mesh.
        nodes: prescribed nodes: indices, each once, or a boolean mask.
        positions: where they shall lie, in their order, [n, 2 or 3]; or positions of all nodes.
        **options: as of `Session.move`.
    """

    @jax.custom_jvp  # type: ignore[untyped-decorator,unused-ignore]
    def moved(given: Any) -> Any:
        return _call(session.move, nodes, given, session.positions.shape, options)

    @moved.defjvp  # type: ignore[untyped-decorator,unused-ignore]
    def _(given: Any, tangents: Any) -> Any:
        return moved(*given), predict(session, nodes, *tangents, **options)

    return moved(_of_prescribed(session, nodes, positions))


def predict(
    session: Session, nodes: ArrayLike, displacements: Any, **options: Unpack[JobOptions]
) -> Any:
    """Returns the displacements of all nodes before sweeps, [nodes, 2 or 3], as `Session.jvp`.

    They are linear in those of the prescribed nodes, and the derivatives exact. Nothing keeps
    elements valid.

    Args:
        session: of the mesh.
        nodes: prescribed nodes: indices, each once, or a boolean mask.
        displacements: theirs, in their order, [n, 2 or 3]; or those of all nodes.
        **options: as of `Session.move`; those of sweeps do not count.
    """
    given = _of_prescribed(session, nodes, displacements)

    def forward(_: Any, tangents: Any) -> Any:
        return _call(session.jvp, nodes, tangents, session.positions.shape, options)

    def backward(_: Any, cotangents: Any) -> Any:
        return _call(session.vjp, nodes, cotangents, given.shape, options)

    return linear_call(forward, backward, (), given)


def _of_prescribed(session: Session, nodes: ArrayLike, vectors: Any) -> Any:
    given = jax.numpy.asarray(vectors)
    rows = rows_among_all(given.shape, len(session.positions), nodes)
    return given if rows is None else given[rows]


def _call(
    step: Any, nodes: Any, vectors: Any, shape: tuple[int, ...], options: JobOptions
) -> Any:
    def run(given: Any) -> Any:
        return step(nodes, np.asarray(given), **options).astype(vectors.dtype)

    kind = jax.ShapeDtypeStruct(shape, vectors.dtype)
    return jax.pure_callback(run, kind, vectors, vmap_method="sequential")

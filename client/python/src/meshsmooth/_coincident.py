"""Nodes at the same position, which are smoothed as one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._cells import Block

Ids = NDArray[np.int64]


def find_representatives(points: NDArray[Any]) -> Ids:
    """Returns for each node the lowest one at its position; [nodes].

    Positions are the same if all their digits are. O(nodes * log nodes).
    """
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0]))  # stable: by node at last
    sorted_points = points[order]
    first = np.append(True, (sorted_points[1:] != sorted_points[:-1]).any(axis=1))
    result = np.empty(len(points), np.int64)
    result[order] = order[np.flatnonzero(first)][np.cumsum(first) - 1]
    return result


def merged_blocks(blocks: list[Block], representatives: Ids) -> list[Block]:
    """Returns the blocks with the nodes that stand for theirs; unknown nodes stay."""
    return [
        Block(
            block.element_type,
            np.ascontiguousarray(merged(block.nodes, representatives), np.dtype("<i4")),
        )
        for block in blocks
    ]


def merged(nodes: NDArray[Any], representatives: Ids) -> NDArray[Any]:
    """Returns the nodes that stand for these."""
    known = (nodes >= 0) & (nodes < len(representatives))
    return np.where(known, representatives[np.where(known, nodes, 0)], nodes)


def merged_mask(mask: NDArray[np.uint8] | None, representatives: Ids) -> NDArray[np.uint8] | None:
    """Returns a mask of nodes with those that stand for marked ones."""
    if mask is None:
        return None
    result = mask.copy()
    result[representatives[mask != 0]] = 1
    return result

"""gRPC and fork()."""

from __future__ import annotations

import os

from ._errors import FORKED, Error


class ForkGuard:
    """Refuses the use of gRPC in a process that was forked while gRPC was in use.

    gRPC's threads do not survive fork(); a call in the child would wait for ever.
    """

    def __init__(self) -> None:
        self._used = False
        self._refused = False
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._forked)

    def _forked(self) -> None:
        self._refused = self._used

    def check(self) -> None:
        """Notes that gRPC is used.

        Raises:
            Error: FORKED.
        """
        if self._refused:
            raise Error(
                "this process was forked after its parent had used a meshsmooth client, which "
                "gRPC does not survive",
                reason=FORKED,
                hint='use multiprocessing.get_context("spawn"), or fork before the first call',
            )
        self._used = True


fork_guard = ForkGuard()

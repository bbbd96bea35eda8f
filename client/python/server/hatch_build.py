"""The tag of the server's wheel: any Python 3, on the platform that scripts/wheels found."""

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PlatformTag(BuildHookInterface):
    """Takes the platform from $MESHSMOOTH_WHEEL_PLATFORM."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before it packs."""
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{os.environ['MESHSMOOTH_WHEEL_PLATFORM']}"

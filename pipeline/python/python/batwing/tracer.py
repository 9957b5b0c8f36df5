# SPDX-License-Identifier: MIT OR Apache-2.0
"""Former name of `batwing.simulate`."""

import warnings

from .simulate import *  # noqa: F403
from .simulate import __all__ as __all__


def __dir__() -> list[str]:
    return sorted(__all__)


warnings.warn(
    "batwing.tracer is now batwing.simulate",
    DeprecationWarning,
    stacklevel=2,
)

"""What arrays are called in signatures."""
from typing import Any

import numpy.typing as npt

Array = npt.NDArray[Any]
"""A numpy array; its shape and dtype stand where it is described."""
ArrayLike = npt.ArrayLike
"""What numpy makes an array of: arrays, lists and tuples of numbers."""

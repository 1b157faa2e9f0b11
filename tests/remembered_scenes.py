"""Built-in scenes that are drawn once for all tests: to draw one takes longer than most of what is tested with it."""

import os
import pickle
from collections.abc import Callable
from functools import wraps
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from sepi.lightfield import LightField

FOLDER = "SEPI_TESTS_SCENES"
"""Environment variable: where the processes of the tests keep them."""


def remembered(render: Callable[..., LightField]) -> Callable[..., LightField]:
    """What gives a scene as it was drawn before, each time a copy of its own."""

    @wraps(render)
    def found(name: str, **given: Any) -> LightField:
        if FOLDER not in os.environ:
            return render(name, **given)
        words = {word: value.tolist() if isinstance(value, np.ndarray) else value for word, value in given.items()}
        path = Path(os.environ[FOLDER], sha256(repr((name, sorted(words.items()))).encode()).hexdigest())
        if not path.exists():
            begun = path.with_suffix(f".{os.getpid()}")
            begun.write_bytes(pickle.dumps(render(name, **given)))
            begun.replace(path)
        light_field: LightField = pickle.loads(path.read_bytes())
        return light_field

    return found

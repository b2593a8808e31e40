"""The one error type of the package, and how commands tell it."""

import functools
import sys
from collections.abc import Callable


class TrainingError(Exception):
    """Bad input: the message names the file and field, what was found and what was expected."""


def telling_errors(main: Callable[[], None]) -> Callable[[], None]:
    """A command that ends with status 1 and one line where it meets a TrainingError."""

    @functools.wraps(main)
    def run() -> None:
        try:
            main()
        except TrainingError as error:
            sys.exit(f"error: {error}")

    return run

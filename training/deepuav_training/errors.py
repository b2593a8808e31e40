"""The one error type of the package."""


class TrainingError(Exception):
    """Bad input: the message names the file and field, what was found and what was expected."""

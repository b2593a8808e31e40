"""YAML configuration files read into dataclasses, every key checked."""

import dataclasses
import difflib
import types
import typing
from pathlib import Path

import yaml

from deepuav_training.errors import TrainingError

T = typing.TypeVar("T")


def load_config(cls: type[T], path: str | Path) -> T:
    """Reads the YAML file `path` into the dataclass `cls`.

    Nested dataclasses are read from nested mappings; keys that are left out keep their defaults.

    Raises:
        TrainingError: an unreadable file, an unknown key or a value of the wrong type.
    """
    path = Path(path)
    try:
        tree = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise TrainingError(f"{path}: cannot be read as YAML: {error}") from error
    return from_mapping(cls, tree or {}, str(path))


def from_mapping(cls: type[T], tree: object, where: str) -> T:
    """Builds the dataclass `cls` from a mapping; `where` names the place in error messages."""
    if not isinstance(tree, dict):
        raise TrainingError(f"{where}: found {tree!r}, expected a mapping")
    types_of = typing.get_type_hints(cls)
    values = {}
    for key, value in tree.items():
        if key not in types_of:
            near = difflib.get_close_matches(str(key), types_of, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise TrainingError(f"{where}: unknown key {key!r}{hint}")
        values[key] = _convert(types_of[key], value, f"{where}: {key}")
    try:
        config = cls(**values)
    except TypeError as error:
        raise TrainingError(f"{where}: {error}") from error
    if hasattr(config, "check"):
        config.check(where)
    return config


def check_field(condition: bool, where: str, field: str, found: object, expected: str) -> None:
    """Raises TrainingError unless `condition` holds."""
    if not condition:
        raise TrainingError(f"{where}: {field}: found {found!r}, expected {expected}")


def _convert(expected: object, value: object, where: str) -> object:
    if dataclasses.is_dataclass(expected):
        return from_mapping(expected, value, where)
    origin = typing.get_origin(expected) or expected
    if origin in (typing.Union, types.UnionType):
        if value is None:
            return None
        inner = [a for a in typing.get_args(expected) if a is not type(None)]
        return _convert(inner[0], value, where)
    if origin is tuple and isinstance(value, (list, tuple)):
        return tuple(value)
    if origin is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if origin is bool or not isinstance(value, bool):
        if isinstance(value, origin):
            return value
    name = getattr(origin, "__name__", str(origin))
    raise TrainingError(f"{where}: found {value!r}, expected {name}")

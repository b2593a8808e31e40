"""What a cache's files were made of, kept beside them: others are never taken for them."""

import dataclasses
import hashlib
import json
import os
from pathlib import Path

from deepuav_training.data.manifest import SplitConfig
from deepuav_training.errors import TrainingError

_FILE = "made_of.json"


def file_digest(path: str | Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def photographs_identity(images: str | Path, split: SplitConfig) -> dict:
    """Which photographs there are, and which are held out."""
    return {"manifest": file_digest(Path(images) / "MANIFEST.tsv"),
            "split": dataclasses.asdict(split)}


def claim(folder: str | Path, identity: dict) -> None:
    """For who adds files to a cache: notes what they are made of, once `check_claim` finds it right.

    Raises:
        TrainingError: as check_claim.
    """
    noted = check_claim(folder, identity)
    wanted = noted | json.loads(json.dumps(identity))
    if wanted == noted:
        return
    path = Path(folder) / _FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".partial{os.getpid()}")
    partial.write_text(json.dumps(wanted, indent=1) + "\n")
    partial.replace(path)


def check_claim(folder: str | Path, identity: dict) -> dict:
    """For who reads a cache: what is noted of its files, which must not differ from `identity`.

    Raises:
        TrainingError: a field that both have differs, or the note is damaged; names it.
    """
    path = Path(folder) / _FILE
    try:
        noted = json.loads(path.read_text()) if path.exists() else {}
    except ValueError as error:
        raise TrainingError(f"{path}: cannot be read: {error}") from error
    for name, value in json.loads(json.dumps(identity)).items():
        if name in noted and noted[name] != value:
            raise TrainingError(f"{folder}: was made with {name} {noted[name]}: expected {value}, "
                                "or another folder")
    return noted

"""What a cache's files were made of, kept beside them: others are never taken for them."""

import dataclasses
import hashlib
import json
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
    """Notes what the files of a cache are made of, or checks that it is what is noted.

    Raises:
        TrainingError: a field that both have differs; names it.
    """
    path = Path(folder) / _FILE
    wanted = json.loads(json.dumps(identity))
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(wanted, indent=1) + "\n")
        return
    noted = json.loads(path.read_text())
    for name, value in wanted.items():
        if name in noted and noted[name] != value:
            raise TrainingError(f"{folder}: was made with {name} {noted[name]}: expected {value}, "
                                "or another folder")

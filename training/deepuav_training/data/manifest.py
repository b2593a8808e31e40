"""The list of photographs: which place each shows, and which places are held out."""

import csv
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from deepuav_training.config import check_field
from deepuav_training.errors import TrainingError

# A tile of this zoom spans about 39 km at the equator: one town and its surroundings.
_REGION_ZOOM = 10
_OAM_TILE = re.compile(r"OAM-(\d+)-(\d+)-(\d+)")
_OAM_MOSAIC = re.compile(r"OAM z(\d+) tiles x(\d+)-\d+ y(\d+)-\d+")
_NEON_SITE = re.compile(r"(?:^|[/_])([A-Z]{4})(?=[/_])")
_NUMBER_SUFFIX = re.compile(r"_\d+$")


@dataclass(frozen=True)
class Photograph:
    """One image file of the training set."""

    file: str  # relative to the images' root
    source: str  # images of one source were taken or gathered together
    place: str  # images of one place may show the same ground


@dataclass(frozen=True)
class SplitConfig:
    """Which places are held out for validation."""

    validation_places: tuple = ()  # names of places, or of sources, held out entirely
    validation_share: float = 0.0  # share of the remaining places of a many-place source
    many_places: int = 6  # a source with at least so many places gives a share of them

    def check(self, where: str) -> None:
        check_field(0 <= self.validation_share < 1, where, "validation_share",
                    self.validation_share, "a share in [0, 1)")
        check_field(self.many_places > 0, where, "many_places", self.many_places, "at least 1")


def read_manifest(root: str | Path, folders: tuple = ("aerial", "natural", "textures")
                  ) -> list[Photograph]:
    """Reads ROOT/MANIFEST.tsv (columns file, source_repo, original_path, ...).

    Args:
        root: the folder that the column `file` is relative to.
        folders: only files in these folders are listed (height maps are not photographs).
    """
    path = Path(root) / "MANIFEST.tsv"
    try:
        with path.open(newline="") as stream:
            rows = list(csv.DictReader(stream, delimiter="\t"))
    except OSError as error:
        raise TrainingError(f"{path}: cannot be read: {error.strerror}") from error
    photographs = []
    for line, row in enumerate(rows, start=2):
        if not row.get("file") or row.get("original_path") is None:
            raise TrainingError(f"{path}: line {line}: found {row}, expected the columns file, "
                                "source_repo and original_path")
        if row["file"].split("/")[0] in folders:
            photographs.append(_photograph(row["file"], row["original_path"]))
    if not photographs:
        raise TrainingError(f"{path}: found no file in {folders}, expected photographs")
    return photographs


def split_photographs(photographs: list[Photograph], config: SplitConfig
                      ) -> tuple[list[Photograph], list[Photograph]]:
    """Divides photographs into (training, validation) such that no place is in both."""
    places_of, sources_of = {}, {}
    for photo in photographs:
        places_of.setdefault(photo.source, set()).add(photo.place)
        sources_of.setdefault(photo.place, set()).add(photo.source)
    named = set(config.validation_places)
    unknown = named - set(sources_of) - set(places_of)
    if unknown:
        raise TrainingError(f"validation_places: found {sorted(unknown)}, expected names of "
                            "places or sources in the manifest")

    def held_out(place: str) -> bool:
        if place in named or sources_of[place] & named:
            return True
        fewest = min(len(places_of[source]) for source in sources_of[place])
        return fewest >= config.many_places and _hash_fraction(place) < config.validation_share

    held = {place for place in sources_of if held_out(place)}
    training = [p for p in photographs if p.place not in held]
    return training, [p for p in photographs if p.place in held]


def _photograph(file: str, original_path: str) -> Photograph:
    source = _NUMBER_SUFFIX.sub("", Path(file).stem)
    tile = _OAM_TILE.search(original_path)
    mosaic = _OAM_MOSAIC.search(original_path)
    if tile:
        x, y, zoom = map(int, tile.groups())
        place = _region(x, y, zoom)
    elif mosaic:
        zoom, x, y = map(int, mosaic.groups())
        place = _region(x, y, zoom)
    elif source in ("deepforest", "neon"):
        site = _NEON_SITE.search(original_path)
        place = f"neon-site/{site.group(1) if site else original_path}"
    elif source.startswith(("odmgarfield",)):
        place = "odmgarfield"  # colour and near infrared of the same field
    elif file.startswith("aerial/"):
        place = source  # one flight, or flights over one town
    else:
        place = f"{source}/{original_path}"  # unrelated photographs: each is its own place
    return Photograph(file, source, place)


def _region(x: int, y: int, zoom: int) -> str:
    shift = zoom - _REGION_ZOOM
    return f"oam/{x >> shift}-{y >> shift}"


def _hash_fraction(name: str) -> float:
    digest = hashlib.sha256(name.encode()).digest()
    return int.from_bytes(digest[:8], "big") / 2.0**64

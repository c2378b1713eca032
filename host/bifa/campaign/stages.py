"""Stages of a campaign: each makes named artefacts from named artefacts, can be resumed and rerun alone.

A stage works in a scratch folder; only when it has succeeded are its artefacts moved to their names.
`provenance.json` says of every artefact which stage, settings, inputs and version made it; a stage whose
record still holds is not run again.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import bifa
from bifa.errors import BifaError
from bifa.files import write_text

PROVENANCE = "provenance.json"
_SCRATCH = ".scratch"


class StageError(BifaError):
    """A stage cannot run: an artefact that it needs is missing, or it did not make what it promised."""


@dataclass(frozen=True)
class Stage:
    """One step of a campaign.

    name: as the user types it; title: as progress shows it.
    needs, makes: names of artefacts (files or folders, relative to the campaign's folder).
    run(inputs, outputs): `inputs` is the campaign's folder, `outputs` the scratch folder to write `makes` into.
    settings: whatever else decides the result (seed, gait, port); plain JSON.
    resumes: `run` goes on with what an interrupted run left in `outputs`, which is then kept.
    by_hand: somebody measured for hours to make it. It is not run again for another version of bifa, with other
    settings only on request, and what it made before is kept beside the new.
    """

    name: str
    title: str
    needs: tuple[str, ...]
    makes: tuple[str, ...]
    run: Callable[[Path, Path], None]
    settings: Mapping[str, object] = field(default_factory=dict)
    resumes: bool = False
    by_hand: bool = False


def digest(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files with their names, in order."""
    total = hashlib.sha256()
    if path.is_dir():
        for file in sorted(p for p in path.rglob("*") if p.is_file()):
            total.update(f"{file.relative_to(path).as_posix()}\0{digest(file)}\n".encode())
    else:
        with path.open("rb") as stream:
            while block := stream.read(1 << 20):
                total.update(block)
    return total.hexdigest()


def run_stages(
    folder: Path,
    stages: Sequence[Stage],
    *,
    rerun: Iterable[str] = (),
    on_start: Callable[[Stage], None] = lambda stage: None,
    on_end: Callable[[Stage, bool], None] = lambda stage, ran: None,
) -> None:
    """Bring every stage's artefacts up to date, in the order given.

    A stage runs where it is named in `rerun`, or its artefacts, inputs, settings or bifa's version are not
    those on record. on_end(stage, ran) says whether it ran. Raises StageError; an error inside a stage leaves
    the artefacts of earlier runs as they were.
    """
    unknown = set(rerun) - {stage.name for stage in stages}
    if unknown:
        raise StageError(
            f"no stage is called {', '.join(sorted(unknown))}; there are {', '.join(s.name for s in stages)}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(folder / _SCRATCH, ignore_errors=True)
    records = _read_records(folder)
    for stage in stages:
        on_start(stage)
        asked = _asked(folder, stage)
        ran = stage.name in rerun or not _holds(folder, stage, asked, records.get(stage.name))
        if ran:
            _run(folder, stage)
            records[stage.name] = asked | {"artefacts": {name: digest(folder / name) for name in stage.makes}}
            _write_json(folder / PROVENANCE, {"bifa": bifa.__version__, "stages": records})
        on_end(stage, ran)


def _asked(folder: Path, stage: Stage) -> dict:
    missing = [name for name in stage.needs if not (folder / name).exists()]
    if missing:
        raise StageError(f"stage {stage.name} needs {', '.join(missing)} in {folder}: run the earlier stages first")
    return {
        "version": bifa.__version__,
        "settings": json.loads(json.dumps(dict(stage.settings))),
        "inputs": {name: digest(folder / name) for name in stage.needs},
    }


def _holds(folder: Path, stage: Stage, asked: dict, record: dict | None) -> bool:
    if record is None:
        return False
    made = record.get("artefacts", {})
    intact = all((folder / name).exists() and made.get(name) == digest(folder / name) for name in stage.makes)
    if not stage.by_hand:
        return intact and all(record.get(key) == value for key, value in asked.items())
    if intact and (differing := _differing(record.get("settings", {}), asked["settings"])):
        raise StageError(
            f"{', '.join(stage.makes)} in {folder} was measured with {', '.join(differing)}: run with the same, "
            f"name another folder, or measure again with --rerun {stage.name}"
        )
    return intact and record.get("inputs") == asked["inputs"]


def _differing(old: Mapping, new: Mapping) -> list[str]:
    """Settings that both know and that differ, in words; another version may have more or fewer."""
    found = []
    for name in old.keys() & new.keys():
        if isinstance(old[name], Mapping) and isinstance(new[name], Mapping):
            found += _differing(old[name], new[name])
        elif old[name] != new[name]:
            found.append(f"{name} = {old[name]}, not {new[name]}")
    return sorted(found)


def _run(folder: Path, stage: Stage) -> None:
    scratch = folder / (f".{stage.name}-unfinished" if stage.resumes else _SCRATCH)
    scratch.mkdir(exist_ok=stage.resumes)
    done = False
    try:
        stage.run(folder, scratch)
        missing = [name for name in stage.makes if not (scratch / name).exists()]
        if missing:
            raise StageError(f"stage {stage.name} ended without making {', '.join(missing)}")
        for name in stage.makes:
            _replace(scratch / name, folder / name, keep=stage.by_hand)
        done = True
    finally:
        if done or not stage.resumes:
            shutil.rmtree(scratch, ignore_errors=True)


def _replace(new: Path, target: Path, keep: bool) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if keep and target.exists():
        earlier = len(list(target.parent.glob(f"{target.name}.earlier-*")))
        os.replace(target, target.with_name(f"{target.name}.earlier-{earlier + 1}"))
    if target.is_dir():
        shutil.rmtree(target)
    os.replace(new, target)


def _read_records(folder: Path) -> dict:
    try:
        return dict(json.loads((folder / PROVENANCE).read_text())["stages"])
    except FileNotFoundError:
        return {}
    except (ValueError, KeyError, TypeError) as error:
        raise StageError(f"{folder / PROVENANCE} is damaged ({error}): delete it to start the campaign over") from None


def _write_json(path: Path, content: dict) -> None:
    write_text(path, json.dumps(content, indent=1, sort_keys=True) + "\n")

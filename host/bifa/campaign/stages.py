"""Stages of a campaign: each makes named artefacts from named artefacts and can be resumed or rerun on its own.

A stage works in a scratch folder; its artefacts are moved to their final names only once it has succeeded.
`provenance.json` records which stage, settings, inputs and version made each artefact. A stage whose record still
matches is not run again, and files without a record are never replaced.
"""

import glob
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bifa
from bifa.errors import BifaError
from bifa.files import is_stray, write_text
from bifa.lock import locked
from bifa.printable import counted
from bifa.toml import parse_toml

OnProgress = Callable[[str, float], None]  # current step of the running stage, and the share of it done, 0 to 1

PROVENANCE = "provenance.json"
_SCRATCH = ".scratch"
_REQUEST_FILE = "asked.json"  # in the scratch folder: what the stage was started with and, once ended, what it made


class StageError(BifaError):
    """A stage cannot run, would replace something not on record, or did not make its artefacts."""


@dataclass(frozen=True)
class Stage:
    """One step of a campaign.

    name: as the user types it; title: as progress shows it.
    needs, makes: names of artefacts (files or folders, relative to the campaign's folder).
    run(inputs, outputs): `inputs` is the campaign's folder, `outputs` the scratch folder to write `makes` into.
    settings: whatever else decides the result (seed, gait, port); plain JSON.
    resumes: `run` continues from what an interrupted run left in `outputs`, which is kept for that purpose. It writes
    each of `makes` only when complete, and is not called if all of them exist.
    by_hand: its artefacts take hours of measuring a real robot. The stage is not rerun for another version of bifa, and
    only on request if settings or artefacts have changed; earlier artefacts are kept next to the new ones.
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
    """SHA-256 of a file, or of a folder's files and their names, sorted. Of a data set only the files it lists and the
    instruments' raw records of them count; files left by operating systems or office programs never do."""
    if path.is_dir():
        lines = (f"{file.relative_to(path).as_posix()}\0{digest(file)}\n" for file in sorted(_counted_files(path)))
        return hashlib.sha256("".join(lines).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _counted_files(folder: Path) -> list[Path]:
    from bifa.data.layout import RAW, TABLE_FILE  # imports numpy, which usage errors need not wait for

    files = [path for path in folder.rglob("*") if path.is_file() and not is_stray(path.name)]
    try:
        listed = [trial["file"] for trial in parse_toml((folder / TABLE_FILE).read_text("utf-8"))["trial"]]
    except (OSError, ValueError, KeyError, TypeError):  # no valid data set: reading it reports why
        return files
    raw = tuple(Path(file).stem for file in listed)
    return [
        path
        for path in files
        if (name := path.relative_to(folder).as_posix()) == TABLE_FILE
        or name in listed
        or (path.parent.name == RAW and path.name.startswith(raw))
    ]


def check_folder(folder: Path) -> None:
    """Raise StageError if `folder` is a data set, since a campaign must not write among its files."""
    if (folder / "dataset.toml").exists():
        raise StageError(f"{folder} is a data set; choose another folder for the campaign")


def run_stages(
    folder: Path,
    stages: Sequence[Stage],
    *,
    rerun: Iterable[str] = (),
    on_start: Callable[[Stage], None] = lambda stage: None,
    on_end: Callable[[Stage, bool], None] = lambda stage, ran: None,
) -> None:
    """Bring every stage's artefacts up to date, in the order given.

    A stage runs if it is named in `rerun`, or if its artefacts, inputs, settings or bifa's version are not those on
    record. on_end(stage, ran) reports whether it ran. Raises StageError, before any stage runs if a stage would replace
    something that is not on record; an error inside a stage leaves the artefacts of earlier runs untouched. Raises
    LockedError if another program is running stages in `folder`.
    """
    names, again = [stage.name for stage in stages], set(rerun)
    if unknown := again.difference(names):
        raise StageError(f"no stage is called {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    check_folder(folder)
    with locked(folder):
        folder.mkdir(parents=True, exist_ok=True)
        records = _read_records(folder)
        for stage in stages:  # stages of another version may have made the same artefacts
            theirs = {name: record for name, record in records.items() if name == stage.name or name not in names}
            _refuse_unrecorded(folder, stage, theirs)
        shutil.rmtree(folder / _SCRATCH, ignore_errors=True)
        for stage in stages:
            on_start(stage)
            request = _request(folder, stage)
            ran = stage.name in again or not _is_current(folder, stage, request, records.get(stage.name))
            if ran:
                _run(folder, stage, request, records)
            on_end(stage, ran)


def changed_inputs(folder: Path, name: str) -> list[str]:
    """Inputs of the stage `name` that have changed since it ran, as while a campaign is brought up to date."""
    inputs = _read_records(folder).get(name, {}).get("inputs", {})
    return [file for file, was in inputs.items() if (folder / file).exists() and digest(folder / file) != was]


def _refuse_unrecorded(folder: Path, stage: Stage, records: Mapping[str, dict[str, Any]]) -> None:
    """Raise StageError if the stage would replace something that, by these records, no stage has made."""
    made = {name for record in records.values() for name in record.get("artefacts", {})}
    for path in (folder / name for name in stage.makes if name not in made):
        if path.exists() or path.is_symlink():
            raise StageError(
                f"{path} was not made by the stage {stage.name}, which would replace it: choose another folder for "
                "the campaign, or move it away"
            )


def _request(folder: Path, stage: Stage) -> dict[str, Any]:
    if missing := _missing(folder, stage.needs):
        raise StageError(f"stage {stage.name} needs {', '.join(missing)} in {folder}: run the earlier stages first")
    return {
        "version": bifa.__version__,
        "settings": json.loads(json.dumps(dict(stage.settings))),
        "inputs": {name: digest(folder / name) for name in stage.needs},
    }


def _is_current(folder: Path, stage: Stage, request: dict[str, Any], record: dict[str, Any] | None) -> bool:
    if record is None:
        return False
    made = record.get("artefacts", {})
    other = [n for n in stage.makes if not (folder / n).exists() or made.get(n) != digest(folder / n)]
    if not stage.by_hand:
        return not other and all(record.get(key) == value for key, value in request.items())
    if not other and (differing := _differing(record.get("settings", {}), request["settings"])):
        raise StageError(
            f"{', '.join(stage.makes)} in {folder} was measured with {', '.join(differing)}: use the same "
            f"settings, choose another folder, or measure again with --rerun {stage.name}"
        )
    same_inputs = record.get("inputs") == request["inputs"]
    if other and same_inputs and not _unfinished(folder, stage).exists():
        raise StageError(
            f"{', '.join(other)} in {folder} is not what the stage {stage.name} measured (a file has changed or is "
            f"missing): restore it, or measure again with --rerun {stage.name}"
        )
    return not other and same_inputs


def _differing(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Describe the settings that both contain and that differ; another version may have more or fewer."""
    found = []
    for name in old.keys() & new.keys():
        if isinstance(old[name], Mapping) and isinstance(new[name], Mapping):
            found += _differing(old[name], new[name])
        elif old[name] != new[name]:
            found.append(f"{name} = {old[name]}, not {new[name]}")
    return sorted(found)


def _run(folder: Path, stage: Stage, request: dict[str, Any], records: dict[str, Any]) -> None:
    """Run the stage, record its artefacts, and move them into place, in this order: an interruption in between then
    leaves nothing in the folder that is not on record, and the digests show that the artefacts are not in place yet."""
    scratch = _unfinished(folder, stage)
    begun = _resumed(scratch, stage, request)
    scratch.mkdir(exist_ok=stage.resumes)
    done = False
    try:
        made = _leftover_digests(folder, scratch, stage, begun) or _make(folder, scratch, stage, request)
        _refuse_unrecorded(folder, stage, records)
        records[stage.name] = request | {"artefacts": made}
        _write_json(folder / PROVENANCE, {"bifa": bifa.__version__, "stages": records})
        for name in stage.makes:
            if (scratch / name).exists():
                _replace(scratch / name, folder / name, keep=stage.by_hand)
        done = True
    finally:
        if done or not stage.resumes:
            shutil.rmtree(scratch, ignore_errors=True)


def _unfinished(folder: Path, stage: Stage) -> Path:
    return folder / (f".{stage.name}-unfinished" if stage.resumes else _SCRATCH)


def _resumed(scratch: Path, stage: Stage, request: dict[str, Any]) -> dict[str, Any]:
    """Return what the scratch folder to resume was started with; empty for a new one. If that differs from what is now
    asked for, StageError is raised for a stage done by hand; otherwise the folder is deleted, as is one whose artefacts
    were all moved."""
    if not stage.resumes or not scratch.exists():
        return {}
    # empty after an earlier version or an interruption at the very start
    begun = _read_json(
        scratch / _REQUEST_FILE, "delete it to resume with the settings of now, if they are the original ones"
    )
    moved = "artefacts" in begun and not any((scratch / name).exists() for name in stage.makes)
    if moved or not (stage.by_hand or {key: begun.get(key) for key in request} == request):
        shutil.rmtree(scratch)
        return {}
    differing = _differing(begun.get("settings", {}), request["settings"])
    old = begun.get("inputs", {})
    differing += [f"another {name}" for name, now in request["inputs"].items() if name in old and old[name] != now]
    if differing:
        trials = trials_in(scratch)
        held = f"holds {counted(trials, 'trial')} of the stage {stage.name}, begun"
        raise StageError(
            f"{scratch} {held if trials else 'was begun'} with {', '.join(differing)}: resume with the original "
            "settings and version, move it away to begin this stage again, or choose another folder for a new campaign "
            "(both are then kept)"
        )
    return begun


def trials_in(scratch: Path) -> int:
    """Number of trials that an interrupted stage left in its scratch folder."""
    from bifa.data.layout import TABLE_FILE  # imports numpy, which usage errors need not wait for
    from bifa.data.write import PARTIAL_SUFFIX

    sets = {*scratch.glob(f"**/*{PARTIAL_SUFFIX}"), *(table.parent for table in scratch.glob(f"**/{TABLE_FILE}"))}
    return sum(len(list(data.glob("*.csv"))) for data in sets)


def _leftover_digests(folder: Path, scratch: Path, stage: Stage, begun: Mapping[str, Any]) -> dict[str, str]:
    """Digests of what an earlier run made but did not finish moving; empty if there is nothing."""
    made = begun.get("artefacts", {})
    here = all((scratch / name).exists() or (folder / name).exists() for name in stage.makes)
    return made if here and set(stage.makes) == set(made) else {}


def _make(folder: Path, scratch: Path, stage: Stage, request: dict[str, Any]) -> dict[str, str]:
    """Run the stage, unless an interrupted run has made all artefacts; return their digests."""
    _write_json(scratch / _REQUEST_FILE, request)
    if _missing(scratch, stage.makes):
        stage.run(folder, scratch)
    if missing := _missing(scratch, stage.makes):
        raise StageError(f"stage {stage.name} ended without making {', '.join(missing)}")
    made = {name: digest(scratch / name) for name in stage.makes}
    _write_json(scratch / _REQUEST_FILE, request | {"artefacts": made})
    return made


def _missing(folder: Path, names: Iterable[str]) -> list[str]:
    return [name for name in names if not (folder / name).exists()]


def _replace(new: Path, target: Path, keep: bool) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if keep and target.exists():  # under a name numbered one above the highest, even if lower numbers are missing
        there = target.parent.glob(f"{glob.escape(target.name)}.earlier-*")
        numbers = [path.name.rpartition("-")[2] for path in there]
        last = max((int(number) for number in numbers if number.isdecimal()), default=0)
        os.replace(target, target.with_name(f"{target.name}.earlier-{last + 1}"))
    if target.is_dir():
        shutil.rmtree(target)
    os.replace(new, target)


def _read_records(folder: Path) -> dict[str, Any]:
    def records(content: Any) -> dict[str, Any]:
        return {name: dict(record) for name, record in dict(content["stages"]).items()}

    return _read_json(folder / PROVENANCE, "repair it, or choose another folder to start over", records)


def _read_json(path: Path, remedy: str, parse: Callable[[Any], dict[str, Any]] = dict) -> dict[str, Any]:
    """Return what is in the file, empty if it does not exist. Raises StageError, with the remedy, if it is damaged."""
    try:
        return parse(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return {}
    except (ValueError, KeyError, TypeError) as error:
        raise StageError(f"{path} is damaged ({error}): {remedy}") from None


def _write_json(path: Path, content: dict[str, Any]) -> None:
    write_text(path, json.dumps(content, indent=1, sort_keys=True) + "\n")

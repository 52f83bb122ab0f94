"""Where exports go: which file takes which target, and which files may be replaced."""

from __future__ import annotations

import base64
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote_to_bytes

from . import remote
from .checkpoint import OFF, SUFFIX
from .curve import mark_of
from .declared import check_choice
from .errors import Sdf2vecError
from .export import EXPORTERS, Exporter
from .export.exported import Exported
from .files import one_line, require_writable

STREAM = "-"
LOOKED_AT = 1 << 20  # bytes at both ends of a file in which a mark is looked for


@dataclass(frozen=True)
class Job:
    """One input and the files to write for it."""

    source: str
    outputs: Mapping[str, str]  # target → path or "-"
    checkpoint: str = ""  # path; empty for none
    curves: tuple[str, ...] = ()  # paths


@dataclass(frozen=True)
class Places:
    """What `--emit` and `-o` say together: targets with a file of their own, and those that go to a folder."""

    files: Mapping[str, str]  # target → path or "-"
    folder: str
    named: tuple[str, ...]  # targets of the folder, whose files are named after the input

    @property
    def targets(self) -> tuple[str, ...]:
        """All targets, in the order in which they are written."""
        return tuple(dict.fromkeys((*self.named, *self.files)))

    def outputs(self, source: str, within: str = "") -> dict[str, str]:
        """Target → path for one input; `within`: a folder inside the folder."""
        stem, folder = stem_of(source), Path(self.folder, within)
        named = {target: str(folder / f"{stem}{EXPORTERS[target].suffix}") for target in self.named}
        return named | dict(self.files)


def stem_of(source: str) -> str:
    """What outputs are named after: the same for a picture and for the scene file that was made of it."""
    if source == STREAM:
        return "picture"
    name = remote.name_of(source) if remote.is_url(source) else Path(source).name
    return name.removesuffix(".scene.json") if name.endswith(".scene.json") else Path(name).stem


# --- what --emit and -o say together --------------------------------------------------------------------------


def places_of(
    emit: Sequence[str] | None, given: Sequence[str] | None, default: str, among: Collection[str] = ()
) -> Places:
    """Reads `--emit` and `-o`: `among` are the targets of a command, `default` is the one unless told.

    An output is a folder when it is one, ends in a slash or has no extension. A file takes the target that its ending
    says, or the one that is emitted where no target's file ends so. Raises Sdf2vecError for what contradicts itself.
    """
    known = [name for name in EXPORTERS if not among or name in among]
    asked, outs = _asked(emit, known), list(dict.fromkeys(given or ()))
    folders = [out for out in outs if _is_folder(out)]
    sinks = [out for out in outs if out not in folders and _is_sink(out)]
    if len(folders) + len(sinks) > 1:
        raise Sdf2vecError(f"{_listed(folders + sinks)}: give one folder, or one standard output")
    files: dict[str, str] = {}
    for out in outs:
        if out not in folders and out not in sinks:
            _give(files, _target_of(out, asked, known), out)
    rest = [target for target in asked or [default] if target not in files]
    if not asked and files and not folders and not sinks:
        rest = []
    return _placed(files, rest, folders, sinks)


def _placed(files: dict[str, str], rest: list[str], folders: list[str], sinks: list[str]) -> Places:
    if sinks:
        if len(rest) != 1:
            raise Sdf2vecError("standard output takes one input and one target; give a folder with -o")
        return Places({**files, rest[0]: sinks[0]}, "", ())
    if rest and files and not folders:
        raise Sdf2vecError(
            f"{_listed(rest)}: none of {_listed(list(files.values()))} is for it; give another -o, or a folder"
        )
    if folders and not rest:
        raise Sdf2vecError(f"{_listed(folders)}: nothing is left to write there; name targets with --emit")
    return Places(files, folders[0] if folders else "", tuple(rest))


def _asked(emit: Sequence[str] | None, known: Collection[str]) -> list[str]:
    """The targets that `--emit` names; none without it."""
    if emit is None:
        return []
    targets = list(dict.fromkeys(name.strip() for text in emit for name in text.split(",") if name.strip()))
    if not targets:
        raise Sdf2vecError(f"--emit names nothing; choose from {', '.join(known)}")
    for target in targets:
        check_choice("target", target, known)
    return targets


def _is_folder(out: str) -> bool:
    if out == STREAM:
        return False
    return out.endswith(("/", "\\")) or os.path.isdir(out) or (not Path(out).suffix and not _is_sink(out))


def _is_sink(out: str) -> bool:
    """Standard output, or what takes bytes without being a file: a device, a pipe."""
    is_device = os.path.exists(out) and not os.path.isfile(out) and not os.path.isdir(out)
    return out == STREAM or is_device


def _target_of(out: str, asked: Sequence[str], known: Collection[str]) -> str:
    """The target that goes to a file."""
    name = Path(out).name.lower()
    ends = {target: [len(end) for end in EXPORTERS[target].endings if name.endswith(end)] for target in known}
    fitting = {target: max(sizes) for target, sizes in ends.items() if sizes}
    if asked:
        taken = [target for target in asked if target in fitting] or ([] if fitting else asked)
        if len(taken) == 1:
            return taken[0]
        if fitting:
            raise Sdf2vecError(
                f"{one_line(out)}: its ending says {_listed(list(fitting))}, --emit says {_listed(asked)}; "
                "leave one of them out"
            )
        raise Sdf2vecError(f"{one_line(out)}: which of {_listed(asked)} is it for? give it the ending of one")
    best = [target for target, size in fitting.items() if size == max(fitting.values())]
    usual = [target for target in best if name.endswith(EXPORTERS[target].suffix)]
    for choice in (best, usual):
        if len(choice) == 1:
            return choice[0]
    endings = ", ".join(dict.fromkeys(EXPORTERS[target].endings[-1] for target in known))
    raise Sdf2vecError(
        f"{one_line(out)}: what is it to be? choose with --emit, or one of the endings {endings}"
    )


def _give(files: dict[str, str], target: str, out: str) -> None:
    if target in files:
        raise Sdf2vecError(f"{_listed([files[target], out])}: both are for {target}; give one of them")
    files[target] = out


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(one_line, names))


def read_exports(paths: Iterable[str]) -> dict[str, Exported]:
    """Exports that have been written, by target, with the files beside them. Raises Sdf2vecError."""
    found: dict[str, Exported] = {}
    for path in paths:
        target = _target_of(path, (), EXPORTERS)
        if target in found:
            raise Sdf2vecError(f"{one_line(path)}: a second {target}; check them apart")
        exporter = EXPORTERS[target]
        beside = {ending: beside_of(path, exporter.suffix, ending) for ending in exporter.beside}
        try:
            data = Path(path).read_bytes()
            there = {ending: Path(p).read_bytes() for ending, p in beside.items() if os.path.isfile(p)}
            found[target] = Exported(data.decode() if exporter.is_text else data, there)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "is no text"
            raise Sdf2vecError(f"{one_line(path)}: cannot read it ({reason})") from None
    return found


# --- which files may be written -------------------------------------------------------------------------------


def plan(
    sources: Mapping[str, str],
    places: Places,
    also_read: Collection[str] = (),
    force: bool = False,
    checkpoint: str | None = None,
    curves: Sequence[str] = (),
) -> list[Job]:
    """The files of each input, which is given with the folder inside the output folder that its files go to.

    `checkpoint`: the file of the one input's, "off", or None for one beside the outputs of each. `curves`: files of the
    one input's.

    Raises Sdf2vecError, before anything is written, when two exports would share a file, when one can't be written, and
    when one would replace an input, or (without `force`) a file that this program has not made.
    """
    if len(sources) > 1 and places.files:
        whole = _listed(["standard output" if out == STREAM else out for out in places.files.values()])
        raise Sdf2vecError(
            f"{whole}: takes one input and one target, {len(sources)} inputs are given; give a folder with -o"
        )
    if len(sources) > 1 and checkpoint not in (None, OFF):
        raise Sdf2vecError(f"{one_line(checkpoint)}: is a checkpoint of one input, {len(sources)} are given")
    if len(sources) > 1 and curves:
        raise Sdf2vecError(f"{_listed(curves)}: a curve is of one input, {len(sources)} are given")
    outputs = {source: places.outputs(source, within) for source, within in sources.items()}
    jobs = [
        Job(source, made, _checkpoint(made, checkpoint), tuple(curves)) for source, made in outputs.items()
    ]
    read = {str(Path(path).resolve()) for path in (*sources, *also_read) if path != STREAM}
    taken: dict[str, str] = {}
    tried: set[Path] = set()
    going_on = {str(Path(path).resolve()) for path in also_read}  # from a checkpoint
    for job in jobs:
        for path, exporter in _written(job):
            _claim(path, job.source, taken, read - going_on if path == job.checkpoint else read)
            require_writable(path, tried)
            if not force:
                _refuse_foreign(path, exporter)
        for path in job.curves:
            _claim(path, job.source, taken, read)
            require_writable(path, tried)
            if not force and _is_ours(path, mark_of(path)) is False:
                raise _foreign(path, "--curve")
    return jobs


def _written(job: Job) -> Iterator[tuple[str, Exporter]]:
    """The files of a job's exports, and its checkpoint."""
    yield from ((path, EXPORTERS[target]) for target, path in job.outputs.items() if path != STREAM)
    if job.checkpoint:
        yield job.checkpoint, EXPORTERS["json"]


def _checkpoint(outputs: Mapping[str, str], given: str | None) -> str:
    """The path of a checkpoint: beside the first output, named after it, unless told."""
    if given is not None:
        return "" if given == OFF else given
    beside = [(target, path) for target, path in outputs.items() if path != STREAM and not _is_sink(path)]
    return beside_of(beside[0][1], EXPORTERS[beside[0][0]].suffix, SUFFIX) if beside else ""


def _claim(path: str, source: str, taken: dict[str, str], read: set[str]) -> None:
    resolved = str(Path(path).resolve())
    if resolved in read:
        raise Sdf2vecError(f"{one_line(path)}: would overwrite an input; choose another -o")
    if resolved in taken:
        both = f"both {one_line(taken[resolved])} and {one_line(source)}"
        raise Sdf2vecError(f"{one_line(path)}: {both} would be written there; convert them apart")
    taken[resolved] = source


def _refuse_foreign(path: str, exporter: Exporter) -> None:
    """Raises Sdf2vecError where a file is there that this program has not made: it, or one that goes beside it."""
    is_ours = _is_ours(path, exporter.mark)
    beside = [beside_of(path, exporter.suffix, ending) for ending in exporter.beside]
    foreign = [path] if is_ours is False else []
    foreign += [other for other in beside if is_ours is None and _is_ours(other, exporter.mark) is False]
    if foreign:
        raise _foreign(foreign[0], "-o")


def _foreign(path: str, option: str) -> Sdf2vecError:
    return Sdf2vecError(
        f"{one_line(path)}: is there, and not made by sdf2vec; choose another {option}, or replace it with --force"
    )


def beside_of(path: str, suffix: str, ending: str) -> str:
    """The path of a file beside an export: what takes the place of its suffix is known."""
    return path.removesuffix(suffix) + ending if path.endswith(suffix) else path + ending[len(suffix) :]


def _is_ours(path: str, mark: bytes) -> bool | None:
    """Whether a file carries the mark of a target. None where there is nothing to lose: no file, an empty one."""
    try:
        if not os.path.isfile(path) or os.path.getsize(path) == 0:
            return None
        with open(path, "rb") as stream:
            start = stream.read(LOOKED_AT)
            stream.seek(max(LOOKED_AT, os.path.getsize(path) - LOOKED_AT))
            return mark in _plain(start) or mark in stream.read()
    except OSError:
        return False


def _plain(data: bytes) -> bytes:
    """What an address holds; anything else as it is."""
    if not data.startswith(b"data:"):
        return data
    head, _, rest = data.partition(b",")
    return (
        base64.b64decode(rest[: len(rest) // 4 * 4]) if head.endswith(b";base64") else unquote_to_bytes(rest)
    )

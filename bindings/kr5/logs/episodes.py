"""Which recordings of data sets are read (`--episodes 3,7-12`), and how options name logs and episodes."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import kr5
from kr5.logs.log_file import episodes_of

MOST = 10  # episodes that are read where none are chosen
MOST_CHOSEN = 10_000
PART = re.compile(r"(\d+)(?:-(\d+))?")


@dataclass(frozen=True)
class LogSource:
    """A log, or an episode of a data set."""

    file: Path
    episode: int | None = None

    @property
    def name(self) -> str:
        return self.file.name if self.episode is None else f"{self.file.name} episode {self.episode}"

    @property
    def path(self) -> str:
        """The name with the folders of the file."""
        return str(self.file.absolute().with_name(self.name))


def parse_episodes(text: str) -> list[int]:
    """The numbers that a text names: `3,7-9` is 3, 7, 8, 9."""
    out: list[int] = []
    for part in text.split(","):
        match = PART.fullmatch(part.strip())
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last < first + MOST_CHOSEN:
            raise kr5.InvalidArgument(f"--episodes: found {text!r:.60}, expected numbers and ranges, such as 3,7-12")
        out += [number for number in range(first, last + 1) if number not in out]
    return out


def log_sources(files: Sequence[Path], episodes: str = "") -> tuple[list[LogSource], list[str]]:
    """The logs of files, of data sets the episodes that a text names, else some spread evenly; notes say which."""
    out: list[LogSource] = []
    notes: list[str] = []
    wanted = parse_episodes(episodes) if episodes else []
    sets = 0
    for file in files:
        if not (known := episodes_of(file)):
            out.append(LogSource(file))
            continue
        sets += 1
        chosen = _chosen(file, known, wanted)
        if not wanted and len(chosen) < len(known):
            notes.append(
                f"{file.name} has {len(known)} episodes, of which {', '.join(map(str, chosen))} are read; --episodes"
                f" {known[0]}-{known[min(len(known), MOST) - 1]} chooses others"
            )
        out += [LogSource(file, number) for number in chosen]
    if wanted and not sets:
        raise kr5.FileError(files[0], "is no data set with episodes; leave --episodes out")
    return out, notes


def kept_to_check(sources: Sequence[LogSource], text: str) -> list[bool]:
    """Which logs or episodes a text names as those to judge by: names of files, numbers of episodes, such as
    `7-9` or `step.csv,ramp.csv`."""
    if not text:
        return [False] * len(sources)
    words = [word.strip() for word in text.split(",") if word.strip()]
    out = [any(_names(word, source) for word in words) for source in sources]
    unknown = [word for word in words if not any(_names(word, source) for source in sources)]
    if unknown or all(out):
        shown = ", ".join(source.name for source in sources[:12])
        what = f"found {unknown[0]!r}, which is none of the logs" if unknown else "found every log, expected one to fit"
        raise kr5.InvalidArgument(f"--check: {what}: {shown}; name files, or numbers of episodes, such as 7-9")
    return out


def stated_ends(sources: Sequence[LogSource], ends: Mapping[str, float]) -> list[float]:
    """Up to which time each log or episode is used [s]. `ends`: times by what names logs; by "" that of all."""
    if unknown := [word for word in ends if word and not any(_names(word, source) for source in sources)]:
        shown = ", ".join(source.name for source in sources[:12])
        raise kr5.InvalidArgument(
            f"--set end.{unknown[0]}: names none of the logs: {shown}; name a file, or the number of an episode, such"
            f" as end.{short_name(sources[0], sources) or sources[0].file.name}={ends[unknown[0]]:g}"
        )
    return [
        min((end for word, end in ends.items() if not word or _names(word, source)), default=math.inf)
        for source in sources
    ]


def short_name(source: LogSource, sources: Sequence[LogSource]) -> str:
    """The shortest words that name one log or episode among others; none where there are no others."""
    if len(set(sources)) < 2:
        return ""
    words = [] if source.episode is None else [str(source.episode)]
    words += [source.file.name] if source.episode is None else [source.name]
    alone = [word for word in words if sum(_names(word, other) for other in set(sources)) == 1]
    return alone[0] if alone else source.path


def _names(word: str, source: LogSource) -> bool:
    if source.episode is not None and PART.fullmatch(word):
        return source.episode in parse_episodes(word)
    names = (source.file.name, source.file.stem, str(source.file), source.name, source.path)
    return word.rstrip("/") in names


def _chosen(file: Path, known: list[int], wanted: list[int]) -> list[int]:
    if absent := [number for number in wanted if number not in known]:
        raise kr5.FileError(
            file,
            f"has no episode {', '.join(map(str, absent[:8]))}; it has {len(known)}, from {known[0]} to {known[-1]}:"
            f" --episodes {known[0]}-{known[min(len(known), MOST) - 1]}",
        )
    if wanted or len(known) <= MOST:
        return wanted or known
    return [known[k] for k in np.unique(np.linspace(0, len(known) - 1, MOST).round().astype(int))]

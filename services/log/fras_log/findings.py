"""What verification found."""

from collections import Counter
from dataclasses import dataclass, field, replace

# After so many of a kind the rest is counted only.
MOST_OF_A_KIND = 20


@dataclass(frozen=True)
class Finding:
    """Something that is not as it was recorded.

    Attributes
    ----------
    kind : str
        `structure` (bytes), `end` (the file ends too early), `parts` (a file of the log is missing,
        or another one), `chain` (a message that was changed,
        moved, added or left out), `signature`, `version` (a newer FRAS wrote it), `sequence`
        (messages that never arrived), `schema` (a payload that does not fit its key), `interlock`
        (the arms moved without a verdict, or a verdict on a state of theirs that is not there).
    text : str
        What is wrong.
    offset : int
        Where in the file; -1 where that has no place.
    topic, sequence, tick
        Of the message, if it is one; "" and -1 else.
    file : str
        In which file of a log that has several; else empty.
    """

    kind: str
    text: str
    offset: int = -1
    topic: str = ""
    sequence: int = -1
    tick: int = -1
    file: str = ""

    def __str__(self) -> str:
        place = [self.file] if self.file else []
        place += [f"offset {self.offset}"] if self.offset >= 0 else []
        if self.topic:
            place += [self.topic, f"number {self.sequence}", f"tick {self.tick}"]
        return f"{self.kind}: {self.text}" + (f" ({', '.join(place)})" if place else "")


@dataclass
class Verification:
    """What was found.

    Attributes
    ----------
    messages, chained : int
        How many there are, and how many of them, from the first, the chain vouches for.
    head : str
        Of the chain after the last message, hexadecimal.
    signed_by : str
        Fingerprint of the key of the signatures, if all of them are its; else empty.
    trusted : bool
        Whether it is one that the reader trusts.
    closed : bool
        Whether the recorder finished the file.
    opening : dict of str to str
        What the log says of itself.
    parts : int
        How many files it has.
    unfinished : list of str
        Those whose recorder never finished them, so that the next one vouches for their end.
    file : str
        What is added is of this file; empty if there is one alone.
    """

    messages: int = 0
    chained: int = 0
    head: str = ""
    signed_by: str = ""
    trusted: bool = False
    closed: bool = False
    opening: dict[str, str] = field(default_factory=dict[str, str])
    parts: int = 1
    unfinished: list[str] = field(default_factory=list[str])
    file: str = ""
    findings: list[Finding] = field(default_factory=list[Finding])
    beyond: Counter[str] = field(default_factory=Counter[str])
    _of_a_kind: Counter[str] = field(default_factory=Counter[str])

    @property
    def intact(self) -> bool:
        """Whether nothing is wrong and the file is complete."""
        return self.closed and not self.findings

    @property
    def authentic(self) -> bool:
        """Whether, besides, all of it is signed with a key that is trusted."""
        return self.intact and self.trusted

    def only(self, *kinds: str) -> bool:
        """Whether something was found, and nothing but of these kinds."""
        return bool(self.findings) and all(one.kind in kinds for one in self.findings)

    def add(self, finding: Finding) -> None:
        """Note something wrong."""
        if not finding.file:
            finding = replace(finding, file=self.file)
        self._of_a_kind[finding.kind] += 1
        if self._of_a_kind[finding.kind] <= MOST_OF_A_KIND:
            self.findings.append(finding)
        else:
            self.beyond[finding.kind] += 1

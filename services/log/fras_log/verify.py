"""Whether a log is what was recorded: bytes, chain, signature, numbers, payloads, interlock."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fras_common.codec import HeaderFields, MalformedMessage, decode, read_header
from fras_common.messages import RobotState, Verdict
from fras_common.topics import ROBOT_STATE, VERDICT, Qos, topic_of
from fras_log.chain import (
    LEAF_BYTES,
    Checkpoint,
    closing_to_sign,
    first_difference,
    first_head,
    leaf,
    next_head,
    to_sign,
)
from fras_log.errors import ForeignLog
from fras_log.keys import PublicKey
from fras_log.names import CHECKPOINT, CLOSED, METADATA
from fras_log.scan import Attached, Broken, Ended, Recorded, Told, scan

__all__ = ["Finding", "Verification", "verify_file"]

# After so many of a kind the rest is counted only.
MOST_OF_A_KIND = 20


@dataclass(frozen=True)
class Finding:
    """Something that is not as it was recorded.

    Attributes
    ----------
    kind : str
        `structure` (bytes), `chain` (a message that was changed, moved, added or left out),
        `signature`, `sequence` (messages that never arrived), `schema` (a payload that does not
        fit its key), `interlock` (the arms moved without a verdict).
    text : str
        What is wrong.
    offset : int
        Where in the file; -1 where that has no place.
    topic, sequence, tick
        Of the message, if it is one; "" and -1 else.
    """

    kind: str
    text: str
    offset: int = -1
    topic: str = ""
    sequence: int = -1
    tick: int = -1

    def __str__(self) -> str:
        place = [f"offset {self.offset}"] if self.offset >= 0 else []
        if self.topic:
            place += [self.topic, f"number {self.sequence}", f"tick {self.tick}"]
        return f"{self.kind}: {self.text}" + (f" ({', '.join(place)})" if place else "")


@dataclass
class Verification:
    """What was found.

    Attributes
    ----------
    messages, chained : int
        How many there are, and how many of them the chain vouches for.
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
    """

    messages: int = 0
    chained: int = 0
    head: str = ""
    signed_by: str = ""
    trusted: bool = False
    closed: bool = False
    opening: dict[str, str] = field(default_factory=dict[str, str])
    findings: list[Finding] = field(default_factory=list[Finding])
    beyond: Counter[str] = field(default_factory=Counter[str])

    @property
    def intact(self) -> bool:
        """Whether nothing is wrong and the file is complete."""
        return self.closed and not self.findings

    @property
    def authentic(self) -> bool:
        """Whether, besides, all of it is signed with a key that is trusted."""
        return self.intact and self.trusted

    def add(self, finding: Finding) -> None:
        """Note something wrong."""
        if sum(one.kind == finding.kind for one in self.findings) < MOST_OF_A_KIND:
            self.findings.append(finding)
        else:
            self.beyond[finding.kind] += 1


def verify_file(path: Path, trusted: Sequence[PublicKey] = (), head: str = "") -> Verification:
    """Verify a log.

    Parameters
    ----------
    path : Path
    trusted : sequence of PublicKey
        Whose signatures make it authentic.
    head : str
        Head that was noted elsewhere when the log was closed; empty: none was.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog
        There is nothing to verify.
    """
    verifier = _Verifier(trusted)
    for event in scan(path):
        match event:
            case Recorded():
                verifier.take_message(event)
            case Told():
                verifier.take_metadata(event)
            case Attached(name=name, content=content):
                verifier.attachments[name] = content
            case Broken(offset=offset, text=text):
                verifier.broken(offset, text)
            case Ended():
                verifier.found.closed = verifier.closing is not None
    if not verifier.found.opening and not verifier.found.findings:
        raise ForeignLog(path, "it has no record `fras`")
    return verifier.finish(head)


class _Verifier:
    def __init__(self, trusted: Sequence[PublicKey]) -> None:
        self.found = Verification()
        self.attachments: dict[str, bytes] = {}
        self.closing: dict[str, str] | None = None
        self._trusted = trusted
        self._key: PublicKey | None = None
        self._signed = True
        self._head: bytes | None = None
        self._stretch: list[tuple[bytes, Recorded, HeaderFields | None]] = []
        self._lost_stretch = False
        self._next: dict[tuple[str, str], int] = {}
        self._verdicts: set[tuple[str, int]] = set()
        self._moved: list[tuple[Recorded, RobotState]] = []

    # --- what is read ---------------------------------------------------------------------

    def take_metadata(self, told: Told) -> None:
        if told.name == METADATA:
            self.found.opening = told.content
            if raw := told.content.get("public_key", ""):
                self._key = PublicKey(bytes.fromhex(raw))
        elif told.name == CHECKPOINT:
            self._take_checkpoint(told)
        elif told.name == CLOSED:
            self.closing = told.content
            self._take_closing(told)

    def take_message(self, message: Recorded) -> None:
        self.found.messages += 1
        one = leaf(
            message.topic,
            message.log_time,
            message.publish_time,
            message.sequence,
            message.payload,
        )
        header = read_header(message.payload)
        self._stretch.append((one, message, header))
        if header is not None:
            self._count(message, header)
        self._understand(message, header)

    def broken(self, offset: int, text: str) -> None:
        self._lost_stretch = True
        self.found.add(Finding("structure", text, offset))

    def finish(self, head: str) -> Verification:
        found = self.found
        if self._stretch:
            self._add_unvouched()
        found.head = self._head_now().hex()
        if head and head != found.head:
            text = f"the head is {found.head}, not the one that was noted"
            found.add(Finding("chain", text))
        self._check_interlock()
        if self._key is not None and self._signed and found.chained == found.messages:
            found.signed_by = self._key.fingerprint
            found.trusted = self._key in self._trusted
        return found

    # --- the chain ------------------------------------------------------------------------

    def _head_now(self) -> bytes:
        if self._head is None:
            self._head = first_head(self.found.opening, self.attachments)
        return self._head

    def _take_checkpoint(self, told: Told) -> None:
        try:
            checkpoint = Checkpoint.of_metadata(told.content)
        except ValueError as error:
            self.broken(told.offset, str(error))
            return
        stretch, self._stretch = self._stretch, []
        head = self._head_now()
        for one, _, _ in stretch:
            head = next_head(head, one)
        self._head = head
        self._check_signature(told, checkpoint)
        whole = head == checkpoint.head
        if whole and checkpoint.messages == self.found.messages:
            self.found.chained = self.found.messages
        else:
            self._explain(told, checkpoint, stretch)
            # What comes next is held against what was written, not against the damage.
            self._head = checkpoint.head
        self._lost_stretch = False

    def _explain(
        self,
        told: Told,
        checkpoint: Checkpoint,
        stretch: list[tuple[bytes, Recorded, HeaderFields | None]],
    ) -> None:
        """Name the first message that is not the one recorded."""
        leaves = [one[:LEAF_BYTES] for one, _, _ in stretch]
        index = first_difference(leaves, checkpoint.leaves)
        many = f"{len(stretch)} messages where {len(checkpoint.leaves)} were recorded"
        if self._lost_stretch and not stretch:
            self.found.add(Finding("chain", f"{many}: this piece is lost", told.offset))
        elif index is None:
            text = "the chain is broken before this piece, or what the log says of itself changed"
            self.found.add(Finding("chain", text, told.offset))
        elif index < len(stretch):
            _, message, header = stretch[index]
            tick = header.tick if header is not None else -1
            how = "this message was changed, moved or put in"
            if leaves[index] in checkpoint.leaves:
                how = "messages before this one are missing or were moved"
            self.found.add(
                Finding("chain", how, message.offset, message.topic, message.sequence, tick)
            )
        else:
            text = f"{many}: the last ones are missing"
            self.found.add(Finding("chain", text, told.offset))

    def _add_unvouched(self) -> None:
        for one, _, _ in self._stretch:
            self._head = next_head(self._head_now(), one)
        _, message, header = self._stretch[0]
        text = f"{len(self._stretch)} messages at the end that no checkpoint vouches for"
        tick = header.tick if header is not None else -1
        self.found.add(
            Finding("chain", text, message.offset, message.topic, message.sequence, tick)
        )

    def _check_signature(self, told: Told, checkpoint: Checkpoint) -> None:
        text = to_sign(checkpoint.messages, checkpoint.head)
        self._check_signed(told, checkpoint.signature, text)

    def _take_closing(self, told: Told) -> None:
        try:
            signature = bytes.fromhex(told.content.get("signature", ""))
        except ValueError:
            signature = b""
        self._check_signed(told, signature, closing_to_sign(told.content))
        head = self._head_now().hex()
        if told.content.get("head") != head:
            text = f"the closing record has another head than the messages, {head}"
            self.found.add(Finding("chain", text, told.offset))
        if told.content.get("messages") != str(self.found.messages):
            text = f"the closing record counts {told.content.get('messages')} messages"
            self.found.add(Finding("chain", text, told.offset))

    def _check_signed(self, told: Told, signature: bytes, text: bytes) -> None:
        if self._key is None:
            self._signed = False
        elif not self._key.has_signed(signature, text):
            self._signed = False
            said = f"a record that key {self._key.fingerprint} has not signed"
            self.found.add(Finding("signature", said, told.offset))

    # --- what the messages say ------------------------------------------------------------

    def _count(self, message: Recorded, header: HeaderFields) -> None:
        stream = (message.topic, header.source)
        expected = self._next.get(stream)
        # One that begins in mid-stream is no gap: the publisher is older than the log. Telemetry
        # may be lost: the next one replaces it.
        topic = topic_of(message.topic)
        lossy = topic is not None and topic.qos is Qos.TELEMETRY
        if expected is not None and header.seq > expected and not lossy:
            text = f"{header.seq - expected} messages before this one never arrived"
            self.found.add(
                Finding("sequence", text, message.offset, message.topic, header.seq, header.tick)
            )
        self._next[stream] = max(header.seq + 1, expected or 0)

    def _understand(self, message: Recorded, header: HeaderFields | None) -> None:
        topic = topic_of(message.topic)
        if topic is None:
            return
        try:
            decoded = decode(topic.type, message.payload, message.topic)
        except MalformedMessage as error:
            tick = header.tick if header is not None else -1
            self.found.add(
                Finding("schema", str(error), message.offset, message.topic, message.sequence, tick)
            )
            return
        if isinstance(decoded, Verdict) and topic is VERDICT:
            self._verdicts.add((decoded.trial, decoded.tick))
        elif isinstance(decoded, RobotState) and topic is ROBOT_STATE:
            self._moved.append((message, decoded))

    def _check_interlock(self) -> None:
        """Each tick follows on the verdict for the one before; keys have no order between them."""
        for message, state in self._moved:
            if state.tick <= 0:
                continue
            judged = (state.trial, state.tick - 1) in self._verdicts
            if not judged or state.verdict_tick != state.tick - 1:
                text = f"the arms moved on verdict {state.verdict_tick}"
                text += "" if judged else f", and there is none for tick {state.tick - 1}"
                self.found.add(
                    Finding(
                        "interlock",
                        text,
                        message.offset,
                        message.topic,
                        message.sequence,
                        state.tick,
                    )
                )

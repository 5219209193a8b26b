"""Whether a log holds the messages that were recorded, and who says so: chain and signatures."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fras_log.chain import (
    LEAF_BYTES,
    Checkpoint,
    closing_to_sign,
    first_difference,
    first_head,
    leaf,
    next_head,
    record_digest,
    to_sign,
)
from fras_log.events import Attached, Began, Recorded, Told
from fras_log.findings import Finding, Verification
from fras_log.keys import PublicKey
from fras_log.names import BESIDE, CHECKPOINT, CLOSED, METADATA, PROFILE

MOST_OF_A_STRETCH = 200_000
"""Messages between two checkpoints; a recorder writes one at the latest after 16,384."""


class _Place(NamedTuple):
    """A message of the stretch under way, without its payload."""

    leaf: bytes
    offset: int
    topic: str
    sequence: int
    tick: int

    def finding(self, text: str) -> Finding:
        return Finding("chain", text, self.offset, self.topic, self.sequence, self.tick)


class GoesOn(NamedTuple):
    """Where the file behind one says that it goes on."""

    file: str
    messages: int
    head: str


class Custody:
    """Follows the chain of a file.

    Parameters
    ----------
    found : Verification
        Where to put what is wrong.
    trusted : sequence of PublicKey

    Attributes
    ----------
    opening : dict of str to str or None
        What the file says of itself.
    closing : dict of str to str or None
        How it was finished.
    messages, chained : int
        How many there are, and how many of them, from the first, the chain vouches for.
    head : str
        Of the chain after the last message, hexadecimal; known at the end.
    signed_by : str
        Fingerprint of the key of the signatures, if all of them are its; else empty.
    trusted : bool
        Whether it is one that the reader trusts.
    """

    def __init__(self, found: Verification, trusted: Sequence[PublicKey]) -> None:
        self.opening: dict[str, str] | None = None
        self.closing: dict[str, str] | None = None
        self.messages = 0
        self.chained = 0
        self.head = ""
        self.signed_by = ""
        self.trusted = False
        self._found = found
        self._trusted_keys = trusted
        self._attachments: dict[str, bytes] = {}
        self._beside: dict[str, str] = {}
        self._key: PublicKey | None = None
        self._signed = True
        # One head; after a piece that is not what its checkpoint tells, the other one, too.
        self._heads: tuple[bytes, ...] = ()
        self._stretch: list[_Place] = []
        self._lost_stretch = False
        self._unbroken = True
        self._counts: tuple[int, ...] = (0,)

    # --- what is read ---------------------------------------------------------------------

    def begin(self, began: Began) -> None:
        """Take the header."""
        if began.profile != PROFILE:
            text = f"the file's profile is {began.profile!r}, not {PROFILE!r}"
            self._found.add(Finding("structure", text, began.offset))

    def take_metadata(self, told: Told) -> None:
        """Take a metadata record."""
        if told.name == METADATA:
            self._take_opening(told)
        elif told.name == CHECKPOINT:
            self._take_checkpoint(told)
        elif self.closing is not None:
            self._misplaced(told.offset, f"a record {told.name!r} after the closing one")
        elif told.name == CLOSED:
            self.closing = told.content
            self._take_closing(told)
        elif told.name in self._beside:
            self._misplaced(told.offset, f"a second record {told.name!r}")
        else:
            self._beside[told.name] = record_digest(told.content)

    def attach(self, attached: Attached) -> None:
        """Take an attachment."""
        if self._heads or self._stretch:
            self._misplaced(attached.offset, f"attachment {attached.name!r} after the messages")
        elif attached.name in self._attachments:
            self._misplaced(attached.offset, f"a second attachment {attached.name!r}")
        else:
            self._attachments[attached.name] = attached.content

    def take_message(self, message: Recorded, tick: int) -> None:
        """Take a message."""
        self.messages += 1
        offset, channel, log_time, publish_time, sequence, payload = message
        one = leaf(channel.digest, log_time, publish_time, sequence, payload)
        self._stretch.append(_Place(one, offset, channel.topic, sequence, tick))
        if len(self._stretch) >= MOST_OF_A_STRETCH:
            self._give_up_stretch()

    def _give_up_stretch(self) -> None:
        """Keep the head of what no checkpoint ends, and not each message of it."""
        stretch, self._stretch = self._stretch, []
        text = f"{len(stretch)} messages from here on without a checkpoint: no recorder does that"
        self._found.add(stretch[0].finding(text))
        self._heads = self._heads_after(stretch)
        self._counts = tuple(count + len(stretch) for count in self._counts)
        self._unbroken = False

    def lose(self) -> None:
        """Note that messages may be missing here."""
        self._lost_stretch = True

    def finish(self, goes_on: GoesOn | None = None) -> bool:
        """Say what the file comes to.

        Parameters
        ----------
        goes_on : GoesOn, optional
            What the next file says of the end of this one.

        Returns
        -------
        bool
            Whether the next file vouches for this end, however it came.
        """
        found, stretch = self._found, self._stretch
        if self.opening is None:
            found.add(Finding("structure", f"the record {METADATA!r} is missing"))
        if stretch:
            self._heads = self._heads_after(stretch)
        self.head = (self._heads or self._first())[0].hex()
        vouched = goes_on is not None and goes_on[1:] == (self.messages, self.head)
        if vouched:
            self.chained += len(stretch) if self._unbroken else 0
        elif stretch:
            text = f"{len(stretch)} messages from here on that no checkpoint vouches for"
            found.add(stretch[0].finding(text))
        if goes_on is not None and not vouched:
            text = (
                f"{goes_on.file} goes on after {goes_on.messages} messages and head "
                f"{goes_on.head}; here are {self.messages}, and the head is {self.head}"
            )
            found.add(Finding("chain", text))
        if self.closing is None and self._beside:
            # The next file vouches for messages alone.
            found.add(Finding("structure", f"no closing record vouches for {list(self._beside)}"))
        if self._key is not None and self._signed and self.chained == self.messages:
            self.signed_by = self._key.fingerprint
            self.trusted = self._key in self._trusted_keys
        return vouched

    # --- records --------------------------------------------------------------------------

    def _misplaced(self, offset: int, text: str) -> None:
        self._found.add(Finding("structure", text, offset))

    def _take_opening(self, told: Told) -> None:
        if self.opening is not None or self._heads or self._stretch:
            self._misplaced(told.offset, f"a second record {METADATA!r}, or one after messages")
            return
        self.opening = told.content
        if raw := told.content.get("public_key", ""):
            try:
                self._key = PublicKey(bytes.fromhex(raw))
            except ValueError:
                text = "the public key in the opening record is none"
                self._found.add(Finding("signature", text, told.offset))

    def _take_checkpoint(self, told: Told) -> None:
        try:
            checkpoint = Checkpoint.of_metadata(told.content)
        except ValueError as error:
            self._misplaced(told.offset, str(error))
            self.lose()
            return
        if self.closing is not None:
            self._misplaced(told.offset, "a checkpoint after the closing record")
        stretch, self._stretch = self._stretch, []
        heads = self._heads_after(stretch)
        is_first = not self._heads
        self._check_signed(
            told, checkpoint.signature, to_sign(checkpoint.messages, checkpoint.head)
        )
        counts = tuple(count + len(checkpoint.leaves) for count in self._counts)
        if checkpoint.head in heads and checkpoint.messages in counts:
            self._heads, self._counts = (checkpoint.head,), (checkpoint.messages,)
            if self._unbroken:
                self.chained += len(stretch)
            if len(stretch) != len(checkpoint.leaves):
                for finding in self._explain(told, checkpoint, stretch, is_first=is_first):
                    self._found.add(finding)
            elif [one.leaf[:LEAF_BYTES] for one in stretch] != list(checkpoint.leaves):
                text = "the leaves in this checkpoint were changed; its messages were not"
                self._found.add(Finding("chain", text, told.offset))
        else:
            self._unbroken = False
            for finding in self._explain(told, checkpoint, stretch, is_first=is_first):
                self._found.add(finding)
            # What comes next is held against what was written here, and against what is here.
            self._heads = (checkpoint.head, *heads[:1])
            self._counts = (checkpoint.messages, *counts[:1])
        self._lost_stretch = False

    def _take_closing(self, told: Told) -> None:
        content = told.content
        try:
            signature = bytes.fromhex(content.get("signature", ""))
        except ValueError:
            signature = b""
        self._check_signed(told, signature, closing_to_sign(content))
        heads = [head.hex() for head in self._heads or self._first()]
        if content.get("head") not in heads:
            text = f"the closing record has another head than the messages, {heads[0]}"
            self._found.add(Finding("chain", text, told.offset))
        if content.get("messages") != str(self.messages):
            text = (
                f"the closing record counts {content.get('messages')} messages, there are "
                f"{self.messages}"
            )
            self._found.add(Finding("chain", text, told.offset))
        vouched = {
            name.removeprefix(BESIDE): digest
            for name, digest in content.items()
            if name.startswith(BESIDE)
        }
        for name in sorted(vouched.keys() | self._beside.keys()):
            if vouched.get(name) != self._beside.get(name):
                text = f"record {name!r} is not the one that the closing record vouches for"
                self._found.add(Finding("chain", text, told.offset))

    def _check_signed(self, told: Told, signature: bytes, text: bytes) -> None:
        if self._key is None:
            self._signed = False
        elif not self._key.has_signed(signature, text):
            self._signed = False
            said = f"record {told.name!r} is not signed with key {self._key.fingerprint}"
            self._found.add(Finding("signature", said, told.offset))

    # --- the chain ------------------------------------------------------------------------

    def _first(self) -> tuple[bytes, ...]:
        return (first_head(self.opening or {}, self._attachments),)

    def _heads_after(self, stretch: Iterable[_Place]) -> tuple[bytes, ...]:
        heads: list[bytes] = []
        places = list(stretch)
        for head in self._heads or self._first():
            for one in places:
                head = next_head(head, one.leaf)
            heads.append(head)
        return tuple(heads)

    def _explain(
        self, told: Told, checkpoint: Checkpoint, stretch: list[_Place], *, is_first: bool
    ) -> Iterable[Finding]:
        """Name the messages that are not the ones recorded."""
        found = [one.leaf[:LEAF_BYTES] for one in stretch]
        recorded = checkpoint.leaves
        many = f"{len(found)} messages here where {len(recorded)} were recorded"
        index = first_difference(found, recorded)
        if index is None:
            text = f"these {len(found)} messages, their count or this checkpoint were changed"
            if is_first:
                text = "the opening record or an attachment was changed or lost, or else " + text
            return [Finding("chain", text, told.offset)]
        if self._lost_stretch and not found:
            return [Finding("chain", f"{many}: this piece is lost", told.offset)]
        if index == len(found):
            return [Finding("chain", f"{many}: the last ones are missing", told.offset)]
        changed = [
            number
            for number, (one, other) in enumerate(zip(found, recorded, strict=False))
            if one != other
        ]
        edited = len(found) == len(recorded) and not any(
            found[number] in recorded or recorded[number] in found for number in changed
        )
        if edited:
            return [stretch[number].finding("this message was changed") for number in changed]
        return [stretch[index].finding(_how(found, recorded, index, many))]


def _how(found: list[bytes], recorded: tuple[bytes, ...], index: int, many: str) -> str:
    """Say what was done where two sequences of leaves part."""
    here, meant = found[index], recorded[index]
    if sorted(found) == sorted(recorded):
        return "messages from this one on are in another order than they were recorded in"
    if here in recorded[:index]:
        return f"this message is a copy of an earlier one; {many}"
    if here in recorded[index:]:
        missing = recorded.index(here, index) - index
        return f"{missing} messages before this one are missing; {many}"
    if meant in found[index:]:
        return f"this message was put in; {many}"
    return f"this message was changed; {many}"

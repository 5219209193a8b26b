"""The one tree of errors: each carries its values as attributes, its text says what to do."""

SHOWN_LENGTH = 2_000


class FrasError(Exception):
    """Base of every error that FRAS raises on purpose.

    Parameters
    ----------
    text : str
        What was wrong with which value, where, and what to do about it. It goes on after `fras: `
        or another text, so it begins without a capital and ends without a full stop. Commands
        stand in backquotes; what can't be done "can't" be done.
    **values
        The numbers and names behind the text; they become attributes, so that a shell can
        publish them and a test can read them without parsing prose.
    """

    def __init__(self, text: str, **values: object) -> None:
        super().__init__(text)
        self.values = values
        for name, value in values.items():
            setattr(self, name, value)

    #: Name under which health counts it where a message is refused with it; its kind if empty.
    counted_as = ""

    @property
    def kind(self) -> str:
        """Name that travels with the error over the bus."""
        return type(self).__name__


def shown(value: object) -> str:
    """Return a value as an error's text shows it, however long or deep it is."""
    try:
        text = repr(value)
    except RecursionError:
        return "something nested too deeply to be shown"
    return text if len(text) <= SHOWN_LENGTH else f"{text[:SHOWN_LENGTH]}..."

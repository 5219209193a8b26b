"""What is wrong with a scenario."""

from fras_common.errors import FrasError, shown


class ScenarioError(FrasError):
    """A scenario that can't be run."""

    def __init__(self, file: str, key: str, value: object, allowed: str) -> None:
        super().__init__(
            f"{file}: {key} = {shown(value)}: {allowed}",
            file=file,
            key=key,
            value=value,
            allowed=allowed,
        )

"""The page of all keys, from the topic table."""

from inspect import getdoc
from typing import Any

from fras_common.rows import Qos, Query, Topic
from fras_common.topics import CRTK, QUERIES, TOPICS
from manual.markdown import code, page, prose, table

_PRODUCERS = {"*": "each service", "client": "any client"}
_ASKERS: dict[tuple[str, ...], str] = {("*",): "anyone", (): "nobody"}
_CRTK = {topic.key for arm in CRTK for topic in arm.all}


def keys_page() -> str:
    """Return the page: what is published, what can be asked, how it travels."""
    return page(
        "Keys",
        prose(
            """Everything that one process tells another, made from the one table of the code,
            `services/common/fras_common/topics.py`. On the wire each key stands below the
            cell's namespace: `sim/tissue_state` is `fras/local/sim/tissue_state` in the
            cell `local`. What the messages hold: [messages](messages.md). Who may do what
            with certificates: [security](../security.md#who-may-do-what)."""
        ),
        "## Published",
        table(
            ("key", "message", "from", "when", "class", "in a trial", "at most", "kept"),
            (_topic_row(topic) for topic in TOPICS if topic.key not in _CRTK),
        ),
        prose(
            """`in a trial`: the message belongs to one, and is dropped and counted outside of
            it. `at most`: a longer message is refused. `kept`: how many the publisher keeps
            for who lost them or comes late."""
        ),
        "## Each arm",
        prose(
            f"""Below {" and ".join(code(arm.arm + "/") for arm in CRTK)}; [arms by CRTK](crtk.md)
            says what each means and what refuses a command."""
        ),
        table(
            ("key", "message", "from", "when", "class", "at most"),
            (
                (
                    code(topic.key.partition("/")[2]),
                    _message(topic.type),
                    _PRODUCERS.get(topic.producer, topic.producer),
                    topic.when,
                    topic.qos.value,
                    _size(topic.max_bytes),
                )
                for topic in CRTK[0].all
            ),
        ),
        "## Asked",
        prose(
            """Each question has one service that answers it, and a mirror, an
            [RpcRecord](messages.md#rpcrecord) on `rpc/<service>/<name>`, so that the log
            holds it with its answer. `who may`: with certificates; without them anyone can."""
        ),
        table(
            ("key", "question", "answer", "answered by", "who may", "at most"),
            (_query_row(query) for query in QUERIES),
        ),
        "## Classes",
        "How a message travels.",
        _classes(),
    )


def _topic_row(topic: Topic[Any]) -> tuple[str, ...]:
    return (
        code(topic.key),
        _message(topic.type),
        _PRODUCERS.get(topic.producer, topic.producer),
        topic.when,
        topic.qos.value,
        "yes" if topic.in_trial else "",
        _size(topic.max_bytes),
        str(topic.kept) if topic.qos is not Qos.TELEMETRY else "",
    )


def _query_row(query: Query[Any, Any]) -> tuple[str, ...]:
    return (
        code(query.key),
        _message(query.request),
        _message(query.reply),
        query.server,
        _ASKERS.get(query.askers, ", ".join(query.askers)),
        _size(query.max_bytes),
    )


def _message(kind: type) -> str:
    return f"[{kind.__name__}](messages.md#{kind.__name__.lower()})"


def _size(count: int) -> str:
    return f"{count // 2**20} MiB" if count >= 2**20 else f"{count // 2**10} KiB"


def _classes() -> str:
    """Return the classes as the docstring of `Qos` tells them, as a list."""
    words = (getdoc(Qos) or "").partition("\n\n")[2].split("\n")
    names = {f"{qos.name}:": f"- **{qos.value}**:" for qos in Qos}
    lines = [
        " ".join([names.get(first, f"  {first}"), *rest])
        for first, *rest in (line.split(" ") for line in words)
    ]
    return "\n".join(lines)

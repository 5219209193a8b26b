"""Read a trial's log with the stock MCAP reader.

    python examples/read_log.py runs/<run>

Nothing of FRAS is needed: `pip install mcap zstandard msgpack`. One sees which trial it was, what
was planned and why, how many messages each process wrote, and the largest force of each action.
"""

# %% The file tells its own types: a JSON Schema for each key.
import json
import sys
from collections import Counter
from pathlib import Path

import msgpack
from mcap.exceptions import McapError
from mcap.reader import make_reader

given = Path(sys.argv[1])
with (given / "audit.mcap" if given.is_dir() else given).open("rb") as file:
    reader = make_reader(file, validate_crcs=True)
    try:
        summary = reader.get_summary()
    except McapError:  # what a cut file ends with is no index
        summary = None
    if summary is None:
        raise SystemExit("it was cut before its index was written: fras log recover makes it whole")
    (about,) = (one.metadata for one in reader.iter_metadata() if one.name == "fras")
    print(f"trial {about['trial']}, FRAS {about['fras_version']}, rules {about['asp_digest'][:12]}")
    schemas = {one.topic: summary.schemas[one.schema_id] for one in summary.channels.values()}
    fields = json.loads(schemas["sa/verdict"].data)
    print("a verdict is a", fields["$ref"].rpartition("/")[2])

    # %% Messages in the order in which they arrived; payloads are MessagePack.
    counts: Counter[str] = Counter()
    forces_n: dict[str, float] = {}
    action = ""
    for _, channel, message in reader.iter_messages(log_time_order=True):
        content = msgpack.unpackb(message.data)
        counts[content.get("source", "").partition("/")[0]] += 1
        if channel.topic == "planner/plan":
            print("plan:", " → ".join(one["text"] for one in content["actions"]))
            print(*(f"  {sentence}" for sentence in content["explanation"]), sep="\n")
        elif channel.topic == "robot/state":
            now = content["action"]
            action = f"{now['name']}({now['arm']})" if now else action
        elif channel.topic == "sa/verdict" and action:
            forces_n[action] = max(forces_n.get(action, 0.0), content["max_force_n"])

# %% What it comes to.
print("messages:", ", ".join(f"{name} {count}" for name, count in counts.most_common()))
for name, force_n in forces_n.items():
    print(f"{name:14} at most {force_n:.3f} N")
